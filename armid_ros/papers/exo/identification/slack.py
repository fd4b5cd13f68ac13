# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Slack of the straps: the extension at which a strap starts to pull.

A strap with slack pulls with k (|D| - slack) along D if |D| exceeds the slack, and not otherwise.
The torque is nonlinear in the slack, so the stiffness is fitted at several slacks. A parabola
through the best fit and its neighbours gives the slack, and its curvature the standard deviation.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from armid_ros.identification.ties.problem import InteractionProblem
from armid_ros.identification.ties.stiffness import identify_interaction, Interaction
import numpy as np

#: Decrease of the misfit, in standard deviations of its noise, above which slack is significant.
_LEAST_GAIN = 25.0


@dataclass(frozen=True)
class Slack:
    """
    The slack of the ties between two machines.

    Attributes
    ----------
    value, std : float
        Common slack of all ties and its standard deviation [m].
    gain : float
        Decrease of the misfit relative to the fit without slack, in units of its noise.
    interaction : Interaction
        The stiffnesses with this slack.

    """

    value: float
    std: float
    gain: float
    interaction: Interaction

    @property
    def seen(self) -> bool:
        """Whether the slack is significant."""
        return self.gain > _LEAST_GAIN


def find_slack(problem: Callable[[float], InteractionProblem]) -> Slack:
    """
    Fit the slack that all ties share, and their stiffnesses with it.

    Parameters
    ----------
    problem : callable
        Callback that returns the regression for a slack [m].

    """
    fits: dict[float, Interaction] = {}

    def misfit(slack: float) -> float:
        if slack not in fits:
            fits[slack] = identify_interaction(problem(slack))
        return fits[slack].misfit

    # [m]; a strap with more slack is not worn
    best = min((0.0, 0.001, 0.002, 0.004, 0.006), key=misfit)
    bend = np.inf
    # steps on either side of the best slack [m]
    for step in (5e-4, 2e-4):
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
