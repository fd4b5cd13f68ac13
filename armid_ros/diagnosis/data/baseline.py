# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The misfit of a model in baseline recordings, and the prior that the description gives.

The misfit is the residual of a model in recordings from a time when the model was right. No model
describes a real arm to within the noise. The residual is smaller in the recordings of the
identification, so each fold is also predicted with parameters fitted to the other folds. The
description is the prior of parameters that the other folds do not determine: a joint may have
moved in one recording only.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel, Misfit
from armid_ros.arm.misfit import RowFilters
from armid_ros.diagnosis.data.evidence import Evidence, torque_rms
from armid_ros.diagnosis.data.trajectory import (
    fold_rows,
    row_weights,
    trajectories,
    Trajectory,
)
from armid_ros.identification.fitting.least_squares import informative_solution, scaled_inverse
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.model import BaseParameters, group_columns
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
import scipy.linalg


def excited_parameters(
    arm: ArmModel, theory: BaseParameters, data: Sequence[Trajectory]
) -> tuple[BaseParameters, list[FloatArray]]:
    """Return the base parameters that the data make identifiable, and their regressors."""
    columns = [part.base_columns(arm, arm.effects, theory.independent) for part in data]
    stacked = np.concatenate([block.reshape(-1, theory.rank) for block in columns])
    names = tuple(theory.standard[column] for column in theory.independent)
    kept = group_columns(stacked, names, tolerance=1e-4)  # share of the length of a column
    if kept.rank == theory.rank:
        return theory, columns
    base = replace(
        theory,
        parameters=tuple(theory.parameters[k] for k in kept.independent),
        independent=theory.independent[kept.independent],
        grouping=kept.grouping @ theory.grouping,
    )
    return base, [block[:, :, kept.independent] for block in columns]


def described_precision(
    base: BaseParameters, arm: ArmModel, known: FloatArray | None = None
) -> FloatArray:
    """
    Return the precision (r, r) of base parameters that the robot description gives as prior.

    The prior standard deviation of a parameter is about its described value; that of an effect
    with value zero is its largest expected value. Data change the parameters that they determine;
    the others keep values that predict other motions well. A parameter of infinite variance gives
    zero precision along its column of the grouping.

    Parameters
    ----------
    base : BaseParameters
        The base parameters.
    arm : ArmModel
        The arm as described.
    known : ndarray, shape (P, P), optional
        Information on its first parameters, from recordings that are no longer available.

    """
    values = np.abs(arm.theta[len(arm.robot.rigid_parameters) :])
    largest = np.concatenate([[], *(effect.spread(arm.robot) for effect in arm.effects)])
    of_effects = np.where(values > 0.0, values, largest)
    std = np.concatenate([arm.robot.described_spread.ravel(), of_effects])
    finite = np.isfinite(std)
    covariance = np.diag(std[finite] ** 2)
    if known is not None:
        precision = np.diag(std**-2.0)
        precision[: len(known), : len(known)] += known
        finite = np.diag(precision) > 0.0
        covariance = scaled_inverse(precision[np.ix_(finite, finite)])
    kept = np.eye(base.rank)
    if not finite.all():
        kept = scipy.linalg.null_space(base.grouping[:, ~finite].T)
    within = kept.T @ base.grouping[:, finite]
    return np.asarray(kept @ scaled_inverse(within @ covariance @ within.T) @ kept.T)


def refitted_arm(
    arm: ArmModel, base: BaseParameters, data: Sequence[Trajectory], sigma: Sequence[FloatArray]
) -> ArmModel:
    """Fit the base parameters of an arm to trajectories, weighted by torque noise `sigma`."""
    columns = [part.base_columns(arm, arm.effects, base.independent) for part in data]
    weight = row_weights(data, sigma)
    x = (np.concatenate(columns) * weight[:, :, np.newaxis]).reshape(-1, base.rank)
    y = np.concatenate([part.residual(arm) for part in data]) * weight
    matrix, vector = described_precision(base, arm) + x.T @ x, x.T @ y.ravel()
    theta = arm.theta
    change = informative_solution(matrix, vector)
    return arm.with_theta(base.lift(base.values(theta) + change, theta))


@dataclass(frozen=True)
class Baseline:
    """
    Recordings from a time when the model was right, with the model's residual in them.

    Attributes
    ----------
    data : tuple of Trajectory
        The recordings.
    residual : tuple of ndarray, each (M, n)
        Residual of the model in each trajectory [N m].
    misfit : ndarray, shape (n,)
        Geometric mean of two rms residuals: of the model as given, and of folds predicted from
        the other folds [N m].
    varies : ndarray, shape (n,)
        Mean square residual of the worst predicted fold over that of all folds, as the misfit
        varies from motion to motion.

    """

    data: tuple[Trajectory, ...]
    residual: tuple[FloatArray, ...]
    misfit: FloatArray
    varies: FloatArray

    @classmethod
    def of(cls, arm: ArmModel, data: Sequence[Trajectory], rng: np.random.Generator) -> Baseline:
        """Measure the residual of a model in baseline recordings by cross-validation."""
        residuals = [part.residual(arm) for part in data]
        base, columns = excited_parameters(arm, arm.base_parameters(rng), data)
        prior = described_precision(base, arm)
        informative = np.concatenate([part.informative for part in data])
        informative[:, ~informative.any(axis=0)] = True  # all rows of a joint that never moved
        x, y = np.concatenate(columns), np.concatenate(residuals)
        given = np.sqrt(np.mean(y**2, axis=0, where=informative))
        weight = informative / np.maximum(given, 1e-12)
        rows, target = x * weight[:, :, np.newaxis], y * weight
        fold = fold_rows(data)
        folds = [fold == k for k in range(int(fold.max()) + 1)]
        squares = [np.einsum('rnp,rnq->pq', rows[own], rows[own]) for own in folds]
        products = [np.einsum('rnp,rn->p', rows[own], target[own]) for own in folds]

        def fitted(square: FloatArray, product: FloatArray) -> FloatArray:
            return np.asarray(np.linalg.lstsq(square + prior, product, rcond=1e-10)[0])

        square, product = sum(squares), sum(products)
        whole, worst = fitted(square, product), np.zeros_like(given)
        for own, own_square, own_product in zip(folds, squares, products, strict=True):
            others = fitted(square - own_square, product - own_product)
            y[own] += x[own] @ (whole - others)
            power = np.sum(y[own] ** 2, axis=0, where=informative[own])
            worst = np.maximum(worst, power / np.maximum(informative[own].sum(axis=0), 1))
        predicted = np.sqrt(np.mean(y**2, axis=0, where=informative))
        varies = worst / np.maximum(predicted**2, 1e-300)
        return cls(tuple(data), tuple(residuals), np.sqrt(given * predicted), varies)

    @property
    def errors(self) -> tuple[float, FloatArray]:
        """
        Return rms residual divided by rms torque: of all joints together, and of each joint (n,).

        Only rows in which a joint moves are used: at rest, friction can have any torque.

        """
        rows = Evidence.over_noise(self.data, [np.ones_like(self.misfit)] * len(self.data))
        each = rows.relative_errors(self.residual)
        torque = rows.count * np.maximum(rows.torque_rms**2, 1e-300)
        whole = (each**2 @ torque) / max(float(torque.sum()), 1e-300)
        return float(np.sqrt(whole)), each


def known_misfit(
    arm: ArmModel,
    recordings: Sequence[Recording],
    used: Conditioning,
    held_out: Sequence[Recording] = (),
) -> Misfit:
    """
    Measure the rms residual of a model in recordings, for comparison in later diagnoses.

    Rows in which a joint rests or reverses are not used, as in a diagnosis: friction there is
    the largest error of a model.

    Parameters
    ----------
    arm : ArmModel
        The model.
    recordings : sequence of Recording
        Recordings that the model was fitted to.
    used : Conditioning
        Filters; the narrower the band, the less noise.
    held_out : sequence of Recording
        Recordings that the model was not fitted to; if there are any, only these count.

    Raises
    ------
    IdentificationError
        If a recording is too short for the filters.

    """
    parts = trajectories(held_out or recordings, used, arm)
    found = Baseline.of(arm, parts, np.random.default_rng(0))
    rms, torque = (
        dict(zip(arm.robot.joints, each.tolist(), strict=True))
        for each in (found.misfit, torque_rms(parts))
    )
    filters = RowFilters(used.rate_hz, used.cutoff_hz, used.decimation)
    data = 'held-out' if held_out else 'training'
    return Misfit(data, rms, 100.0 * found.errors[0], torque, filters=filters)
