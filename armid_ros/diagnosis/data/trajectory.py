# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What recordings show beside a model: torques and columns, filtered alike and decimated.

A trajectory is one unbroken stretch of a recording. Its motion stays at the full rate, where
columns are computed; its rows are decimated, which is where everything is compared.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.effects import Effect
from armid_ros.effects.timing import smoothed
from armid_ros.errors import IdentificationError
from armid_ros.identification.assess.data_faults import Stretch
from armid_ros.identification.rows.period import find_period
from armid_ros.identification.rows.signals import (
    Conditioning,
    decimate,
    decimated_samples,
    segments,
    velocity_error,
)
from armid_ros.identification.ties.sensor_noise import SensorNoise
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt
from scipy import signal

#: Columns are computed at this many times the rate of the rows: enough for signs and hysteresis.
_OVERSAMPLING = 8
#: A joint slower than this share of its top speed for this long [s] is at rest.
_REST_SPEED, REST_TIME = 0.02, 0.2
#: Below this share of the top speed, or so many deviations of its noise, the sign of a velocity is
#: uncertain, and so is dry friction.
_REVERSAL_SPEED, _REVERSAL_NOISE = 0.004, 3.0
#: Share of a row of which that sign may be uncertain in any case: three rows beside a reversal.
UNSURE = 0.003
#: Parts that data are held out in, two of each recording at the least: what one fast recording
#: shows alone can be learned from half of it.
PARTS = 6
#: Blocks of each part of the data, of a second or two, which is longer than any correlation of
#: noise; a block has this many rows at the least.
BLOCKS, _LEAST_ROWS = 6, 8


@dataclass(frozen=True)
class Trajectory:
    """
    One unbroken stretch of a recording.

    Attributes
    ----------
    source : str
        The recording.
    fold : int
        Which part of the data it belongs to when parts are held out.
    motion : Motion
        Filtered motion with the measured torque, N samples.
    used : Conditioning
        From motion to rows.
    rows : ndarray of int, shape (M,)
        Samples of the motion that the rows sit on.
    unsure : ndarray, shape (M, n)
        Share of each row of which the sign of the velocity is uncertain; infinite at rest.
    allowed : ndarray, shape (n,)
        The largest such share of a row that tells something.
    period_recorded : float
        Time between its samples as they were recorded [s].
    sensors : SensorNoise or None
        What their noise does beside another machine; None where there is none.

    """

    source: str
    fold: int
    motion: Motion
    used: Conditioning
    rows: npt.NDArray[np.intp]
    unsure: FloatArray
    allowed: FloatArray
    period_recorded: float
    sensors: SensorNoise | None = None

    @cached_property
    def informative(self) -> npt.NDArray[np.bool_]:
        """Return False where a joint rests or turns round: its friction is unknown, (M, n)."""
        return np.asarray(self.unsure <= self.allowed)

    def reduce(self, values: FloatArray) -> FloatArray:
        """Filter and decimate samples (N, ...) to rows (M, ...)."""
        return decimate(values, self.used)

    @cached_property
    def smooth(self) -> Trajectory:
        """Return the same with positions that have nothing beyond the band of the motion."""
        return replace(self, motion=smoothed(self.motion))

    @cached_property
    def at_rows(self) -> Motion:
        """Return the motion at the samples that the rows sit on."""
        return self.motion.select(self.rows)

    @property
    def stretch(self) -> Stretch:
        """Return the rows as faults of data are looked for in."""
        return Stretch(self.source, self.at_rows.with_torque(self.torque), self.informative)

    @cached_property
    def period(self) -> tuple[int, slice] | None:
        """Return the repeated period of the motion; see `find_period`."""
        return find_period(self.motion)

    @property
    def torque(self) -> FloatArray:
        """Measured torque in rows, shape (M, n) [N m]."""
        assert self.motion.tau is not None
        return self.reduce(self.motion.tau)

    def with_torque_moved(self, by: FloatArray) -> Trajectory:
        """Return the same where more torque was measured, by as much all the time, (n,) [N m]."""
        assert self.motion.tau is not None
        return replace(self, motion=self.motion.with_torque(self.motion.tau + by))

    def residual(self, arm: ArmModel) -> FloatArray:
        """Return measured torque minus that of a model, in rows, shape (M, n) [N m]."""
        assert self.motion.tau is not None
        return self.reduce(self.motion.tau - arm.torque(self.motion))

    def columns(self, arm: ArmModel, effect: Effect) -> FloatArray:
        """Return the columns of an effect of an arm, in rows, shape (M, n, P)."""
        if effect.smooth:
            return arm.columns_of(effect, self.at_rows)
        return self.reduce(arm.columns_of(effect, self.motion))

    @property
    def t(self) -> FloatArray:
        """Time of the rows [s]."""
        return self.motion.t[self.rows]


def trajectories(
    recordings: Sequence[Recording],
    used: Conditioning,
    arm: ArmModel | None = None,
    allowed: FloatArray | None = None,
) -> list[Trajectory]:
    """
    Cut recordings into unbroken stretches, conditioned alike.

    Rows may be uncertain by as much as is allowed, (n,); see `Trajectory`.

    Where another machine was recorded beside the arm, what noise of the angles does to it is
    measured as well.

    Raises
    ------
    IdentificationError
        If a recording has no stretch that is long enough.

    """
    result = []
    for fold, recording in enumerate(recordings):
        least = _REVERSAL_NOISE * velocity_error(recording, used)
        stretches = segments(recording, used)
        found = [_trajectory(recording, fold, m, used, least) for m in stretches]
        if not found:
            raise IdentificationError(
                f'{recording.source}: no stretch is long enough to be filtered at '
                f'{used.cutoff_hz:g} Hz'
            )
        if allowed is not None:
            found = [replace(part, allowed=allowed) for part in found]
        if recording.partner is not None and arm is not None:
            sensors = SensorNoise(arm.robot, recording, used)
            found = [replace(part, sensors=sensors) for part in found]
        result += found
    return result


def thinnable(used: Conditioning) -> Conditioning:
    """
    Return a conditioning of which the motion can be thinned out as far as columns allow.

    They are computed at a rate that divides that of the recording and of which rows are a whole
    part: at most an eighth more rows are kept.

    """
    widest = _widest(used)
    return replace(used, decimation=used.decimation - used.decimation % widest)


def _widest(used: Conditioning) -> int:
    """
    Return by how much a motion may be thinned out before columns are made of it.

    Columns go with squares of velocities, which reach to twice the cut-off: half of the rate has
    to be more than that.

    """
    fast_enough = int(used.rate_hz / (4.0 * used.cutoff_hz))
    return max(1, min(used.decimation // _OVERSAMPLING, fast_enough))


def _thin(used: Conditioning) -> int:
    """Return by how much a motion is thinned out before columns are made of it."""
    return max(d for d in range(1, _widest(used) + 1) if used.decimation % d == 0)


def _trajectory(
    recording: Recording, fold: int, motion: Motion, used: Conditioning, least: FloatArray
) -> Trajectory:
    thin = _thin(used)
    if thin > 1:
        first = replace(used, decimation=thin)
        assert motion.tau is not None
        kept = np.array(decimated_samples(len(motion), first), dtype=np.intp)
        motion = motion.select(kept).with_torque(decimate(motion.tau, first))
        used = Conditioning(used.rate_hz / thin, used.cutoff_hz, used.decimation // thin)
    rows = np.array(decimated_samples(len(motion), used), dtype=np.intp)
    unsure = np.where(_at_rest(motion), np.inf, _unsure(motion, used, least))[rows]
    allowed = np.full(motion.n_joints, UNSURE)
    source, period = recording.source, recording.period
    return Trajectory(source, fold, motion, used, rows, unsure, allowed, period)


def _at_rest(motion: Motion) -> npt.NDArray[np.bool_]:
    """Return where joints stand still, shape (N, n)."""
    rest = np.zeros(motion.q.shape, dtype=bool)
    shortest = REST_TIME / float(motion.t[1] - motion.t[0])
    for joint in range(motion.n_joints):
        speed = np.abs(motion.dq[:, joint])
        slow = np.concatenate([[False], speed <= _REST_SPEED * speed.max(), [False]])
        edges = np.flatnonzero(np.diff(slow.astype(int))).reshape(-1, 2)
        for start, stop in edges[np.diff(edges, axis=1)[:, 0] >= shortest]:
            rest[start:stop, joint] = True
    return rest


def _unsure(motion: Motion, used: Conditioning, least: FloatArray) -> FloatArray:
    """Return of what share of filtered samples the sign of the velocity is uncertain, (N, n)."""
    speed = np.abs(motion.dq)
    slow = speed < np.maximum(_REVERSAL_SPEED * speed.max(axis=0), least)
    slow[1:] |= np.diff(np.sign(motion.dq), axis=0) != 0
    taps = np.abs(used.taps())
    share = signal.oaconvolve(slow.astype(float), taps[:, np.newaxis], mode='same', axes=0)
    return np.asarray(np.maximum(share, 0.0))


def block_rows(
    data: Sequence[Trajectory],
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return the block of every row, and the part of the data of every block."""
    fold = fold_rows(data)
    block = np.empty(len(fold), dtype=np.intp)
    owner: list[int] = []
    for k in np.unique(fold):
        rows = np.flatnonzero(fold == k)
        pieces = min(BLOCKS, max(2, len(rows) // _LEAST_ROWS))
        for piece in np.array_split(rows, pieces):
            block[piece] = len(owner)
            owner.append(int(k))
    return block, np.array(owner, dtype=np.intp)


def row_weights(data: Sequence[Trajectory], sigma: Sequence[FloatArray]) -> FloatArray:
    """Return one over the noise of all rows, zero where they tell nothing, (R, n) [1/(N m)]."""
    return np.concatenate([part.informative / s for part, s in zip(data, sigma, strict=True)])


def weighted_rows(
    rows: Sequence[FloatArray], data: Sequence[Trajectory], sigma: Sequence[FloatArray]
) -> Iterator[FloatArray]:
    """Yield rows (M, n) or (M, n, P) of each trajectory with the weights of `row_weights`."""
    for own, part, s in zip(rows, data, sigma, strict=True):
        weight = row_weights([part], [s])
        yield own * (weight[:, :, np.newaxis] if own.ndim > 2 else weight)


def fold_rows(data: Sequence[Trajectory]) -> npt.NDArray[np.intp]:
    """Return the part of the data of every row, a stretch of a recording."""
    recordings = len({part.fold for part in data})
    pieces = max(2, -(-PARTS // max(recordings, 1)))
    rows = []
    for part in data:
        span = np.linspace(0, pieces, len(part.rows), endpoint=False).astype(np.intp)
        rows.append(part.fold * pieces + span)
    _, index = np.unique(np.concatenate(rows), return_inverse=True)
    return np.asarray(index, dtype=np.intp)


@dataclass(frozen=True)
class Workspace:
    """The data and the arm that columns are computed for, when shapes are refined."""

    arm: ArmModel
    data: tuple[Trajectory, ...]

    def columns(self, effect: Effect, kept: Sequence[int]) -> FloatArray:
        """Return the columns of an effect in rows, shape (R, n, p)."""
        blocks = [part.columns(self.arm, effect) for part in self.data]
        return np.asarray(np.concatenate(blocks)[:, :, list(kept)])

    def smooth_columns(self, effect: Effect, kept: Sequence[int]) -> FloatArray:
        """Return what they would be without the noise that positions have beyond the motion."""
        smooth = tuple(part.smooth for part in self.data)
        return replace(self, data=smooth).columns(effect, kept)

    def torque_echo(
        self, effect: Effect, kept: Sequence[int], noise: Sequence[FloatArray]
    ) -> FloatArray:
        """
        Return what columns of an effect times noise of the torque are in the mean, (R, n, p).

        Columns where the torque is one deviation of each trajectory, (n,) [N m], higher and lower.

        """
        blocks = []
        for part, deviation in zip(self.data, noise, strict=True):
            higher, lower = (
                part.with_torque_moved(by).columns(self.arm, effect)
                for by in (deviation, -deviation)
            )
            blocks.append(deviation[:, np.newaxis] * (higher - lower) / 2.0)
        return np.asarray(np.concatenate(blocks)[:, :, list(kept)])
