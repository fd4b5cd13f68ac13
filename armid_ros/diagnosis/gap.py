# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The gap between model and measurement, before and after, beside the noise, on held-out data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.evidence import trajectories, Trajectory
from armid_ros.diagnosis.floor import Floor, noise_floor
from armid_ros.diagnosis.model_search import Explanation
from armid_ros.diagnosis.problem import make_problem, project
from armid_ros.diagnosis.selection import solve_products
from armid_ros.identification.signals import Conditioning
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np

#: A joint that had no gap counts when it has this much more than passes as noise.
_WORSE = 1.2


@dataclass(frozen=True)
class Overlay:
    """
    Torques of one trajectory, filtered alike.

    Attributes
    ----------
    source : str
        The recording.
    trajectory : Trajectory
        Its motion.
    measured, before, after : ndarray, shape (M, n)
        Measured torque, and what both models predict [N m].
    sigma : ndarray, shape (n,)
        Noise [N m].

    """

    source: str
    trajectory: Trajectory
    measured: FloatArray
    before: FloatArray
    after: FloatArray
    sigma: FloatArray


@dataclass(frozen=True)
class Gap:
    """
    Errors in numbers.

    Attributes
    ----------
    before, after, floor : ndarray, shape (n,)
        Root mean square error of each joint without and with what was named, and the noise [N m].
    loss_before, loss_after : ndarray, shape (n,)
        Mean square over noise.
    closed : float
        Share of the excess over the noise that is gone, 0 to 1, in the joints that had a gap or
        have one.
    predicted : bool
        Whether it was measured on recordings that nothing was fitted to; else on each part of the
        data, with values from the others.
    overlays : tuple of Overlay
        The curves.

    """

    before: FloatArray
    after: FloatArray
    floor: FloatArray
    loss_before: FloatArray
    loss_after: FloatArray
    closed: float
    predicted: bool
    overlays: tuple[Overlay, ...]

    @property
    def data(self) -> str:
        """What it was measured on, for a reader."""
        return 'held-out' if self.predicted else 'held-out, each part of the data in turn'


def measure_gap(
    explanation: Explanation,
    data: Sequence[Trajectory],
    floors: Sequence[Floor],
    validate: Sequence[Recording],
    used: Conditioning,
    lowest: float,
) -> Gap:
    """Measure the gap on recordings to be predicted, else on each part of the data in turn."""
    before, after = explanation.reference.arm, explanation.fitted.arm
    if validate:
        unseen = trajectories(validate, used, before)
        sigma = [noise_floor(part, after).sigma for part in unseen]
        overlays = [
            _overlay(part, s, before, after) for part, s in zip(unseen, sigma, strict=True)
        ]
        pairs = [(o.measured - o.before, o.measured - o.after) for o in overlays]
        return _gap(unseen, sigma, pairs, lowest, overlays, predicted=True)
    sigma = [floor.sigma for floor in floors]
    overlays = [_overlay(part, s, before, after) for part, s in zip(data, sigma, strict=True)]
    pairs = _left_out(explanation, data, sigma)
    return _gap(data, sigma, pairs, lowest, overlays, predicted=False)


def _overlay(part: Trajectory, sigma: FloatArray, before: ArmModel, after: ArmModel) -> Overlay:
    assert part.motion.tau is not None
    measured = part.reduce(part.motion.tau)
    without, patched = part.residual(before), part.residual(after)
    return Overlay(part.source, part, measured, measured - without, measured - patched, sigma)


def _gap(
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
    pairs: Sequence[tuple[FloatArray, FloatArray]],
    lowest: float,
    overlays: Sequence[Overlay],
    *,
    predicted: bool,
) -> Gap:
    told = np.concatenate([part.told for part in data])
    noise = np.concatenate(
        [np.broadcast_to(s, part.told.shape) for part, s in zip(data, sigma, strict=True)]
    )
    before, after = (np.concatenate([pair[k] for pair in pairs]) for k in (0, 1))
    count = np.maximum(told.sum(axis=0), 1)

    def mean(squares: FloatArray) -> FloatArray:
        return np.asarray(np.sum(squares, axis=0, where=told) / count)

    losses = [mean((left / noise) ** 2) for left in (before, after)]
    gap = (losses[0] > lowest) | (losses[1] > _WORSE * lowest)
    beyond = [float(np.sum(np.maximum(loss[gap] - 1.0, 0.0))) for loss in losses]
    closed = 1.0 - beyond[1] / beyond[0] if beyond[0] > 0.0 else 0.0
    return Gap(
        np.sqrt(mean(before**2)),
        np.sqrt(mean(after**2)),
        np.sqrt(mean(noise**2)),
        losses[0],
        losses[1],
        float(np.clip(closed, 0.0, 1.0)),
        predicted,
        tuple(overlays),
    )


def _left_out(
    explanation: Explanation, data: Sequence[Trajectory], sigma: Sequence[FloatArray]
) -> list[tuple[FloatArray, FloatArray]]:
    """Predict each part of the data with values of the named effects from the other parts."""
    fitted = explanation.fitted
    if not fitted.named:
        return list(zip(explanation.reference.residual, fitted.residual, strict=True))
    problem = make_problem(data, sigma, fitted.residual, list(fitted.columns))
    count = len(fitted.estimate.values)
    size = problem.x.shape[2]
    projection = project(problem, range(size - count))
    columns = projection.rest(problem.x[:, :, size - count :])
    left = projection.rest(problem.y)
    flat, owner = columns.reshape(-1, count), np.repeat(problem.fold, problem.y.shape[1])
    change = np.zeros_like(left)
    for k in range(problem.folds):
        others = owner != k
        own = flat[others].T @ flat[others]
        step, _ = solve_products(own, flat[others].T @ left.ravel()[others])
        rows = problem.fold == k
        change[rows] = columns[rows] @ step
    weighted = np.where(problem.used, left - change, 0.0)
    after = weighted / np.where(problem.used, problem.weight, 1.0)
    cuts = np.cumsum([len(part.rows) for part in data])[:-1]
    return list(zip(explanation.reference.residual, np.split(after, cuts), strict=True))
