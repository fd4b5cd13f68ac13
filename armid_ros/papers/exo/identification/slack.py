# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Whether straps hang loose: how far they give before they pull.

A strap with slack pulls with k (|D| - slack) along D, and not at all where it is drawn out less.
The slack is not linear: the stiffness is fitted at several slacks, and that of the best fit is
refined by the parabola through it and its neighbours, whose bend says how sure it is.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from armid_ros.identification.ties.problem import InteractionProblem
from armid_ros.identification.ties.stiffness import identify_interaction, Interaction
import numpy as np

#: Slacks that are tried [m]; a strap that hangs looser is off.
_TRIED = (0.0, 0.001, 0.002, 0.004, 0.006)
#: Steps to either side of the best one, successively [m].
_REFINED = (5e-4, 2e-4)
#: Drop of the misfit, in units of its own noise, from which straps are slack: z > 5.
_LEAST_GAIN = 25.0


@dataclass(frozen=True)
class Slack:
    """
    How far the ties between two machines give before they pull.

    Attributes
    ----------
    value, std : float
        The slack of all of them and its standard deviation [m].
    gain : float
        Drop of the misfit from that without slack, in units of its noise.
    interaction : Interaction
        The stiffnesses with this slack.

    """

    value: float
    std: float
    gain: float
    interaction: Interaction

    @property
    def seen(self) -> bool:
        """Whether straps are surely slack."""
        return self.gain > _LEAST_GAIN


def find_slack(problem: Callable[[float], InteractionProblem]) -> Slack:
    """
    Fit the slack that all ties share, and their stiffnesses with it.

    Parameters
    ----------
    problem : callable
        Sets up the regression for a slack [m].

    """
    fits: dict[float, Interaction] = {}

    def misfit(slack: float) -> float:
        if slack not in fits:
            fits[slack] = identify_interaction(problem(slack))
        return fits[slack].misfit

    best = min(_TRIED, key=misfit)
    bend = np.inf
    for step in _REFINED:
        centre = max(best, step)
        lower, middle, upper = (misfit(centre + k * step) for k in (-1, 0, 1))
        bend = (lower - 2.0 * middle + upper) / step**2
        if bend > 0.0:
            best = float(np.clip(centre + (lower - upper) / (2.0 * bend * step), 0.0, 1.0))
    misfit(best)
    found = fits[best]
    freedom = max(1, found.residual.size - len(found.estimate.values))
    noise = max(1.0, found.misfit / freedom)
    std = float(np.sqrt(2.0 * noise / bend)) if bend > 0.0 else np.inf
    return Slack(best, std, (misfit(0.0) - found.misfit) / noise, found)
