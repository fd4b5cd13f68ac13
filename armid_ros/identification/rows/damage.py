# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Detection of damaged samples of a recording by the gate of a stream, and interpolation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.identification.rows.signals import Conditioning
from armid_ros.identification.samples.spikes import N_FIRST, SpikeGate
from armid_ros.identification.samples.straight_line import (
    ErrorModel,
    Excursion,
    growth_over,
    innovation_of,
    MAX_GAP,
    quantile,
    robust_scale,
    share_of_noise,
    smallest_steps,
    StreamSample,
    WINDOW,
)
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt


def without_damage(
    recordings: Sequence[Recording], used: Conditioning
) -> tuple[list[Recording], tuple[str, ...]]:
    """
    Replace damaged samples of recordings by interpolation; return recordings and notes.

    A torque sample is damaged if it changes the filtered torque by more than noise does. Before
    any fit, the noise is assumed as a share of the spread of the torque. A recording without
    damage is the same object.

    """
    peak = float(np.max(used.taps) / np.sum(used.taps))
    repaired, found = [], []
    for recording in recordings:
        repaired.append(recording)
        t, tau, joints = recording.t, recording.tau, recording.joints
        if tau is None or len(t) <= 2:
            continue
        some = tau[:: max(1, len(tau) // 10_000)]  # enough for a spread within 2 %
        spread = 1.4826 * np.median(np.abs(some - np.median(some, axis=0)), axis=0)
        # the noise of a torque is assumed to be 1 % of its spread
        floor = np.concatenate([np.zeros(len(joints)), 0.01 * spread / peak])
        excursions = impossible_excursions(t, np.hstack([recording.q, tau]), floor)
        damaged = [sample.t for one in excursions for sample in one.samples]
        good = ~np.isin(t, damaged)
        if not damaged or not good.any():
            continue
        names = [f'{kind} of {joint}' for kind in ('position', 'effort') for joint in joints]
        named = [
            f'{names[int(np.argmax(one.ratio))]} at {sample.t:.3f} s'
            for one in excursions
            for sample in one.samples
        ]
        named[3:] = ['...'] if len(damaged) > 3 else []
        jump = '1 sample jumps and comes back; it was'
        if len(damaged) > 1:
            jump = f'{len(damaged)} samples jump and come back; they were'
        found.append(f'{recording.source}: {jump} replaced by interpolation: {", ".join(named)}')
        q, dq, tau = (
            x if x is None else np.column_stack([np.interp(t, t[good], c[good]) for c in x.T])
            for x in (recording.q, recording.dq, tau)
        )
        assert q is not None
        repaired[-1] = replace(recording, q=q, dq=dq, tau=tau)
    return repaired, tuple(found)


def impossible_excursions(t: FloatArray, x: FloatArray, floor: FloatArray) -> list[Excursion]:
    """
    Return jumps of signals away and back that no real motion or torque can cause.

    A `SpikeGate` finds them with the prediction errors and ranges of the whole recording. It
    processes only samples that differ too much from their prediction, and the samples after them.

    Parameters
    ----------
    t : ndarray, shape (N,)
        Increasing time stamps, at least 3 [s].
    x : ndarray, shape (N, 2 n)
        Positions and torques; angles are not wrapped.
    floor : ndarray, shape (2 n,)
        Negligible error of each signal of a sample.

    Returns
    -------
    list of Excursion

    """
    stretch, suspect, model = _suspects(t, x, floor)
    if not suspect.any():
        return []
    gate = SpikeGate([True] * (x.shape[1] // 2), 'qt')
    found: list[Excursion] = []
    done = 0
    for k in np.flatnonzero(suspect).tolist():
        if k < done:
            continue
        start, known, curvature = int(stretch[k]), [], np.zeros(x.shape[1])
        if k - start >= N_FIRST or start < done:
            known = [StreamSample(float(t[i]), x[i]) for i in range(max(start, k - 3), k)]
            if len(known) == 3:
                error = innovation_of(known[:2], known[2], model.period)
                curvature = error.error / error.acceleration
            start = k
        gate.begin(model, known[-2:], curvature)
        passed, done = 0, start
        while done < len(t) and (passed < 2 or done <= k):
            good = gate.take(float(t[done]), x[done], floor)
            passed = passed + 1 if len(good) == 1 else 0
            found += gate.left_out
            done += 1
    good_ones = ~np.isin(t, [sample.t for one in found for sample in one.samples])
    if not (found and good_ones.any()):
        return found
    lowest, highest = np.min(x[good_ones], axis=0), np.max(x[good_ones], axis=0)
    return [one for one in found if not gate.possible(one, lowest, highest)]


def _suspects(
    t: FloatArray, x: FloatArray, floor: FloatArray
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.bool_], ErrorModel]:
    """
    Return section starts, a mask of samples off their predicted line, and the error model.

    Returns for each sample the first sample of its section, (N,), and whether a signal is off
    the line through the two previous samples by more than the largest allowed error, (N,); then
    the prediction errors in the noisiest window.

    """
    dt = np.diff(t)
    period = float(np.median(dt))
    gap = dt > MAX_GAP * period
    first = np.where(np.concatenate([[True], gap]), np.arange(len(t)), 0)
    apart = gap[1:] | gap[:-1]
    ratio, (noise, acceleration) = dt[1:] / dt[:-1], growth_over(dt[:-1], dt[1:], period)
    growth, allowed = np.maximum(noise, acceleration), quantile(period, x.shape[1])
    # windows of equal length are processed together; the last few samples are in none
    count = max(1, len(ratio) // WINDOW)
    length = len(ratio) // count
    suspect = np.zeros(len(t), dtype=bool)
    found = []
    for signal, least in zip(x.T, floor, strict=True):  # arrays of one signal fit into the cache
        moves = np.diff(signal)
        error = moves[1:] - ratio * moves[:-1]
        error[apart] = 0.0
        windows = (error / growth)[: count * length].reshape(count, length).T
        scales = robust_scale(windows)
        loudest = int(np.argmax(scales))
        white = share_of_noise(windows[:, loudest], scales[loudest])
        step = float(smallest_steps(np.abs(moves)[:, np.newaxis])[-1, 0])
        resolution = min(step if np.isfinite(step) else 0.0, float(np.abs(error).max()))
        size = max(scales[loudest], resolution)
        model = ErrorModel(period, np.array([size]), np.array([white]), allowed)
        limit = np.maximum(model.limits(noise, acceleration), least)
        # a smooth signal keeps its curvature
        error[1:] -= model.correlation * (error[:-1] / acceleration[:-1]) * acceleration[1:]
        suspect[2:] |= (np.abs(error) > limit) & ~apart
        found.append((size, white))
    sizes, shares = np.array(found).T
    model = ErrorModel(period, sizes, shares, allowed)
    return np.maximum.accumulate(first), suspect, model
