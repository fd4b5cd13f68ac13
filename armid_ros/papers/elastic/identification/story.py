# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the tuning did, where the arm is known: step responses and parameters before and after."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from armid_ros.motion import FloatArray
from armid_ros.papers.elastic.identification.names import parameter_names, unpack
from armid_ros.papers.elastic.identification.response import velocities
from armid_ros.papers.elastic.identification.tuning import Tuning
from armid_ros.robots.two_link import TwoLinkParameters
import numpy as np

#: Parameters that step responses determine well; friction and spring damping are less certain.
MAIN = ('alpha', 'beta', 'gamma', 'mm', 'kg')


@dataclass(frozen=True)
class TuningStory:
    """
    Errors of a simulated arm's step responses and parameters.

    Attributes
    ----------
    before, after : float
        Root mean square error of the velocities against those of the true arm, without any
        noise, with the parameters at the start and at the end [rad/s].
    worst_before, worst_after : float
        Largest error of a main parameter [%].

    """

    before: float
    after: float
    worst_before: float
    worst_after: float

    @classmethod
    def of(cls, tuning: Tuning, start: TwoLinkParameters, truth: TwoLinkParameters) -> TuningStory:
        """Compare a tuning with the arm that was simulated."""
        clean = velocities(tuning.steps, truth)
        return cls(
            _rms(tuning.before - clean),
            _rms(tuning.after - clean),
            _worst(start, truth),
            _worst(tuning.parameters, truth),
        )

    def sentence(self) -> str:
        """Say what the tuning did."""
        return (
            f'step responses of the true arm: {self.before:.3g} rad/s rms off before tuning, '
            f'{self.after:.2g} after, {self.before / self.after:.0f} times smaller; main '
            f'parameters within {self.worst_before:.2g} % before, {self.worst_after:.2g} % after'
        )

    def document(self) -> dict[str, Any]:
        """Return the numbers for programs to read."""
        return {
            'error_before': self.before,
            'error_after': self.after,
            'unit': 'rad/s',
            'factor': self.before / self.after,
            'main_parameters_percent_before': self.worst_before,
            'main_parameters_percent_after': self.worst_after,
        }


def _rms(errors: FloatArray) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def _worst(found: TwoLinkParameters, truth: TwoLinkParameters) -> float:
    main = np.array([name.name in MAIN for name in parameter_names(('', ''))])
    off = unpack(found) / unpack(truth) - 1.0
    return float(100.0 * np.abs(off[main]).max())
