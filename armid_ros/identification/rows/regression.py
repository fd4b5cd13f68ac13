# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The linear problem of an identification: filtered torques and regressor columns of each joint.

Where a joint reverses between two samples, the time at which its dry friction changed sign is
unknown. While the joint stops, friction has any value between its limits. An error of the sign
opposes the acceleration at every reversal, so it does not average out and reduces the estimated
inertia. Torques and columns are therefore both interpolated across these samples before they are
filtered. The equation between them remains valid.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from armid_ros.arm import ArmModel
from armid_ros.identification.rows.signals import (
    Conditioning,
    decimate,
    decimated_samples,
    segments,
)
from armid_ros.motion import FloatArray, Motion, read_only, Samples
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt

#: Share of the top speed of a joint below which it is at rest.
REST_SPEED = 0.02

_Columns = Callable[[Motion], FloatArray]


@dataclass(frozen=True)
class Stretch:
    """
    Filtered and decimated motion and torque of a gap-free section of a recording.

    Attributes
    ----------
    source : str
        Path of the recording.
    motion : Motion
        Decimated motion of M samples with the filtered measured torque.
    informative : ndarray of bool, shape (M, n)
        False where a joint is at rest and dry friction may hold it with any torque.

    """

    source: str
    motion: Motion
    informative: npt.NDArray[np.bool_]

    @property
    def tau(self) -> FloatArray:
        """Return the filtered measured torque, shape (M, n) [N m]."""
        assert self.motion.tau is not None
        return self.motion.tau


@dataclass(frozen=True)
class Regression(Stretch):
    """
    Linear problem of a gap-free section: measured torque = columns @ parameters + constant.

    Attributes
    ----------
    columns : ndarray, shape (M, n, r)
        Regressor columns of the chosen parameters, filtered like the torque.
    constant : ndarray, shape (M, n), or float
        Filtered torque of the linear model if all parameters are zero: 0 for a model that is
        linear in all its parameters.

    """

    columns: FloatArray
    constant: FloatArray | float = 0.0

    def __post_init__(self) -> None:
        """Make the columns read-only."""
        object.__setattr__(self, 'columns', read_only(self.columns))

    @property
    def target(self) -> FloatArray:
        """Return the measured torque minus the constant, shape (M, n): the target of a fit."""
        return np.asarray(self.tau - self.constant)

    def torque(self, values: FloatArray) -> FloatArray:
        """Return the torque, (M, n), that the linear model predicts for parameter values, (r,)."""
        return np.asarray(self.columns @ values + self.constant)

    def residual(self, values: FloatArray) -> FloatArray:
        """Return the residual torque, (M, n), for parameter values, (r,)."""
        return np.asarray(self.target - self.columns @ values)

    def restrict(self, columns: Sequence[int] | npt.NDArray[np.intp]) -> Regression:
        """Return the linear problem with only the regressor columns at given indices."""
        if np.array_equal(columns, np.arange(self.columns.shape[2])):
            return self
        return replace(self, columns=self.columns[:, :, columns])

    def select(self, rows: npt.NDArray[np.intp]) -> Regression:
        """Return the linear problem with only the samples at given indices."""
        return replace(
            self,
            motion=self.motion.select(rows),
            columns=self.columns[rows],
            informative=self.informative[rows],
            constant=np.broadcast_to(self.constant, self.tau.shape)[rows],
        )


def regressions(
    arm: ArmModel,
    columns: npt.NDArray[np.intp],
    recordings: Sequence[Recording],
    used: Conditioning,
    progress: Callable[[float], None] | None = None,
) -> list[Regression]:
    """
    Return linear problems for chosen parameters of an arm, one per gap-free section.

    Parameters
    ----------
    arm : ArmModel
        Rigid body and effects.
    columns : ndarray of int, shape (r,)
        Indices of the columns to keep, as in ``arm.parameters``, such as the independent columns.
    recordings : sequence of Recording
        Data with torques.
    used : Conditioning
        Filters.
    progress : callable, optional
        Called with the finished share, 0 to 1.

    Returns
    -------
    list of Regression
        One per stretch without gaps.

    """
    result = []
    for number, recording in enumerate(recordings, start=1):
        for motion, unsure, rows in _sections(arm, recording, used):
            stacked = filtered_columns(arm, columns, motion, used, unsure)
            result.append(Regression(recording.source, *rows, stacked))
        if progress is not None:
            progress(number / len(recordings))
    return result


@dataclass(frozen=True)
class Fit(Stretch):
    """
    Measured and predicted torque in a gap-free section of a recording.

    Attributes
    ----------
    predicted : ndarray, shape (M, n)
        Torque of the model, filtered like the measured torque [N m].

    """

    predicted: FloatArray

    def __repr__(self) -> str:
        """Return recording name, number of samples and relative error in one line."""
        error = Score.of([self]).relative_error_percent
        return f'Fit of {self.source}: {len(self.motion)} samples, {error:.2f} % relative error'

    @property
    def residual(self) -> FloatArray:
        """Measured minus predicted torque, shape (M, n) [N m]."""
        return self.tau - self.predicted


@dataclass(frozen=True)
class Score:
    """
    Errors of the torques that a model predicts for recordings.

    Attributes
    ----------
    relative_error_percent : float
        100 |tau - tau_hat| / |tau| over all joints and samples.
    joint_relative_error_percent : ndarray, shape (n,)
        Relative error of each joint [%].
    rms : ndarray, shape (n,)
        Root mean square residual of each joint [N m].
    torque_rms : ndarray, shape (n,)
        Root mean square torque of each joint [N m].

    """

    relative_error_percent: float
    joint_relative_error_percent: FloatArray
    rms: FloatArray
    torque_rms: FloatArray

    @staticmethod
    def of(fits: Sequence[Fit]) -> Score:
        """Return the torque errors of fits, without samples at which friction may hold a joint."""
        names = 'residual', 'tau', 'informative'
        return Score.of_rows(*(np.concatenate([getattr(f, one) for f in fits]) for one in names))

    @staticmethod
    def of_rows(
        residual: FloatArray, tau: FloatArray, informative: npt.NDArray[np.bool_]
    ) -> Score:
        """Return torque errors from residuals and torques, (N, n), where `informative` is true."""
        errors, lengths = (np.linalg.norm(informative * x, axis=0) for x in (residual, tau))
        count, whole = np.maximum(informative.sum(axis=0), 1), np.linalg.norm(lengths)
        return Score(
            float(100.0 * np.linalg.norm(errors) / whole) if whole > 0.0 else 0.0,
            100.0 * errors / np.where(lengths > 0.0, lengths, np.inf),
            errors / np.sqrt(count),
            lengths / np.sqrt(count),
        )


def weighted_rows(
    problem: Sequence[Regression], weights: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return weighted columns (N n, r) and weighted target torques (N n,) of all sections."""
    columns = np.concatenate([part.columns for part in problem])
    target = np.concatenate([part.target for part in problem])
    rows = weights[:, :, np.newaxis] * columns
    return rows.reshape(-1, columns.shape[2]), np.asarray((weights * target).ravel())


def by_stretch(problem: Sequence[Stretch], rows: FloatArray) -> list[FloatArray]:
    """Return an array (N, ...) of all samples, split into one array per gap-free section."""
    return np.split(rows, np.cumsum([len(part.motion) for part in problem])[:-1])


def predictions(arm: ArmModel, recordings: Sequence[Recording], used: Conditioning) -> list[Fit]:
    """Return measured and predicted torque for each gap-free section of recordings."""
    return [
        Fit(one.source, *rows, decimate(bridged(arm.torque(motion), unsure), used))
        for one in recordings
        for motion, unsure, rows in _sections(arm, one, used)
    ]


def _sections(
    arm: ArmModel, recording: Recording, used: Conditioning
) -> Iterator[tuple[Motion, npt.NDArray[np.bool_], tuple[Motion, npt.NDArray[np.bool_]]]]:
    """Yield each section: motion, `unsure`, and its decimated motion with samples not at rest."""
    for motion in segments(recording, used):
        rest, unsure = held_samples(arm, motion)
        kept = np.array(decimated_samples(len(motion), used), dtype=np.intp)
        assert motion.tau is not None
        tau = decimate(bridged(motion.tau, unsure), used)
        yield motion, unsure, (motion.select(kept).with_torque(tau), ~rest[kept])


def filtered_columns(
    arm: ArmModel,
    columns: npt.NDArray[np.intp],
    motion: Motion,
    used: Conditioning,
    unsure: npt.NDArray[np.bool_],
) -> FloatArray:
    """
    Return chosen regressor columns along a gap-free section, filtered and decimated.

    Parameters
    ----------
    arm : ArmModel
        Rigid body and effects.
    columns : ndarray of int, shape (r,)
        Indices of the columns to keep, as in ``arm.parameters``.
    motion : Motion
        Motion of the stretch at the full sampling rate.
    used : Conditioning
        Filters.
    unsure : ndarray of bool, shape (N, n)
        Samples of each joint that are interpolated; see `held_samples`.

    Returns
    -------
    ndarray, shape (M, n, r)

    """
    result = np.empty((len(decimated_samples(len(motion), used)), motion.n_joints, len(columns)))
    parts: list[tuple[_Columns, int, bool]] = []
    parts.append((arm.rigid_columns, len(arm.robot.rigid_parameters), True))
    parts += [
        (partial(arm.columns_of, effect), len(values), effect.instantaneous)
        for effect, values in zip(arm.effects, arm.values, strict=True)
    ]
    # functions that need only neighbouring samples, with the indices of their columns among those
    # of the function and in the result
    local: list[tuple[_Columns, Samples, Samples]] = []
    first = 0
    for function, size, instantaneous in parts:
        outer = np.flatnonzero((columns >= first) & (columns < first + size))
        inner, there = _as_slice(columns[outer] - first), _as_slice(outer)
        if len(outer) and instantaneous:
            local.append((function, inner, there))
        elif len(outer):
            whole = bridged(function(motion)[:, :, inner], unsure)
            result[:, :, there] = decimate(whole, used)
        first += size
    margin = arm.neighbours(1.0 / used.rate_hz)
    stride = used.smooth_stride if margin == 0 else 1
    sure = ~np.pad(unsure, ((1, 1), (0, 0)))
    longest = max(int(np.diff(np.flatnonzero(column)).max()) - 1 for column in sure.T)
    margin, overlap, row = max(margin, longest), len(used.taps) - 1, 0
    # number of samples whose regressor is computed together; more do not fit into the cache
    step = max(used.decimation, 10_000 // used.decimation * used.decimation)
    for start in range(0, max(1, len(motion) - overlap), step):
        stop, before = min(len(motion), start + step + overlap), max(0, start - margin)
        window, inside = slice(before, stop + margin), slice(start - before, stop - before)
        rows = slice(row, row + len(decimated_samples(stop - start, used)))
        piece = motion.select(window)
        for function, inner, there in local:
            if function == arm.rigid_columns and stride > 1:
                # smooth columns need no interpolation and fewer samples
                block = function(motion.select(slice(start, stop, stride)))[:, :, inner]
                result[rows, :, there] = decimate(block, used, stride)
            else:
                block = function(piece)[:, :, inner]
                result[rows, :, there] = decimate(bridged(block, unsure[window])[inside], used)
        row = rows.stop
    result.setflags(write=False)  # a read-only array is frozen without a copy
    return result


def _as_slice(indices: npt.NDArray[np.intp]) -> Samples:
    """Return adjacent indices as a slice, which avoids a copy; return other indices unchanged."""
    adjacent = len(indices) and np.array_equal(indices, indices[0] + np.arange(len(indices)))
    return slice(int(indices[0]), int(indices[-1]) + 1) if adjacent else indices


def held_samples(
    arm: ArmModel, motion: Motion
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """
    Return masks of samples at which dry friction is unknown: at rest and in reversals.

    Returns
    -------
    rest : ndarray of bool, shape (N, n)
        Samples at which the joint is at rest; friction may hold it with any torque.
    unsure : ndarray of bool, shape (N, n)
        Samples next to a reversal of the moving joint.

    """
    rest, unsure = np.zeros((2, *motion.q.shape), dtype=bool)
    # at rest for at least this long [s]; a reversal of direction is shorter
    shortest = 0.2 / float(motion.t[1] - motion.t[0])
    held = {joint for effect in arm.effects if effect.holds_at_rest for joint in effect.joints}
    for joint in map(motion.joints.index, held):
        velocity = motion.dq[:, joint]
        direction, speed = np.sign(velocity), np.abs(velocity)
        turned = direction[1:] != direction[:-1]
        unsure[1:, joint] = turned
        unsure[:-1, joint] |= turned
        slow = np.concatenate([[False], speed < REST_SPEED * speed.max(), [False]])
        edges = np.flatnonzero(slow[1:] != slow[:-1]).reshape(-1, 2)
        for start, stop in edges[np.diff(edges, axis=1)[:, 0] >= shortest]:
            rest[start:stop, joint] = True
    return rest, unsure & ~rest


def bridged(values: FloatArray, unsure: npt.NDArray[np.bool_]) -> FloatArray:
    """
    Return torques or columns, interpolated linearly where dry friction is unknown.

    Parameters
    ----------
    values : ndarray, shape (N, n, ...)
        Torques or columns.
    unsure : ndarray of bool, shape (N, n)
        Samples of each joint to replace; at an end, the nearest other sample gives the value.

    Returns
    -------
    ndarray, shape (N, n, ...)

    """
    result = values
    for joint in range(values.shape[1]):
        own, gaps = values[:, joint], np.flatnonzero(unsure[:, joint])
        if not 0 < len(gaps) < len(own):
            continue
        if result is values:
            result = values.copy()
        sure = np.flatnonzero(~unsure[:, joint])
        after = np.searchsorted(sure, gaps)
        before = sure[np.maximum(after - 1, 0)]
        following = sure[np.minimum(after, len(sure) - 1)]
        share = (gaps - before) / np.maximum(following - before, 1)
        share = share.reshape(-1, *(1,) * (own.ndim - 1))
        result[gaps, joint] = own[before] + share * (own[following] - own[before])
    return result
