# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The numbers that grade an identification: all of them, each with its reason.

What happens to the grades of real and simulated recordings when each of them is 30 % larger or
smaller is measured by ``benchmarks.grade``; see docs/identification.md.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

#: Grade of an identification, with reasons.
Word = Literal['good', 'poor', 'unusable']
#: Independent values of a residual in one recording. Of ten simulated arms that have lived and to
#: which nothing happened, with other motions each day, the logarithm of the ratio of two residuals
#: of a joint has a deviation of 0.35 with one recording a day and 0.19 with three; 8 make 0.38 and
#: 0.21. One of the twenty pairs is said to differ.
FREEDOM = 8


@dataclass(frozen=True)
class GradeLimits:
    """
    Limits of the grades, and of the likelihood ratio of a hypothesis.

    Attributes
    ----------
    poor : float
        Relative torque error of a joint on data that were not fitted [%]. Published
        identifications of industrial arms reach 4 to 18 %; feed-forward with more is no better
        than a payload that is not known.
    unusable : float
        The same [%]. A model with more takes less than three quarters of the torque's power:
        1 - 0.5^2. A hypothesis that leaves more explains nothing either.
    undetermined : float
        Ratio of the error between the halves of a recording to that of the fit. With r parameters
        and N independent rows it is (N + r) / (N - r), about: 3 where each parameter has two
        rows, so that half of what is fitted is noise.
    floor : float
        Share of a joint's torque below which an error does not count. It is what good
        identifications leave; below it nobody asks for a cause.
    gain : float
        Likelihood ratio per independent sample from which a hypothesis is accepted, for every
        value that it chooses: it divides the error of one joint, or of several together, by that.
        Two is three quarters of the power. With a fitted body no hypothesis reaches 1.2 of sound
        recordings of three arms in simulation, and of mistakes made of them the least has 4.
    free_body : float
        Power of that ratio that is asked of a hypothesis with a fitted body alone: the ten values
        of a link answer to every change of the data.
    torque_factor : float
        Factor between effort and N m from which the description cannot be what is wrong: its
        masses are rarely off by two, all of them, in the same direction.
    gravity_change : float
        Change of the gravity vector as a share of its length from which the description cannot be
        what is wrong; a quarter is a tilt of 14 degrees.

    """

    poor: float = 20.0
    unusable: float = 50.0
    undetermined: float = 3.0
    floor: float = 0.05
    gain: float = 2.0
    free_body: float = 3.0
    torque_factor: float = 2.0
    gravity_change: float = 0.25


LIMITS = GradeLimits()


def by_error(error: float) -> Word:
    """Return the grade of a relative torque error on data that were not fitted [%]."""
    return 'good' if error <= LIMITS.poor else 'poor' if error <= LIMITS.unusable else 'unusable'
