# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Torque noise of recordings, and residuals weighted by this noise or by the misfit of the model.

The noise is the difference between the residuals of two equal periods of one trajectory. Each
residual is evaluated at the positions measured in its period, so the difference includes encoder
noise that propagates through the model. Torques that depend on the motion alone cancel. Without
equal periods, the noise is estimated from second differences of neighbouring rows, and the result
states so.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.trajectory import block_rows, row_weights, Trajectory
from armid_ros.diagnosis.settings import DiagnosisSettings, Thresholds
from armid_ros.identification.rows.signals import TORQUE_RESOLUTION
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import signal, stats

#: Smallest number of rows in motion from which noise is measured; with fewer, all rows are used.
_MIN_ROWS = 20
#: Ratio of the noise of torques, which is coloured, to white noise with the same second
#: differences: at most this value in 95 % of the joints of 48 recordings with two equal periods.
_COLOURED_OVER_WHITE = 1.4
#: Upper frequency of disturbances by people, loose parts and nearby machines [Hz]; a band with
#: equal noise of torques and more noise of positions [Hz].
_LOW_HZ, _HIGH_HZ = 4.0, (6.0, 12.0)


@dataclass(frozen=True)
class Evidence:
    """
    Recordings, with the standard deviation that weights the residual of each joint.

    Attributes
    ----------
    data : tuple of Trajectory
        The recordings.
    sigma : tuple of ndarray, each (n,)
        That deviation for each trajectory: its noise, or the misfit of the model if larger [N m].
    noise : tuple of ndarray, each (n,)
        Standard deviation of the torque noise of each trajectory [N m].
    varies : ndarray, shape (n,), or None
        Factor by which the squared misfit varies from motion to motion; None counts as one.

    """

    data: tuple[Trajectory, ...]
    sigma: tuple[FloatArray, ...]
    noise: tuple[FloatArray, ...]
    varies: FloatArray | None = None

    @classmethod
    def over_noise(cls, data: Sequence[Trajectory], noise: Sequence[FloatArray]) -> Evidence:
        """Return recordings whose residuals are weighted by torque noise, (n,) each [N m]."""
        return cls(tuple(data), tuple(noise), tuple(noise))

    @cached_property
    def count(self) -> FloatArray:
        """Return for each joint the number of samples in which it moves, shape (n,)."""
        parts = [part.informative.sum(axis=0) for part in self.data]
        return np.asarray(np.sum(parts, axis=0, dtype=float))

    @cached_property
    def torque_rms(self) -> FloatArray:
        """Root mean square measured torque of each joint while it moves, shape (n,) [N m]."""
        return np.sqrt(self.power([part.torque for part in self.data]))

    def chi2_per_row(self, residual: Sequence[FloatArray]) -> FloatArray:
        """Return the mean square of each joint's residual divided by `sigma`, shape (n,)."""
        return self.power([rows / s for rows, s in zip(residual, self.sigma, strict=True)])

    def relative_errors(self, residual: Sequence[FloatArray]) -> FloatArray:
        """Return the rms residual of each joint, divided by its rms torque, shape (n,)."""
        torque = np.maximum(self.torque_rms**2, 1e-300)
        return np.asarray(np.sqrt(self.power(residual) / torque))

    def power(self, torque: Sequence[FloatArray]) -> FloatArray:
        """Return the mean square of torques (M, n) over the rows in which a joint moves, (n,)."""
        squares = np.zeros_like(self.count)
        for part, rows in zip(self.data, torque, strict=True):
            squares += np.sum(rows**2, axis=0, where=part.informative)
        return np.asarray(squares / np.maximum(self.count, 1.0))

    def residuals(self, arm: ArmModel) -> list[FloatArray]:
        """Return measured minus modelled torque of each trajectory, (M, n) [N m]."""
        return [part.residual(arm) for part in self.data]

    def block_squares(self, residual: Sequence[FloatArray]) -> FloatArray:
        """Return the sum of squared weighted residuals in each time block and joint, (B, n)."""
        block, _ = block_rows(self.data)
        rows = np.concatenate(residual) * row_weights(self.data, self.sigma)
        return np.column_stack([np.bincount(block, column) for column in rows.T**2])

    def limits(self, residual: Sequence[FloatArray], settings: DiagnosisSettings) -> FloatArray:
        """
        Return the largest `chi2_per_row` (n,) that noise and known residual of the model explain.

        Noise and residual have one degree of freedom per independent row each, so the ratio of
        their squares has an F distribution. A misfit, or estimated noise, may be larger by the
        factor `same_fit` in another motion. The square of an immaterial residual is added.

        """
        thresholds = settings.thresholds
        count = np.maximum(self.count, 2.0)
        freedom = np.maximum(count / self._correlation_length(residual), 4.0)
        each = 1.0 - (1.0 - thresholds.confidence) / len(count)
        noise = stats.f.ppf(each, freedom, freedom)
        if any(part.period is None for part in self.data):  # its noise is estimated
            noise = noise * thresholds.same_fit
        share = np.mean(np.square(self.noise), axis=0) / np.mean(np.square(self.sigma), axis=0)
        misfit = share < 1.0 / thresholds.same_fit
        return np.where(misfit, self.misfit_limit(settings), noise) + self.material_loss(settings)

    def misfit_limit(self, settings: DiagnosisSettings) -> FloatArray:
        """Return the largest `chi2_per_row` that the model's known residual explains, (n,)."""
        varies = np.ones_like(self.count) if self.varies is None else self.varies
        return np.asarray(settings.thresholds.same_fit * np.maximum(varies, 1.0))

    def material_loss(self, settings: DiagnosisSettings) -> FloatArray:
        """Return for each joint the `chi2_per_row` of the largest negligible residual, (n,)."""
        unit = np.mean(np.square(self.sigma), axis=0)
        return np.asarray((settings.material * self.torque_rms) ** 2 / unit)

    def _correlation_length(self, residual: Sequence[FloatArray]) -> FloatArray:
        """Return the correlation length of each joint's squared residual, in samples, (n,)."""
        products = np.zeros((21, len(self.count)))  # correlated over 20 rows at most
        for part, own in zip(self.data, residual, strict=True):
            rows = np.where(part.informative, own, 0.0)
            for lag in range(min(len(products), len(rows))):
                products[lag] += np.sum(rows[lag:] * rows[: len(rows) - lag], axis=0)
        correlation = products[1:] / np.maximum(products[0], 1e-300)
        return np.asarray(1.0 + 2.0 * np.sum(correlation**2, axis=0))


def torque_rms(data: Sequence[Trajectory]) -> FloatArray:
    """Return the root mean square torque of each joint while it moves, shape (n,) [N m]."""
    unit = [np.ones(part.motion.n_joints) for part in data]
    return Evidence.over_noise(data, unit).torque_rms


@dataclass(frozen=True)
class NoiseFloor:
    """
    Torque noise of each joint in a trajectory: total, at low frequency, and upper limit.

    Attributes
    ----------
    sigma : ndarray, shape (n,)
        Standard deviation of a row of each joint [N m].
    period : float or None
        Length of the repeated period of the motion [s]; None if the motion has none.
    structure : ndarray, shape (n,)
        Power of the difference of two periods at low frequency over that at high frequency.
    slow : ndarray, shape (n,)
        Standard deviation of the noise at low frequency [N m]; zero without a repeated period.
    rough : ndarray, shape (n,)
        Upper limit of the noise, from second differences of neighbouring rows [N m].

    """

    sigma: FloatArray
    period: float | None
    structure: FloatArray
    slow: FloatArray
    rough: FloatArray


def noise_floor(trajectory: Trajectory, arm: ArmModel) -> NoiseFloor:
    """
    Measure the torque noise of a trajectory from the difference between equal periods.

    Parameters
    ----------
    trajectory : Trajectory
        The trajectory.
    arm : ArmModel
        Model whose residual is used; effects that it lacks cancel in the difference of periods.

    """
    motion = trajectory.motion
    assert motion.tau is not None
    residual = motion.tau - arm.torque(motion)
    taps = trajectory.used.taps
    half = (len(taps) - 1) // 2
    smooth = signal.fftconvolve(residual, taps[:, np.newaxis], mode='same', axes=0)
    found = trajectory.period
    size = np.sqrt(np.mean(motion.tau**2, axis=0))
    least = np.maximum(TORQUE_RESOLUTION * np.maximum(size, 1e-2 * size.max()), 1e-12)
    if trajectory.sensors is not None:
        least = np.maximum(least, trajectory.sensors.floor(arm))
    rough = np.maximum(_noise_of_second_differences(trajectory, smooth), least)
    if found is None:
        one, zero = np.ones(motion.n_joints), np.zeros(motion.n_joints)
        return NoiseFloor(rough, None, one, zero, rough)
    lag, where = found
    first = np.arange(max(where.start, half), min(where.stop, len(motion) - lag - half))
    rows = first[:: trajectory.used.decimation]
    sigma, structure, slow = np.ones((3, motion.n_joints))
    for joint in range(motion.n_joints):
        rest, used = _difference(trajectory, smooth, rows, lag, joint)
        freedom = max(1.0, used.sum() - 4.0)
        sigma[joint] = np.sqrt(np.sum(rest[used] ** 2) / freedom / 2.0)
        rest, used = _difference(trajectory, residual, first, lag, joint)
        rest = np.where(used, rest, 0.0)
        length = min(len(rest), int(2.5 * trajectory.used.rate_hz))
        frequency, power = signal.welch(
            rest, fs=trajectory.used.rate_hz, nperseg=length, detrend=False
        )
        low = (frequency > 0.0) & (frequency < _LOW_HZ)
        high = (frequency > _HIGH_HZ[0]) & (frequency < _HIGH_HZ[1])
        if low.any() and high.sum() >= 3:
            structure[joint] = power[low].mean() / max(float(power[high].mean()), 1e-300)
        moving = np.sqrt(len(used) / max(2.0 * used.sum(), 1.0))
        below = power[frequency < _LOW_HZ].sum() * frequency[1]
        slow[joint] = np.sqrt(below) * moving
    structure[sigma < least] = 1.0
    sigma = np.maximum(sigma, least)
    period = lag * float(motion.t[1] - motion.t[0])
    return NoiseFloor(sigma, period, structure, slow, rough)


def joints_that_do_not_repeat(
    joints: Sequence[str],
    floors: Sequence[NoiseFloor],
    thresholds: Thresholds,
    least: FloatArray,
) -> tuple[str, ...]:
    """
    Return the joints whose torque differs between equal periods of a motion.

    The difference is at low frequency and material, such as that of a contact in one period. The
    joint with the largest difference comes first.

    Parameters
    ----------
    joints : sequence of str
        Names of the joints.
    floors : sequence of NoiseFloor
        Noise of each trajectory.
    thresholds : Thresholds
        Power ratios (low over high frequency) above which periods do not repeat.
    least : ndarray, shape (n,)
        Smallest material torque of each joint [N m].

    """
    ratios = [
        np.where(floor.slow > least, floor.structure, 1.0)
        for floor in floors
        if floor.period is not None
    ]
    if not ratios:
        return ()
    often = np.sum(np.array(ratios) >= thresholds.one_period, axis=0) >= max(1, len(ratios) / 2)
    mean = np.exp(np.mean(np.log(ratios), axis=0))
    if len(ratios) >= 3:
        often |= mean > thresholds.one_period_on_average
    return tuple(joints[j] for j in np.argsort(-mean) if often[j])


def _difference(
    trajectory: Trajectory, residual: FloatArray, first: npt.NDArray[np.intp], lag: int, joint: int
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """
    Return how a joint's residual differs between equal periods, where the joint moves.

    Linear drifts of offset and viscous friction are regressed out, because they are effects.

    """
    motion = trajectory.motion
    difference = residual[first + lag, joint] - residual[first, joint]
    t = (motion.t[first] - motion.t[first].mean()) / max(np.ptp(motion.t[first]), 1e-9)
    dq = motion.dq[first, joint]
    drifting = np.column_stack([np.ones_like(t), t, dq, t * dq])
    used = _in_informative_rows(trajectory, first, joint) & _in_informative_rows(
        trajectory, first + lag, joint
    )
    if used.sum() < _MIN_ROWS:
        used = np.ones(len(first), dtype=bool)
    fit = np.linalg.lstsq(drifting[used], difference[used], rcond=None)[0]
    return difference - drifting @ fit, used


def _in_informative_rows(
    trajectory: Trajectory, samples: npt.NDArray[np.intp], joint: int
) -> npt.NDArray[np.bool_]:
    """Return a mask (K,) of the samples whose nearest row is one in which the joint moves."""
    rows = trajectory.rows
    nearest = np.searchsorted((rows[1:] + rows[:-1]) / 2, samples)
    return np.asarray(trajectory.informative[nearest, joint])


def _noise_of_second_differences(trajectory: Trajectory, smooth: FloatArray) -> FloatArray:
    """
    Return an upper limit (n,) of torque noise from second differences of a residual [N m].

    The noise is assumed to be white in the band of the rows. Torque that a model lacks changes
    little from row to row, except for friction at reversals; rows next to reversals are not used.

    """
    rows, informative = smooth[trajectory.rows], trajectory.informative
    bend = np.diff(rows, 2, axis=0)
    between = informative[:-2] & informative[1:-1] & informative[2:]
    between[:, between.sum(axis=0) < _MIN_ROWS] = True
    power = np.sum(bend**2, axis=0, where=between) / np.maximum(between.sum(axis=0), 1)
    used = trajectory.used
    phase = 2.0 * np.pi * np.linspace(0.0, used.kept_hz * used.decimation / used.rate_hz, 100)
    return np.asarray(
        _COLOURED_OVER_WHITE * np.sqrt(power / np.mean((2.0 - 2.0 * np.cos(phase)) ** 2))
    )
