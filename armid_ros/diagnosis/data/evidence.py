# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What recordings show beside a model: torques and columns, filtered alike and decimated.

A trajectory is one unbroken stretch of a recording. Its motion stays at the full rate, where
columns are computed; its rows are decimated, which is where everything is compared.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import Effect
from armid_ros.effects.timing import smoothed
from armid_ros.errors import IdentificationError
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
from scipy import signal, stats

#: Columns are computed at this many times the rate of the rows: enough for signs and hysteresis.
_OVERSAMPLING = 8
#: A joint slower than this share of its top speed for this long [s] is at rest.
_REST_SPEED, _REST_TIME = 0.02, 0.2
#: Below this share of the top speed, or so many deviations of its noise, the sign of a velocity is
#: uncertain, and so is dry friction.
_REVERSAL_SPEED, _REVERSAL_NOISE = 0.004, 3.0
#: Share of a row of which that sign may be uncertain in any case: three rows beside a reversal.
UNSURE = 0.003
#: Rows apart that what is left may be alike.
_LAGS = 20


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


@dataclass(frozen=True)
class Evidence:
    """
    Data with the unit that a gap is measured in.

    Attributes
    ----------
    data : tuple of Trajectory
        The data.
    sigma : tuple of ndarray, each (n,)
        The unit of each trajectory: its noise, or the model's own misfit where that is more
        [N m].
    noise : tuple of ndarray, each (n,)
        Its noise [N m].
    varies : ndarray, shape (n,), or None
        By how much the squares of a misfit vary from motion to motion; None: as a rule.

    """

    data: tuple[Trajectory, ...]
    sigma: tuple[FloatArray, ...]
    noise: tuple[FloatArray, ...]
    varies: FloatArray | None = None

    @cached_property
    def count(self) -> FloatArray:
        """Informative rows of each joint, shape (n,)."""
        parts = [part.informative.sum(axis=0) for part in self.data]
        return np.asarray(np.sum(parts, axis=0, dtype=float))

    @cached_property
    def torque_rms(self) -> FloatArray:
        """Root mean square of the measured torque of each joint, shape (n,) [N m]."""
        return np.sqrt(self.power([part.torque for part in self.data]))

    @cached_property
    def noise_share(self) -> FloatArray:
        """Mean square of the noise of each joint over that of the unit, shape (n,)."""
        sigma = np.mean([own**2 for own in self.sigma], axis=0)
        return np.asarray(np.mean([one**2 for one in self.noise], axis=0) / sigma)

    def chi2_per_row(self, residual: Sequence[FloatArray]) -> FloatArray:
        """Return the mean square over the unit of each joint, shape (n,)."""
        return self.power([left / s for left, s in zip(residual, self.sigma, strict=True)])

    def power(self, torque: Sequence[FloatArray]) -> FloatArray:
        """Return the mean square of torques in rows (M, n), of each joint, shape (n,)."""
        squares = np.zeros_like(self.count)
        for part, rows in zip(self.data, torque, strict=True):
            squares += np.sum(rows**2, axis=0, where=part.informative)
        return np.asarray(squares / np.maximum(self.count, 1.0))

    def split(self, weighted: FloatArray, weight: FloatArray) -> list[FloatArray]:
        """Return weighted rows (R, n) of all trajectories one by one, without their weights."""
        rows = np.where(weight > 0.0, weighted / np.where(weight > 0.0, weight, 1.0), 0.0)
        cuts = np.cumsum([len(part.rows) for part in self.data])[:-1]
        return np.split(rows, cuts)

    @property
    def assumed(self) -> bool:
        """Whether nothing repeats in some of the data, so that their noise is not measured."""
        return any(part.period is None for part in self.data)

    def limits(self, residual: Sequence[FloatArray], settings: DiagnosisSettings) -> FloatArray:
        """
        Return the loss of each joint up to which what is left is no gap, shape (n,).

        Two periods determine their noise as well as so many independent rows do, and so do the
        rows that are compared with it: the ratio of the two has Fisher's distribution. Where the
        unit is a misfit, another motion makes another one, and noise that nothing repeated tells
        is no surer than that. And what is left may not matter.

        """
        thresholds = settings.thresholds
        count = np.maximum(self.count, 2.0)
        free = np.maximum(count / self._lasting(residual), 4.0)
        each = 1.0 - (1.0 - thresholds.confidence) / len(count)
        noise = stats.f.ppf(each, free, free) * (thresholds.same_fit if self.assumed else 1.0)
        own = self.noise_share
        misfit = np.where(own < 1.0 / thresholds.same_fit, self.as_good(settings), 1.0)
        return np.asarray(np.maximum(noise, misfit) + self.matters(settings))

    def as_good(self, settings: DiagnosisSettings) -> FloatArray:
        """Return the loss of each joint up to which another motion is predicted as well, (n,)."""
        varies = np.ones_like(self.count) if self.varies is None else self.varies
        return np.asarray(settings.thresholds.same_fit * np.maximum(varies, 1.0))

    def matters(self, settings: DiagnosisSettings) -> FloatArray:
        """Return the loss of each joint that matters to the user, shape (n,)."""
        sigma = np.mean([own**2 for own in self.sigma], axis=0)
        return np.asarray((settings.material * self.torque_rms) ** 2 / sigma)

    def _lasting(self, residual: Sequence[FloatArray]) -> FloatArray:
        """Return for how many rows what is left lasts, as squares go, shape (n,)."""
        products = np.zeros((_LAGS + 1, len(self.count)))
        for part, left in zip(self.data, residual, strict=True):
            rows = np.where(part.informative, left, 0.0)
            for lag in range(min(_LAGS + 1, len(rows))):
                products[lag] += np.sum(rows[lag:] * rows[: len(rows) - lag], axis=0)
        correlation = products[1:] / np.maximum(products[0], 1e-300)
        return np.asarray(1.0 + 2.0 * np.sum(correlation**2, axis=0))

    def least_squares(self, settings: DiagnosisSettings, misfit_share: float) -> FloatArray:
        """
        Return the squares over the unit that a cause takes of a joint if it matters, (n,).

        It takes no less than a share of the misfit.

        """
        wanted = (settings.material * self.torque_rms) ** 2
        total = np.zeros_like(self.count)
        for part, sigma, noise in zip(self.data, self.sigma, self.noise, strict=True):
            misfit = misfit_share * np.maximum(sigma**2 - noise**2, 0.0)
            total += part.informative.sum(axis=0) * np.maximum(wanted, misfit) / sigma**2
        return np.maximum(total, 1e-12)


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
    shortest = _REST_TIME / float(motion.t[1] - motion.t[0])
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
