# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The data in the unit that a gap is measured in: their noise, or the model's own misfit.

Noise is what two equal periods of one trajectory differ by. The difference is taken of what a
model leaves over, evaluated in each period with its own measured positions: noise of the encoders
is inside as it goes through the model, and whatever depends on the motion alone cancels. Where
nothing repeats the noise is assumed, from how rows differ from their neighbours, and said to be
assumed.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.trajectory import block_rows, Trajectory, weighted_rows
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.identification.rows.signals import TORQUE_RESOLUTION
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import signal, stats

#: Rows apart that what is left may be alike.
_LAGS = 20
#: Fewer rows than this are not enough to leave any out.
_FEW = 20
#: Noise of torques is coloured: white noise that bends rows as much is smaller by up to this
#: factor in 95 % of the joints of 48 recordings of which two periods tell the noise.
_COLOUR = 1.4
#: What people, loose parts and machines nearby do is slow; noise of torques is as strong in the
#: band above, and noise of positions stronger [Hz]. Window of the spectra [s].
_SLOW_HZ, _FAST_HZ, _WINDOW = 4.0, (6.0, 12.0), 2.5


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

    @classmethod
    def over_noise(cls, data: Sequence[Trajectory], noise: Sequence[FloatArray]) -> Evidence:
        """Return data in the unit of their noise, each (n,) [N m]."""
        return cls(tuple(data), tuple(noise), tuple(noise))

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

    def weighted(self, rows: Sequence[FloatArray]) -> Iterator[FloatArray]:
        """Yield rows (M, n) or (M, n, P) of each trajectory over the unit, zero if they rest."""
        return weighted_rows(rows, self.data, self.sigma)

    def block_squares(self, residual: Sequence[FloatArray]) -> FloatArray:
        """Return the squares over the unit of what is left (M, n), by block and joint, (B, n)."""
        block, _ = block_rows(self.data)
        rows = np.concatenate(list(self.weighted(residual)))
        return np.column_stack([np.bincount(block, column) for column in rows.T**2])

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


def torque_rms(data: Sequence[Trajectory]) -> FloatArray:
    """Return the root mean square torque of each joint, of rows that tell something, (n,)."""
    unit = [np.ones(part.motion.n_joints) for part in data]
    return Evidence.over_noise(data, unit).torque_rms


@dataclass(frozen=True)
class NoiseFloor:
    """
    Noise of one trajectory.

    Attributes
    ----------
    sigma : ndarray, shape (n,)
        Standard deviation of a row of each joint [N m].
    period : float or None
        Length of the repeated period [s]; None where nothing repeats.
    structure : ndarray, shape (n,)
        Power of the difference of two periods at low frequency over that at high frequency.
    slow : ndarray, shape (n,)
        Deviation that one period has at low frequency [N m]; zero where nothing repeats.
    growth : ndarray, shape (n,)
        Power per bin of that difference in the upper third of what rows keep, over that in the
        lower one: noise of positions grows with frequency on its way through the model.

    """

    sigma: FloatArray
    period: float | None
    structure: FloatArray
    slow: FloatArray
    growth: FloatArray


def noise_floor(trajectory: Trajectory, arm: ArmModel) -> NoiseFloor:
    """
    Measure the noise of a trajectory beside a model.

    Parameters
    ----------
    trajectory : Trajectory
        The data.
    arm : ArmModel
        A model with parameters near to those of the data; what it lacks cancels.

    """
    motion = trajectory.motion
    assert motion.tau is not None
    left = motion.tau - arm.torque(motion)
    taps = trajectory.used.taps()
    half = (len(taps) - 1) // 2
    smooth = signal.fftconvolve(left, taps[:, np.newaxis], mode='same', axes=0)
    found = trajectory.period
    least = _least(trajectory, arm)
    if found is None:
        sigma = np.maximum(_assumed(trajectory, smooth), least)
        one, zero = np.ones(motion.n_joints), np.zeros(motion.n_joints)
        return NoiseFloor(sigma, None, one, zero, one)
    lag, where = found
    first = np.arange(max(where.start, half), min(where.stop, len(motion) - lag - half))
    rows = first[:: trajectory.used.decimation]
    sigma, structure, slow, growth = np.empty((4, motion.n_joints))
    kept = trajectory.used.kept_hz
    for joint in range(motion.n_joints):
        rest, used = _difference(trajectory, smooth, rows, lag, joint)
        freedom = max(1.0, used.sum() - 4.0)
        sigma[joint] = np.sqrt(np.sum(rest[used] ** 2) / freedom / 2.0)
        rest, used = _difference(trajectory, left, first, lag, joint)
        spectrum = _spectrum(np.where(used, rest, 0.0), trajectory.used.rate_hz)
        structure[joint] = _over(spectrum, (0.0, _SLOW_HZ), _FAST_HZ)
        slow[joint] = _deviation(spectrum) * np.sqrt(len(used) / max(2.0 * used.sum(), 1.0))
        growth[joint] = _over(spectrum, (2.0 * kept / 3.0, kept), (kept / 12.0, kept / 3.0))
    structure[sigma < least] = growth[sigma < least] = 1.0
    sigma = np.maximum(sigma, least)
    period = lag * float(motion.t[1] - motion.t[0])
    return NoiseFloor(sigma, period, structure, slow, growth)


def _difference(
    trajectory: Trajectory, left: FloatArray, first: npt.NDArray[np.intp], lag: int, joint: int
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """
    Return what samples of two periods differ by in one joint, and where that tells something.

    What drifts with time, by itself or in proportion to the velocity, is taken out: it is an
    effect of its own.

    """
    motion = trajectory.motion
    difference = left[first + lag, joint] - left[first, joint]
    t = (motion.t[first] - motion.t[first].mean()) / max(np.ptp(motion.t[first]), 1e-9)
    dq = motion.dq[first, joint]
    drifting = np.column_stack([np.ones_like(t), t, dq, t * dq])
    used = _between_rows(trajectory, first, joint) & _between_rows(trajectory, first + lag, joint)
    if used.sum() < _FEW:
        used = np.ones(len(first), dtype=bool)
    fit = np.linalg.lstsq(drifting[used], difference[used], rcond=None)[0]
    return difference - drifting @ fit, used


def _between_rows(
    trajectory: Trajectory, samples: npt.NDArray[np.intp], joint: int
) -> npt.NDArray[np.bool_]:
    """Return whether the nearest rows of a joint tell something, shape (K,)."""
    nearest = np.clip(np.searchsorted(trajectory.rows, samples), 0, len(trajectory.rows) - 1)
    return np.asarray(trajectory.informative[nearest, joint])


def _spectrum(difference: FloatArray, rate: float) -> tuple[FloatArray, FloatArray]:
    """Return frequencies [Hz] and the power per bin."""
    length = min(len(difference), int(_WINDOW * rate))
    frequency, power = signal.welch(difference, fs=rate, nperseg=length, detrend=False)
    return frequency, power


def _deviation(spectrum: tuple[FloatArray, FloatArray]) -> float:
    """Return the deviation at low frequency."""
    frequency, power = spectrum
    low = frequency < _SLOW_HZ
    return float(np.sqrt(np.sum(power[low]) * frequency[1]))


def _over(
    spectrum: tuple[FloatArray, FloatArray],
    band: tuple[float, float],
    other: tuple[float, float],
) -> float:
    """Return the power per bin of one band over that of another; 1 where there are no bins."""
    frequency, power = spectrum
    upper, lower = (power[(frequency > low) & (frequency < high)] for low, high in (band, other))
    if not len(upper) or len(lower) < 3:
        return 1.0
    return float(np.mean(upper) / max(float(np.mean(lower)), 1e-300))


def _assumed(trajectory: Trajectory, smooth: FloatArray) -> FloatArray:
    """
    Return at most what rows bend by from one to the next, as noise of the band that they keep.

    What a model lacks is slower than rows. Friction that it lacks jumps where a joint turns round;
    rows beside those do not count.

    """
    rows, informative = smooth[trajectory.rows], trajectory.informative
    bend = np.diff(rows, 2, axis=0)
    between = informative[:-2] & informative[1:-1] & informative[2:]
    between[:, between.sum(axis=0) < _FEW] = True
    power = np.sum(bend**2, axis=0, where=between) / np.maximum(between.sum(axis=0), 1)
    used = trajectory.used
    phase = 2.0 * np.pi * np.linspace(0.0, used.kept_hz * used.decimation / used.rate_hz, 100)
    return np.asarray(_COLOUR * np.sqrt(power / np.mean((2.0 - 2.0 * np.cos(phase)) ** 2)))


def _least(trajectory: Trajectory, arm: ArmModel) -> FloatArray:
    """Return what no torque is better known than, shape (n,) [N m]."""
    assert trajectory.motion.tau is not None
    size = np.sqrt(np.mean(trajectory.motion.tau**2, axis=0))
    least = np.maximum(TORQUE_RESOLUTION * np.maximum(size, 1e-2 * size.max()), 1e-12)
    sensors = trajectory.sensors
    return np.asarray(least if sensors is None else np.maximum(least, sensors.floor(arm)))
