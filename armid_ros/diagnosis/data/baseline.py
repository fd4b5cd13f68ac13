# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The model's own misfit: what it leaves of recordings in which nothing was wrong.

No real arm is as its model to the noise. What the model leaves of recordings that it was
identified from is smaller than what it leaves of others, so each of them is predicted with
parameters that the others have. What others do not tell stays as it is in the model, as far as a
description can be believed: a joint may have been moved in one recording alone.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Trajectory
from armid_ros.diagnosis.data.prior import described_precision, excited, Prior
from armid_ros.diagnosis.data.rows import fold_rows, weighted_rows
from armid_ros.effects import Effect
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
import numpy as np


@dataclass(frozen=True)
class Baseline:
    """
    Recordings in which nothing was wrong.

    Attributes
    ----------
    data : tuple of Trajectory
        The recordings.
    residual : tuple of ndarray, each (M, n)
        What the model leaves of them [N m].
    misfit : ndarray, shape (n,)
        Root mean square that it leaves of recordings it was not identified from [N m].
    varies : ndarray, shape (n,)
        Squares that it leaves of the recording it predicts worst, over those of all: another
        motion makes another misfit.

    """

    data: tuple[Trajectory, ...]
    residual: tuple[FloatArray, ...]
    misfit: FloatArray
    varies: FloatArray

    @classmethod
    def of(cls, arm: ArmModel, data: Sequence[Trajectory], rng: np.random.Generator) -> Baseline:
        """Measure the misfit of a model."""
        residual = [part.residual(arm) for part in data]
        base, columns = excited(arm, arm.base_parameters(rng), data)
        held = described_precision(base, arm)
        informative = np.concatenate([part.informative for part in data])
        left = np.concatenate(residual)
        w = np.concatenate(columns)
        informative[:, ~informative.any(axis=0)] = True  # of a joint that never moved, all of it
        scale = np.sqrt(np.mean(left**2, axis=0, where=informative))
        weight = informative / np.maximum(scale, 1e-12)
        rows = w * weight[:, :, np.newaxis]
        aim = left * weight
        fold = fold_rows(data)
        folds = range(int(fold.max()) + 1)
        own = [np.einsum('rnp,rnq->pq', rows[fold == k], rows[fold == k]) for k in folds]
        to = [np.einsum('rnp,rn->p', rows[fold == k], aim[fold == k]) for k in folds]
        whole = np.linalg.lstsq(sum(own) + held, sum(to), rcond=1e-10)[0]
        for k in folds:
            others = np.linalg.lstsq(sum(own) - own[k] + held, sum(to) - to[k], rcond=1e-10)[0]
            left[fold == k] += w[fold == k] @ (whole - others)
        others = np.sqrt(np.mean(left**2, axis=0, where=informative))
        counts = np.array([informative[fold == k].sum(axis=0) for k in folds])
        sums = np.array(
            [np.sum(left[fold == k] ** 2, axis=0, where=informative[fold == k]) for k in folds]
        )
        worst = np.max(sums / np.maximum(counts, 1), axis=0)
        return cls(
            tuple(data),
            tuple(residual),
            np.sqrt(scale * others),
            worst / np.maximum(others**2, 1e-300),
        )

    @property
    def error(self) -> float:
        """Share of the torque that the model leaves, of all joints together."""
        left = np.concatenate([rows.ravel() for rows in self.residual])
        torque = np.concatenate([part.torque.ravel() for part in self.data])
        return float(np.linalg.norm(left) / max(float(np.linalg.norm(torque)), 1e-300))

    def prior(self, arm: ArmModel, base: BaseParameters) -> Prior:
        """
        Return what these recordings tell of what is free of an arm.

        It is the arm whose misfit was measured, or has more effects that are zero.

        """
        rows = [
            part.reduce(arm.columns(part.motion)[:, :, base.independent]) for part in self.data
        ]
        return Prior(self.data, self._weighted(rows), self._weighted(self.residual))

    def columns(self, arm: ArmModel, effect: Effect, kept: Sequence[int]) -> FloatArray:
        """Return the columns of an effect over the misfit, one row a row and joint, (S, p)."""
        rows = [part.columns(arm, effect)[:, :, list(kept)] for part in self.data]
        return np.concatenate([part.reshape(-1, len(kept)) for part in self._weighted(rows)])

    def _weighted(self, rows: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
        return tuple(weighted_rows(rows, self.data, [self.misfit] * len(self.data)))
