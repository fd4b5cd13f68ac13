# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Measured torques and model columns of a recording, with the same filter and decimation.

A trajectory is one part of a recording without missing samples. Columns are computed at the sample
rate of its motion, and filtered and decimated to matrix rows like the measured torques.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import rigid_rows
from armid_ros.effects import Effect
from armid_ros.identification.rows.checks import moving
from armid_ros.identification.rows.period import find_period
from armid_ros.identification.rows.signals import (
    Conditioning,
    decimate,
    decimated_samples,
    no_stretch,
    segments,
    velocity_error,
)
from armid_ros.identification.ties.recorded import SensorNoise
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt
from scipy import signal

#: Share of its top speed below which a joint is at rest, and shortest time of a rest [s].
_REST_SPEED, REST_TIME = 0.02, 0.2
#: The sign of a velocity, and with it dry friction, is uncertain below this share of the top
#: speed, or this number of standard deviations of its noise.
_REVERSAL_SPEED, _REVERSAL_NOISE = 0.004, 3.0
#: Smallest limit of the share of a row with an uncertain sign of velocity, if the row is used; the
#: three rows next to a reversal exceed it.
MAX_UNCERTAIN_SHARE = 0.003


@dataclass(frozen=True)
class Trajectory:
    """
    Recorded section without missing samples, filtered and decimated to regression rows.

    Attributes
    ----------
    source : str
        Name of the recording.
    fold : int
        Number of the recording.
    motion : Motion
        Filtered motion with the measured torque, N samples.
    used : Conditioning
        Filter and decimation from samples to rows.
    rows : ndarray of int, shape (M,)
        Index of the sample at the centre of each row.
    unsure : ndarray, shape (M, n)
        Share of each row in which the sign of the velocity is uncertain; infinite at rest.
    allowed : ndarray, shape (n,)
        Largest such share of a row that is used (informative).
    sensors : SensorNoise or None
        Sensor noise of an arm that is tied to another machine; None for a single arm.

    """

    source: str
    fold: int
    motion: Motion
    used: Conditioning
    rows: npt.NDArray[np.intp]
    unsure: FloatArray
    allowed: FloatArray
    sensors: SensorNoise | None = None

    @cached_property
    def informative(self) -> npt.NDArray[np.bool_]:
        """Return a mask (M, n): False for rows in which a joint rests or reverses."""
        return np.asarray(self.unsure <= self.allowed)

    def reduce(self, values: FloatArray) -> FloatArray:
        """Filter and decimate samples (N, ...) to regression rows (M, ...)."""
        return decimate(values, self.used)

    @cached_property
    def at_rows(self) -> Motion:
        """Return the motion at the middle sample of each regression row."""
        return self.motion.select(self.rows)

    @cached_property
    def period(self) -> tuple[int, slice] | None:
        """Return lag and samples of the period that the motion repeats, or None."""
        return find_period(self.motion.t, self.motion.q)

    @property
    def torque(self) -> FloatArray:
        """Filtered measured torque, shape (M, n) [N m]."""
        assert self.motion.tau is not None
        return self.reduce(self.motion.tau)

    def residual(self, arm: ArmModel) -> FloatArray:
        """Return the filtered residual torque of a model, shape (M, n) [N m]."""
        assert self.motion.tau is not None
        return self.reduce(self.motion.tau - arm.torque(self.motion))

    def columns(self, arm: ArmModel, effect: Effect) -> FloatArray:
        """Return the filtered torque per unit of each parameter of an effect, shape (M, n, P)."""
        if effect.smooth:
            return arm.columns_of(effect, self.at_rows)
        return self.reduce(arm.columns_of(effect, self.motion))

    def base_columns(
        self, arm: ArmModel, effects: Sequence[Effect], chosen: npt.NDArray[np.intp]
    ) -> FloatArray:
        """
        Return the filtered regressor of chosen parameters of body and effects, (M, n, r).

        Parameters
        ----------
        arm : ArmModel
            The model.
        effects : sequence of Effect
            Effects whose values come after the rigid parameters.
        chosen : ndarray of int, shape (r,)
            Indices of the chosen parameters.

        """
        rigid = len(arm.robot.rigid_parameters)
        result = np.empty((len(self.rows), self.motion.n_joints, len(chosen)))
        own = chosen >= rigid
        if not own.all():
            rows = rigid_rows(arm, self.motion, self.reduce)
            result[:, :, ~own] = rows[:, :, chosen[~own]]
        if own.any():
            columns = [arm.columns_of(effect, self.motion) for effect in effects]
            picked = np.concatenate(columns, axis=2)[:, :, chosen[own] - rigid]
            result[:, :, own] = self.reduce(picked)
        return result

    @property
    def t(self) -> FloatArray:
        """Time of each regression row, shape (M,) [s]."""
        return self.motion.t[self.rows]


def trajectories(
    recordings: Sequence[Recording],
    used: Conditioning,
    arm: ArmModel | None = None,
    allowed: FloatArray | None = None,
) -> list[Trajectory]:
    """
    Divide recordings where samples are missing, and filter each section.

    Parameters
    ----------
    recordings : sequence of Recording
        The recordings; `fold` of a trajectory is the index of its recording.
    used : Conditioning
        Filters and decimation.
    arm : ArmModel, optional
        Model for the sensor noise of another machine that was recorded with the arm.
    allowed : ndarray, shape (n,), optional
        See `Trajectory`.

    Raises
    ------
    IdentificationError
        If a recording has no part that is long enough for the filters.

    """
    result = []
    for fold, recording in enumerate(recordings):
        slowest = _REVERSAL_NOISE * velocity_error(recording, used)
        motions = list(segments(recording, used))
        if not motions:
            raise no_stretch(recording, used)
        sensors = None
        if recording.partner is not None and arm is not None:
            sensors = SensorNoise(arm.robot, recording, used)
        for whole in motions:
            motion, reduction = _thinned(whole, used)
            rows = np.array(decimated_samples(len(motion), reduction), dtype=np.intp)
            unsure = _uncertain_share(motion, reduction, slowest)[rows]
            limit = np.full(motion.n_joints, MAX_UNCERTAIN_SHARE) if allowed is None else allowed
            source = recording.source
            part = Trajectory(source, fold, motion, reduction, rows, unsure, limit, sensors)
            result.append(part)
    return result


def thinnable(used: Conditioning) -> Conditioning:
    """
    Lower the decimation of rows to a multiple of the decimation of regressor columns.

    Each row then spans a whole number of column samples; rows increase by at most an eighth.

    """
    widest = _widest(used)
    return replace(used, decimation=used.decimation - used.decimation % widest)


def _widest(used: Conditioning) -> int:
    """
    Return the largest decimation that keeps the sampling rate above four times the cut-off.

    Columns contain squares of velocities, whose band is twice the cut-off.

    """
    fast_enough = int(used.rate_hz / (4.0 * used.cutoff_hz))
    # eight samples a row resolve signs of velocity and hysteresis
    return max(1, min(used.decimation // 8, fast_enough))


def _thinned(motion: Motion, used: Conditioning) -> tuple[Motion, Conditioning]:
    """Decimate a motion to the sampling rate of the regressor; return it with the row filter."""
    thin = max(d for d in range(1, _widest(used) + 1) if used.decimation % d == 0)
    if thin == 1:
        return motion, used
    first = replace(used, decimation=thin)
    assert motion.tau is not None
    kept = np.array(decimated_samples(len(motion), first), dtype=np.intp)
    motion = motion.select(kept).with_torque(decimate(motion.tau, first))
    return motion, Conditioning(used.rate_hz / thin, used.cutoff_hz, used.decimation // thin)


def _uncertain_share(motion: Motion, used: Conditioning, slowest: FloatArray) -> FloatArray:
    """Return the filter-weighted share of uncertain velocity signs; inf at rest, (N, n)."""
    speed = np.abs(motion.dq)
    slow = speed < np.maximum(_REVERSAL_SPEED * speed.max(axis=0), slowest)
    slow[1:] |= np.diff(np.sign(motion.dq), axis=0) != 0
    taps = np.abs(used.taps)
    share = signal.oaconvolve(slow.astype(float), taps[:, np.newaxis], mode='same', axes=0)
    share = np.asarray(np.maximum(share, 0.0))
    shortest = REST_TIME / float(motion.t[1] - motion.t[0])
    resting = np.pad(speed <= _REST_SPEED * speed.max(axis=0), ((1, 1), (0, 0)))
    for joint, own in enumerate(resting.T):
        edges = np.flatnonzero(np.diff(own.astype(int))).reshape(-1, 2)
        for start, stop in edges[np.diff(edges, axis=1)[:, 0] >= shortest]:
            share[start:stop, joint] = np.inf
    return share


def block_rows(
    data: Sequence[Trajectory],
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return the time block of each of R rows, and the recording of each of B blocks."""
    fold = fold_rows(data)
    block = np.empty(len(fold), dtype=np.intp)
    owner: list[int] = []
    for k in np.unique(fold):
        rows = np.flatnonzero(fold == k)
        # six blocks of 1 to 2 s, longer than any correlation of noise, of eight rows or more
        pieces = min(6, max(2, len(rows) // 8), len(rows))
        for piece in np.array_split(rows, pieces):
            block[piece] = len(owner)
            owner.append(int(k))
    return block, np.array(owner, dtype=np.intp)


def row_weights(data: Sequence[Trajectory], sigma: Sequence[FloatArray]) -> FloatArray:
    """Return 1 / sigma for rows in which a joint moves, else zero, (R, n) [1/(N m)]."""
    return np.concatenate([part.informative / s for part, s in zip(data, sigma, strict=True)])


def count_recordings(data: Sequence[Trajectory]) -> int:
    """Return how many recordings the trajectories are from."""
    return len({part.fold for part in data})


def unchecked_joints(data: Sequence[Trajectory], joints: Sequence[str]) -> tuple[str, ...]:
    """Return the joints without usable data, because they rest or reverse in every row."""
    if not data:
        return ()
    shown = moving(part.motion for part in data)
    shown = shown & np.any([part.informative.any(axis=0) for part in data], axis=0)
    return tuple(joint for joint, seen in zip(joints, shown.tolist(), strict=True) if not seen)


def fold_rows(data: Sequence[Trajectory]) -> npt.NDArray[np.intp]:
    """
    Return the cross-validation fold of each row, shape (R,).

    A fold is a stretch of time of one recording. There are at least six folds, and two in each
    recording: an effect in a single fast recording is fitted to one half and predicts the other.

    """
    pieces = max(2, -(-6 // max(count_recordings(data), 1)))
    rows = []
    for part in data:
        span = np.linspace(0, pieces, len(part.rows), endpoint=False).astype(np.intp)
        rows.append(part.fold * pieces + span)
    _, index = np.unique(np.concatenate(rows), return_inverse=True)
    return np.asarray(index, dtype=np.intp)
