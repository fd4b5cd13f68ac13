# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How well a recording repeats itself from one period of its motion to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.identification import Fit
from armid_ros.identification.rows.period import find_period
from armid_ros.motion import FloatArray
import numpy as np

#: Motion in which a period is looked for [s].
_SEARCHED = 150.0
#: Fewer pairs of samples tell no deviation.
_FEWEST = 20


@dataclass(frozen=True)
class Repeatability:
    """
    What two periods of one motion differ by.

    The difference is of the residual, in which each period has its own positions: what depends on
    the motion alone cancels, be it modelled or not.

    Attributes
    ----------
    period : float
        [s].
    varying : ndarray, shape (n,)
        Standard deviation of what does not repeat [N m].
    residual : ndarray, shape (n,)
        Root mean square of the residual of the same samples [N m].

    """

    period: float
    varying: FloatArray
    residual: FloatArray

    @property
    def repeating_share(self) -> FloatArray:
        """Share of the residual's power that every period has, shape (n,): no noise."""
        power = np.where(self.residual > 0.0, self.residual, 1.0) ** 2
        return np.asarray(np.clip(1.0 - self.varying**2 / power, 0.0, 1.0))

    @staticmethod
    def of(fits: Sequence[Fit]) -> Repeatability | None:
        """Compare periods of the longest stretch of a recording; None where nothing repeats."""
        fit = max(fits, key=lambda one: len(one.motion))
        count = int(np.searchsorted(fit.motion.t, fit.motion.t[0] + _SEARCHED))
        motion = fit.motion.select(slice(count))
        found = find_period(motion) if count > _FEWEST else None
        if found is None or found[1].stop - found[1].start < _FEWEST:
            return None
        lag, where = found
        first = slice(where.start, where.stop)
        second = slice(where.start + lag, where.stop + lag)
        used = fit.informative[first] & fit.informative[second]
        pairs = np.maximum(used.sum(axis=0), 1)
        one, other = fit.residual[first], fit.residual[second]
        apart = np.sum((other - one) ** 2, axis=0, where=used) / pairs
        both = np.sum(one**2 + other**2, axis=0, where=used) / pairs
        return Repeatability(
            float(motion.t[lag] - motion.t[0]), np.sqrt(0.5 * apart), np.sqrt(0.5 * both)
        )
