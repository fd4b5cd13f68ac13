# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Weighted regression rows of the baseline recordings and of the diagnosed recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import count_recordings, row_weights, Trajectory
from armid_ros.identification.rows.period import is_same_path
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Standard deviation of the discrepancy's change from one recording of a motion to another, over
#: that between motions. Likeliest is 0.1 to 0.5 in 20 healthy arms and a real machine.
REPEATED = 0.5


@dataclass(frozen=True)
class Rows:
    """
    Weighted regression rows of the baseline recordings and of the diagnosed ones.

    Attributes
    ----------
    data : tuple of Trajectory
        Baseline trajectories, then diagnosed ones; their `fold` is the number of the recording.
    sigma : tuple of ndarray, each (n,)
        Standard deviation by which the torques of each trajectory are divided [N m].
    n_baseline : int
        Number of baseline recordings.
    amplitude : tuple of ndarray, each (n,)
        Unit of the model discrepancy of each recording: a misfit, or an rms torque [N m].
    misfit_only : bool
        Whether only the size of the misfit is known, and no baseline recording.

    """

    data: tuple[Trajectory, ...]
    sigma: tuple[FloatArray, ...]
    n_baseline: int
    amplitude: tuple[FloatArray, ...]
    misfit_only: bool = False

    @classmethod
    def over_noise(cls, evidence: Evidence) -> Rows:
        """Return the rows of diagnosed recordings, weighted by noise; there is no baseline."""
        torque = np.maximum(evidence.torque_rms, 1e-3 * evidence.torque_rms.max())
        amplitude = (torque,) * count_recordings(evidence.data)
        return cls(evidence.data, evidence.sigma, 0, amplitude).above_rounding()

    def above_rounding(self) -> Rows:
        """Return the rows with `sigma` and `amplitude` at least 1e-4 of the rms torque."""
        least = 1e-4 * self.torque
        return replace(
            self,
            sigma=tuple(np.maximum(one, least) for one in self.sigma),
            amplitude=tuple(np.maximum(one, least) for one in self.amplitude),
        )

    @cached_property
    def weight(self) -> list[FloatArray]:
        """Return 1 / sigma in rows in which a joint moves, else zero, (M, n) [1/(N m)]."""
        pairs = zip(self.data, self.sigma, strict=True)
        return [row_weights([part], [sigma]) for part, sigma in pairs]

    @cached_property
    def diagnosed(self) -> npt.NDArray[np.bool_]:
        """Return a mask (K,) of the recordings that are diagnosed; the others are the baseline."""
        return np.arange(max(part.fold for part in self.data) + 1) >= self.n_baseline

    @cached_property
    def repeated(self) -> list[list[int]]:
        """Return the recordings of each motion that several recordings contain."""
        groups = list[list[Trajectory]]()
        for part in self.data:
            for group in groups:
                if is_same_path(group[0].at_rows.q, part.at_rows.q):
                    group.append(part)
                    break
            else:
                groups.append([part])
        recordings = (sorted({part.fold for part in group}) for group in groups)
        return [own for own in recordings if len(own) > 1]

    @cached_property
    def similarity(self) -> FloatArray:
        """Return the correlation of the discrepancies of single recordings, shape (K, K)."""
        found = np.eye(len(self.diagnosed))
        for group in self.repeated:
            found[np.ix_(group, group)] = 1.0 - REPEATED**2
        np.fill_diagonal(found, 1.0)
        return found

    @cached_property
    def diagnosed_parts(self) -> list[int]:
        """Return the indices of the diagnosed trajectories."""
        return [k for k, part in enumerate(self.data) if self.diagnosed[part.fold]]

    def rms_of_diagnosed(self, columns: Sequence[FloatArray]) -> FloatArray:
        """Return the rms of columns (M, n, p) over diagnosed rows in which each joint moves."""
        squares, count = np.zeros(columns[0].shape[1:]), np.zeros((columns[0].shape[1], 1))
        for k in self.diagnosed_parts:
            moving = self.weight[k][:, :, np.newaxis] > 0.0
            squares += np.sum(columns[k] ** 2, axis=0, where=moving)
            count += moving.sum(axis=0)
        return np.asarray(np.sqrt(squares / np.maximum(count, 1.0)))

    @cached_property
    def torque(self) -> FloatArray:
        """Root mean square torque of each joint while the arm moves, shape (n,) [N m]."""
        parts = [part.torque[part.informative.any(axis=1)] for part in self.data]
        rms = np.sqrt(np.mean(np.concatenate(parts) ** 2, axis=0))
        return np.asarray(np.maximum(rms, 1e-3 * rms.max()))

    def weighted(self, columns: Sequence[FloatArray], joints: Sequence[int]) -> list[FloatArray]:
        """Divide columns (M, n, p) by `sigma`; return each recording as (joints, M, p)."""
        index = list(joints)
        rows = [
            (own[:, index] * weight[:, index, np.newaxis]).swapaxes(0, 1)
            for own, weight in zip(columns, self.weight, strict=True)
        ]
        folds = [part.fold for part in self.data]
        return [
            np.concatenate([x for x, fold in zip(rows, folds, strict=True) if fold == k], axis=1)
            for k in range(len(self.diagnosed))
        ]
