# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Filters, differentiation and decimation of recorded signals for the fit of a model.

Positions are low-passed without phase (Butterworth of order 4, forwards and backwards) and
differentiated by central differences. Torque and regressor then pass the same low-pass and are
decimated together. The filter therefore acts alike on both sides of the equation (parallel
filtering; Gautier 1997).

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from armid_ros.errors import IdentificationError
from armid_ros.identification.rows.stamps import check_recordings, uneven_stamps
from armid_ros.model import points_motion
from armid_ros.motion import FloatArray, Motion, MovingPoints, read_only
from armid_ros.recording import Recording
from armid_ros.recording.recording import GAP_PERIODS
from armid_ros.recording.series import NOTHING
import numpy as np
import numpy.typing as npt
from scipy import fft, signal
from scipy.interpolate import CubicSpline
from scipy.ndimage import correlate1d

#: Band of torque and regressor over that of the motion, with harmonics of friction steps.
MODEL_BANDS = 10.0
#: Samples per period of the cut-off that suffice for a smooth function of the filtered positions.
_SMOOTH_SAMPLES = 5.0
#: Ratio of the spectrum of positions to the noise level below which the spectrum is only noise.
NOISE_MARGIN = 3.0
#: Periods of the cut-off that are removed at both ends, where the filter lacks neighbours.
EDGE_PERIODS = 4.0
#: Shortest stretch in periods of the cut-off: the periods removed at both ends, and two more,
#: without the samples that the decimation removes.
_CUTOFF_PERIODS = 2.0 * EDGE_PERIODS + 2.0
#: Best resolution of a drive, as a share of its torque: 13 bits. In a simulation without noise,
#: errors of differentiation are smaller.
TORQUE_RESOLUTION = 1e-4
#: Half length of the decimation filter in output samples; its edges are cut off.
_HALF_TAPS = 4
#: Smallest number of samples of a stretch for a spectrum.
_MIN_SAMPLES = 4


@dataclass(frozen=True)
class SignalSettings:
    """
    Position cut-off and decimation set by the user; if None, chosen from the recordings.

    Attributes
    ----------
    cutoff_hz : float or None
        Cut-off of the position filter [Hz].
    decimation : int or None
        Number of samples of which one is kept; the low-pass before passes 0.4 of the new rate.

    """

    cutoff_hz: float | None = None
    decimation: int | None = None

    def __post_init__(self) -> None:
        """Raise an error for a cut-off or decimation out of range."""
        if self.cutoff_hz is not None and not self.cutoff_hz > 0.0:
            raise IdentificationError(
                f'the cut-off of positions, {self.cutoff_hz} Hz, has to be positive'
            )
        if self.decimation is not None and self.decimation < 1:
            raise IdentificationError(f'the decimation, {self.decimation}, has to be 1 or more')


@dataclass(frozen=True)
class Conditioning:
    """
    Filter settings for recordings of equal sampling rate: position cut-off and decimation.

    Attributes
    ----------
    rate_hz : float
        Sampling rate of the signals [Hz].
    cutoff_hz : float
        Cut-off of the position filter [Hz].
    decimation : int
        Number of samples of which one is kept.
    given : frozenset of {'cutoff', 'decimation'}
        Settings given by the user; the others were chosen from recordings.

    """

    rate_hz: float
    cutoff_hz: float
    decimation: int
    given: frozenset[str] = field(default=frozenset(), compare=False)

    @property
    def kept_hz(self) -> float:
        """Highest frequency that remains after decimation [Hz]."""
        # the decimation filter ends at this share of the decimated rate
        return 0.4 * self.rate_hz / self.decimation

    @cached_property
    def taps(self) -> FloatArray:
        """Coefficients of the symmetric decimation filter; a single 1 without decimation."""
        if self.decimation == 1:
            return read_only(np.ones(1))
        count = 2 * _HALF_TAPS * self.decimation + 1
        window = 'kaiser', 5.0
        return read_only(signal.firwin(count, self.kept_hz, window=window, fs=self.rate_hz))

    @property
    def smooth_stride(self) -> int:
        """
        Largest stride [samples] that suffices to compute smooth functions of filtered positions.

        The spectrum of positions ends at the cut-off, that of smooth functions slightly above.
        Five samples per period of the cut-off are enough for the pass band of the decimation.

        """
        widest = self.rate_hz / (_SMOOTH_SAMPLES * self.cutoff_hz)
        divisors = [d for d in range(1, self.decimation + 1) if self.decimation % d == 0]
        return max(d for d in divisors if d <= max(1.0, widest))


def conditioning(recordings: Sequence[Recording], settings: SignalSettings) -> Conditioning:
    """
    Choose position cut-off and decimation for recordings of equal sampling rate.

    The cut-off of positions is the frequency at which their spectrum falls to their noise. It is
    at most a fifth of the sampling rate, as derivatives above are only noise. It is also at most
    five times the band of torque and regressor, which hardly depend on higher frequencies.
    The band of the motion contains 99 % of the velocities' power. Torque and regressor have ten
    times this band, and are decimated to 2.5 samples per period of its upper end.

    """
    check_recordings(recordings)
    rate = float(np.median([1.0 / recording.period for recording in recordings]))
    cutoff, decimation = settings.cutoff_hz, settings.decimation
    if cutoff is None or decimation is None:
        # where the spectrum of each position falls to its noise, which is white at the sensor
        crossings, parts = [], []
        for recording in recordings:
            stretches, frequency, power, floor = _position_spectrum(recording)
            above = power > NOISE_MARGIN * floor
            crossings.append(np.array([frequency[np.argmin(column)] for column in above.T]))
            parts += [(q, crossings[-1]) for q in stretches]
        band = MODEL_BANDS * _motion_band(parts, rate)
        # Largest cut-off of positions over the band of torque and regressor. The Butterworth
        # filter, applied in both directions, changes that band by at most 5^-8, which is below
        # TORQUE_RESOLUTION.
        position_bands = 5.0
        if decimation is None:
            stride = max(1, int(rate / (_SMOOTH_SAMPLES * position_bands * band)))
            decimation = max(1, int(rate / (2.5 * band)) // stride * stride)  # see smooth_stride
        kept = max(band, Conditioning(rate, band, decimation).kept_hz)
        highest = min(position_bands * kept, 0.2 * rate)
        cutoff = cutoff or min(max(float(np.max(crossings)), band), highest)
    if cutoff >= 0.5 * rate:
        raise IdentificationError(
            f'{recordings[0].source}: a cut-off of {cutoff:g} Hz needs more than '
            f'{2 * cutoff:g} samples/s; the recording has {rate:g}'
        )
    options = {'cutoff': settings.cutoff_hz, 'decimation': settings.decimation}
    given = frozenset(name for name, value in options.items() if value is not None)
    return Conditioning(rate, cutoff, decimation, given)


def velocity_error(recording: Recording, used: Conditioning) -> FloatArray:
    """
    Return the standard deviation of velocities from filtered positions, (n,) [rad/s or m/s].

    One part is white noise of the positions up to the cut-off, times the square of the frequency.
    The other part is motion above the cut-off, which the filter removes.

    Returns
    -------
    ndarray, shape (n,)
        Standard deviation [rad/s or m/s].

    """
    _, frequency, power, floor = _position_spectrum(recording)
    lost = (frequency[:, np.newaxis] > used.cutoff_hz) & (power > NOISE_MARGIN * floor)
    lacking = np.sum(frequency[:, np.newaxis] ** 2 * (power - floor), axis=0, where=lost)
    noise = floor * used.cutoff_hz**3 / 3.0
    return np.asarray(2.0 * np.pi * np.sqrt(noise + lacking * frequency[1]))


def segments(recording: Recording, used: Conditioning) -> Iterator[Motion]:
    """
    Yield the motion of each gap-free section, evenly sampled, with filtered positions.

    Positions are differentiated as well; torques are unchanged. Stretches too short for the
    filters are left out.

    """
    if recording.tau is None:
        lacking = [field for field in recording.report.absent if field.startswith('effort')]
        effort = ''.join(lacking) or 'effort'
        raise IdentificationError(
            f'{recording.source}: {recording.topic} has no {effort} (absent or NaN throughout). '
            'Identification needs the torque of every joint in JointState.effort: fill it in, or '
            'leave joints out with --joints'
        )
    positions = recording.q
    if recording.partner is not None:
        positions = np.hstack([positions, recording.partner.q])
    nothing, measured = np.max(np.abs(recording.tau), axis=0) < NOTHING, recording.tau
    measured = np.where(nothing, 0.0, measured) if nothing.any() else measured
    period = 1.0 / used.rate_hz
    for part in unbroken(recording, used.rate_hz):
        if len(part) >= _MIN_SAMPLES and np.ptp(recording.t[part]) > _shortest(used):
            own = slice(int(part[0]), int(part[-1]) + 1)  # a slice copies nothing
            t, q, tau = _even(recording.t[own], period, positions[own], measured[own])
            yield _differentiated(recording, t, q, tau, used)


def unbroken(recording: Recording, rate: float) -> list[npt.NDArray[np.intp]]:
    """Return the sample indices of each gap-free section of a recording."""
    longest = GAP_PERIODS * max(1.0 / rate, recording.period)
    breaks = np.flatnonzero(np.diff(recording.t) > longest) + 1
    return np.split(np.arange(len(recording.t)), breaks)


def _shortest(used: Conditioning) -> float:
    """Return the duration of the shortest section that the filters can process [s]."""
    edges = 2 * _HALF_TAPS * used.decimation / used.rate_hz  # of the decimation
    return edges + _CUTOFF_PERIODS / used.cutoff_hz


def no_stretch(recording: Recording, used: Conditioning) -> IdentificationError:
    """Return the error for a recording whose gap-free sections are all too short."""
    uneven = uneven_stamps(recording, used.cutoff_hz)
    if uneven:
        return IdentificationError(uneven)
    spans = [recording.t[part[[0, -1]]] for part in unbroken(recording, used.rate_hz)]
    longest = max(float(last - first) for first, last in spans)
    left = longest - _shortest(used) + _CUTOFF_PERIODS / used.cutoff_hz
    if 'cutoff' in used.given and left > 0.0:
        return IdentificationError(
            f'{recording.source}: --cutoff {used.cutoff_hz:g} Hz is too low for {longest:.2f} s '
            f'without a gap: give more than {_CUTOFF_PERIODS / left:.2g} Hz, or no --cutoff'
        )
    return IdentificationError(
        f'{recording.source}: no section is long enough to be filtered at {used.cutoff_hz:g} Hz: '
        f'the longest without a gap has {longest:.2f} s, more than {_shortest(used):.2f} s are '
        'needed. Record longer, or without gaps'
        + (', or lower --decimation' if 'decimation' in used.given else '')
    )


def decimate(values: FloatArray, used: Conditioning, stride: int = 1) -> FloatArray:
    """
    Low-pass and decimate values along the first axis, such as torques and regressor columns.

    Parameters
    ----------
    values : ndarray, shape (ceil(N / stride), ...)
        Samples at the full rate, or every stride-th sample.
    used : Conditioning
        Filters.
    stride : int
        Divisor of the decimation; above 1 only for values without frequencies beyond the filter.

    Returns
    -------
    ndarray, shape (M, ...)
        Sample m belongs to input ``decimated_samples(N, used)[m]``.

    """
    taps, factor = used.taps[::stride], used.decimation // stride
    taps = taps / taps.sum()
    count = len(range(len(taps) // 2, len(values) - len(taps) // 2, factor))
    flat = values.reshape(len(values), -1)
    # half of the columns are zero, as torques do not depend on links nearer to the base
    active = np.flatnonzero(flat.any(axis=0))
    some = flat.take(active, axis=1) if len(active) < flat.shape[1] else flat
    filtered = np.empty((count, len(active)))
    size = 16  # number of output samples per matrix product; larger products multiply more zeros
    band = np.zeros((size, (size - 1) * factor + len(taps)))
    for row in range(size):
        band[row, row * factor : row * factor + len(taps)] = taps
    for start in range(0, count, size):
        rows = min(size, count - start)
        width = (rows - 1) * factor + len(taps)
        window = some[start * factor : start * factor + width]
        np.matmul(band[:rows, :width], window, out=filtered[start : start + rows])
    if len(active) < flat.shape[1]:
        result = np.zeros((count, flat.shape[1]))
        result[:, active] = filtered
        filtered = result
    return filtered.reshape((count, *values.shape[1:]))


def decimated_samples(n_samples: int, used: Conditioning) -> range:
    """Return the indices of the samples that remain after decimation."""
    half = (len(used.taps) - 1) // 2
    return range(half, max(half, n_samples - half), used.decimation)


def _even(t: FloatArray, period: float, *signals: FloatArray) -> tuple[FloatArray, ...]:
    """Return evenly spaced times and signals; cubic splines interpolate if the stamps jitter."""
    grid = np.linspace(t[0], t[-1], round((t[-1] - t[0]) / period) + 1)
    # stamps that differ by less than a twentieth of a period are even
    if len(grid) == len(t) and np.max(np.abs(grid - t)) < 0.05 * period:
        return grid, *signals
    return grid, *(CubicSpline(t, one)(grid) for one in signals)


def position_noise(recording: Recording) -> FloatArray:
    """Return the standard deviation of the white noise of positions, shape (n,) [rad or m]."""
    rate = 1.0 / recording.period
    parts = [part for part in unbroken(recording, rate) if len(part) >= _MIN_SAMPLES]
    stretches = [_even(recording.t[part], 1.0 / rate, recording.q[part])[1] for part in parts]
    frequency, power = mean_spectrum(stretches, rate, detrend='linear')
    # share of the sampling rate above which the spectrum of positions is noise
    level = np.mean(power[frequency > 0.3 * rate], axis=0)
    return np.asarray(np.sqrt(level * 0.5 * rate))


def _differentiated(
    recording: Recording, t: FloatArray, q: FloatArray, tau: FloatArray, used: Conditioning
) -> Motion:
    """Return the filtered motion of a section; `q` may have more columns, of another machine."""
    sections = signal.butter(4, used.cutoff_hz, fs=used.rate_hz, output='sos')
    smooth = signal.sosfiltfilt(sections, q, axis=0)
    dq = _central_difference(smooth, t[1] - t[0])
    n = recording.n_joints
    ddq = _central_difference(dq[:, :n], t[1] - t[0])
    for array in (smooth, dq, ddq):
        array.setflags(write=False)  # a Motion copies arrays that may change
    edge = int(np.ceil(EDGE_PERIODS * used.rate_hz / used.cutoff_hz))
    inner = slice(edge, len(t) - edge)
    # differences of two samples damp the cut-off by sinc(1 / 20), 0.4 %
    few = max(1, int(used.rate_hz / (20.0 * used.cutoff_hz)))
    sparse = smooth[::few, :n]
    if len(sparse) > 50_000:  # a length without large prime factors is transformed faster
        sparse = sparse[: 1 + fft.prev_fast_len(len(sparse) - 1)]
    # Band of second derivatives of torques (fourth of positions): twice that of the motion. From 2
    # to 5 times, elasticity is detected equally well; at 10, there is only noise.
    band = 2.0 * _motion_band([(sparse, used.cutoff_hz)], used.rate_hz / few)
    points = None
    if recording.partner is not None:
        # motion of the ends of the ties on the other machine
        other, ties = recording.partner, recording.partner.ties
        position, jacobian = points_motion(
            other.robot,
            [tie.other_joint for tie in ties],
            np.array([tie.other_point for tie in ties]).reshape(-1, 3),
            smooth[inner, n:],
        )
        velocity = np.einsum('nsxj,nj->nsx', jacobian, dq[inner, n:])
        points = MovingPoints(tuple(tie.name for tie in ties), position, velocity)
    parts = (part[inner] for part in (smooth[:, :n], dq[:, :n], ddq, tau))
    heat = recording.temperature
    return Motion(
        recording.joints, t[inner], *parts, band_hz=band, partner=points, temperature=heat
    )


def _central_difference(x: FloatArray, step: float) -> FloatArray:
    """Return the derivative of samples along the first axis, with an error of fourth order."""
    weights = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12.0 * step)
    return np.asarray(correlate1d(x, weights, axis=0, mode='nearest'))


def _motion_band(stretches: Sequence[tuple[FloatArray, npt.ArrayLike]], rate: float) -> float:
    """Return the frequency [Hz] below which each joint has 99 % of its velocity's power."""
    # Each stretch has positions and the frequency above which they are noise, of all joints or of
    # each. Power above this frequency is ignored, as a joint that hardly moves has only noise
    # there. For the same reason, the power is summed over all stretches.
    band = rate / max(len(q) for q, _ in stretches)
    for joint in range(stretches[0][0].shape[1]):
        spectra = []
        for q, end in stretches:
            velocity = np.diff(q[:, joint])
            frequency = fft.rfftfreq(len(velocity), 1.0 / rate)
            power = np.abs(fft.rfft(velocity - velocity.mean())) ** 2 / len(velocity)
            inside = frequency <= np.broadcast_to(end, q.shape[1])[joint]
            spectra.append((frequency[inside], power[inside]))
        frequency, power = (np.concatenate(part) for part in zip(*spectra, strict=True))
        order = np.argsort(frequency, kind='stable')
        share = np.cumsum(power[order])
        if share[-1] > 0.0:
            band = max(band, float(frequency[order[np.searchsorted(share, 0.99 * share[-1])]]))
    return band


def mean_spectrum(
    stretches: Sequence[FloatArray],
    rate: float,
    detrend: Literal['constant', 'linear'] = 'constant',
    segment: float = 8.0,
) -> tuple[FloatArray, FloatArray]:
    """
    Return frequencies [Hz] and mean power spectrum of signals, by the method of Welch (1967).

    Parameters
    ----------
    stretches : sequence of ndarray, each (N, n)
        Evenly sampled signals of stretches. Stretches shorter than a segment are left out;
        segments are no longer than the longest stretch.
    rate : float
        Samples per second.
    detrend : {'constant', 'linear'}
        Trend that is subtracted from every segment: its mean, or a line.
    segment : float
        Length of the segments [s].

    Returns
    -------
    frequency : ndarray, shape (K,)
        Frequencies [Hz].
    power : ndarray, shape (K, n)
        Power per Hz.

    """
    length = min(max(map(len, stretches)), int(segment * rate))
    long_enough = [values for values in stretches if len(values) >= length]
    spectra = [
        signal.welch(
            values, fs=rate, window='blackmanharris', nperseg=length, detrend=detrend, axis=0
        )
        for values in long_enough
    ]
    weights = [len(values) for values in long_enough]
    power = np.average([power for _, power in spectra], axis=0, weights=weights)
    return spectra[0][0], power


def _position_spectrum(
    recording: Recording,
) -> tuple[list[FloatArray], FloatArray, FloatArray, FloatArray]:
    """Return gap-free positions, frequencies (K,) [Hz], power (K, n) and noise (n,) per Hz."""
    rate = 1.0 / recording.period
    parts = [part for part in unbroken(recording, rate) if len(part) >= _MIN_SAMPLES]
    stretches = [recording.q[part] for part in parts] or [recording.q]
    frequency, power = mean_spectrum(stretches, rate)
    upper = frequency > 0.3 * rate  # the upper 40 % of the spectrum contain no motion
    return stretches, frequency, power, np.median(power[upper], axis=0)
