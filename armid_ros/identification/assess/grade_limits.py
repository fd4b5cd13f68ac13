# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Limits of the grades of an identification, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

#: Grade of an identification.
Word = Literal['good', 'poor', 'unusable']
#: Number of independent values of a residual in one recording. Ten unchanged simulated arms made
#: other motions each day. The logarithm of the ratio of two residuals of a joint had a deviation
#: of 0.35 with one recording per day and 0.19 with three; 8 independent values correspond to 0.38
#: and 0.21. One of the twenty pairs is reported as different.
FREEDOM = 8


@dataclass(frozen=True)
class GradeLimits:
    """
    Limits for the grades of an identification, and for tests of mistakes in recordings.

    Attributes
    ----------
    poor : float
        Relative torque error of a joint on held-out data above which a model is poor [%].
        Published identifications of industrial arms reach 4 to 18 %; feed-forward with a larger
        error is no better than with an unknown payload.
    unusable : float
        Error above which a model is unusable [%]. It then explains less than three quarters of
        the torque's power: 1 - 0.5^2. A hypothesis with a larger error is not accepted either.
    undetermined : float
        Ratio of the error between the halves of a recording to that of the fit. With r parameters
        and N independent rows it is about (N + r) / (N - r): 3 for two rows per parameter, where
        half of the fit is noise.
    floor : float
        Share of a joint's torque below which an error does not count: the residual of a good
        identification, which needs no cause.
    gain : float
        Likelihood ratio per independent sample, for every fitted value, from which a hypothesis is
        accepted. It is the factor by which the error of one joint, or of several together, falls;
        two is three quarters of the power. With a fitted body, hypotheses reached less than 1.2 on
        sound recordings of three simulated arms, and at least 4 on recordings with mistakes.
    free_body : float
        Exponent of `gain` for a hypothesis that needs a fitted body, as the ten values of a link
        can fit every change of the data.
    torque_factor : float
        Factor between effort and N m from which the description cannot be at fault: its masses are
        rarely all wrong by two in the same direction.
    gravity_change : float
        Change of the gravity vector, as a share of its length, from which wrong masses are not the
        cause; a quarter is a tilt of 14 degrees.

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
    """Return the grade for a relative torque error on held-out data [%]."""
    return 'good' if error <= LIMITS.poor else 'poor' if error <= LIMITS.unusable else 'unusable'
