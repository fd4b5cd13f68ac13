# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Weighted rows of the recordings of the baseline (first day) and of the diagnosed day."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import count_recordings, row_weights, Trajectory
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Rows:
    """
    Weighted regression rows of both days: the baseline, and the diagnosed day.

    Attributes
    ----------
    data : tuple of Trajectory
        Trajectories of the first day, then of the diagnosed day; `fold` counts through both.
    sigma : tuple of ndarray, each (n,)
        Unit of each trajectory [N m].
    before : int
        Number of recordings of the first day.
    amplitude : tuple of ndarray, each (n,)
        Unit of the discrepancies of each recording [N m].
    unseen : bool
        Whether the amplitude is the misfit of a first day without recordings.

    """

    data: tuple[Trajectory, ...]
    sigma: tuple[FloatArray, ...]
    before: int
    amplitude: tuple[FloatArray, ...]
    unseen: bool = False

    @classmethod
    def over_noise(cls, evidence: Evidence) -> Rows:
        """Weight the data of one day by their noise; discrepancy is measured in rms torques."""
        torque = np.maximum(evidence.torque_rms, 1e-3 * evidence.torque_rms.max())
        amplitude = (torque,) * count_recordings(evidence.data)
        return cls(evidence.data, evidence.sigma, 0, amplitude).not_below_rounding()

    def not_below_rounding(self) -> Rows:
        """Return the rows with units of at least 1e-4 of the rms torque, its rounding error."""
        least = 1e-4 * self.torque
        return replace(
            self,
            sigma=tuple(np.maximum(one, least) for one in self.sigma),
            amplitude=tuple(np.maximum(one, least) for one in self.amplitude),
        )

    @cached_property
    def weight(self) -> list[FloatArray]:
        """Return the weights of each trajectory, (M, n)."""
        pairs = zip(self.data, self.sigma, strict=True)
        return [row_weights([part], [sigma]) for part, sigma in pairs]

    @cached_property
    def today(self) -> npt.NDArray[np.bool_]:
        """Return which recordings are of the diagnosed day, shape (K,)."""
        return np.arange(max(part.fold for part in self.data) + 1) >= self.before

    @property
    def repeated(self) -> bool:
        """Return whether there are enough recordings to estimate how values vary between them."""
        return 0 < self.before and len(self.today) > 2

    @cached_property
    def today_parts(self) -> list[int]:
        """Return the indices of the trajectories of the diagnosed day."""
        return [k for k, part in enumerate(self.data) if self.today[part.fold]]

    @cached_property
    def informative(self) -> FloatArray:
        """Return the number of informative rows of the diagnosed day, at least 1, (n,)."""
        count = np.sum([(self.weight[k] > 0.0).sum(axis=0) for k in self.today_parts], axis=0)
        return np.asarray(np.maximum(count, 1), dtype=float)

    def rms_today(self, columns: Sequence[FloatArray]) -> FloatArray:
        """Return the rms of columns (M, n, p) in the rows of the diagnosed day, (n, p)."""
        squares = np.zeros(columns[0].shape[1:])
        for k in self.today_parts:
            moving = self.weight[k][:, :, np.newaxis] > 0.0
            squares += np.sum(columns[k] ** 2, axis=0, where=moving)
        return np.asarray(np.sqrt(squares / self.informative[:, np.newaxis]))

    @cached_property
    def torque(self) -> FloatArray:
        """Root mean square torque where joints move, shape (n,) [N m]."""
        parts = [part.torque[part.informative.any(axis=1)] for part in self.data]
        rms = np.sqrt(np.mean(np.concatenate(parts) ** 2, axis=0))
        return np.asarray(np.maximum(rms, 1e-3 * rms.max()))

    def weighted(self, columns: Sequence[FloatArray], joints: Sequence[int]) -> list[FloatArray]:
        """Return weighted columns of each recording, (joints, M, p), from columns (M, n, p)."""
        index = list(joints)
        rows = [
            (own[:, index] * weight[:, index, np.newaxis]).swapaxes(0, 1)
            for own, weight in zip(columns, self.weight, strict=True)
        ]
        folds = [part.fold for part in self.data]
        return [
            np.concatenate([x for x, fold in zip(rows, folds, strict=True) if fold == k], axis=1)
            for k in range(len(self.today))
        ]
