# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Damaged samples of a recording, found as those of a stream are (`spikes`), and made up for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.identification.row_noise import NOISE_OF_TORQUE
from armid_ros.identification.signals import Conditioning, conditioning, SignalSettings
from armid_ros.identification.spikes import SpikeGate
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt

#: Samples that are named at most.
_NAMED = 3


@dataclass(frozen=True)
class Damage:
    """
    Samples that were made up for.

    Attributes
    ----------
    source : str
        The recording.
    samples : int
        How many.
    worst : tuple of str
        What jumped and when, of the first few.

    """

    source: str
    samples: int
    worst: tuple[str, ...]

    def __str__(self) -> str:
        """Say what was found."""
        what = '1 sample jumps and comes back; it was'
        if self.samples > 1:
            what = f'{self.samples} samples jump and come back; they were'
        more = ', ...' if self.samples > len(self.worst) else ''
        return f'{self.source}: {what} interpolated across: {", ".join(self.worst)}{more}'


def without_damage(
    recordings: Sequence[Recording], settings: SignalSettings
) -> tuple[list[Recording], tuple[Damage, ...]]:
    """
    Interpolate across damaged samples.

    A torque is damaged if it alone would move a filtered row by more than noise does; how large
    noise is, before anything has been fitted, is a share of how much the torque varies.

    Returns
    -------
    list of Recording
        Those without damage are the same objects.
    tuple of Damage
        What was found.

    """
    used = conditioning(list(recordings), settings)
    repaired, found = [], []
    for recording in recordings:
        bad = np.zeros(len(recording), dtype=bool)
        if recording.tau is not None and len(recording) > 2:
            bad, signal = _damaged(recording, used)
        if bad.any():
            names = [f'{what} of {j}' for what in ('position', 'effort') for j in recording.joints]
            worst = tuple(
                f'{names[int(signal[k])]} at {recording.t[k]:.3f} s'
                for k in np.flatnonzero(bad)[:_NAMED]
            )
            found.append(Damage(recording.source, int(bad.sum()), worst))
            recording = _repaired(recording, bad)
        repaired.append(recording)
    return repaired, tuple(found)


def _damaged(
    recording: Recording, used: Conditioning
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.intp]]:
    """Return which samples are damaged, shape (N,), and which signal of each is furthest off."""
    assert recording.tau is not None
    signals = np.hstack([recording.q, recording.tau])
    middle = np.median(recording.tau, axis=0)
    spread = 1.4826 * np.median(np.abs(recording.tau - middle), axis=0)
    peak = float(np.max(used.taps()) / np.sum(used.taps()))
    floor = np.concatenate([np.zeros(recording.n_joints), NOISE_OF_TORQUE * spread / peak])
    gate = SpikeGate(np.zeros(signals.shape[1], dtype=bool))
    off = gate.furthest_off(recording.t, signals, floor)
    bad = np.zeros(len(recording), dtype=bool)
    if np.any(off > 1.0):
        kept = [
            sample.t
            for t, x in zip(recording.t, signals, strict=True)
            for sample in gate.take(float(t), x, floor)
        ]
        kept += [sample.t for sample in gate.rest()]
        bad = ~np.isin(recording.t, kept)
        bad = _impossible(bad, off, recording)
    return bad, np.argmax(off, axis=1)


def _impossible(
    bad: npt.NDArray[np.bool_], off: FloatArray, recording: Recording
) -> npt.NDArray[np.bool_]:
    """
    Return the pulses that no arm makes, shape (N,).

    A position cannot jump and come back. A torque can, as where free play is crossed, but not to
    where it never is otherwise.

    """
    assert recording.tau is not None
    tau, n = recording.tau, recording.n_joints
    good = tau[~bad]
    beyond = (tau < good.min(axis=0)) | (tau > good.max(axis=0))
    sure = np.any(off[:, :n] > 1.0, axis=1) | np.any((off[:, n:] > 1.0) & beyond, axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], bad.astype(int), [0]]))).reshape(-1, 2)
    result = np.zeros_like(bad)
    for start, stop in edges:
        result[start:stop] = sure[start:stop].any()
    return result


def _repaired(recording: Recording, bad: npt.NDArray[np.bool_]) -> Recording:
    """Return a recording with straight lines across damaged samples."""

    def across(values: FloatArray | None) -> FloatArray | None:
        if values is None:
            return None
        t, good = recording.t, ~bad
        return np.stack([np.interp(t, t[good], column[good]) for column in values.T], axis=1)

    q = across(recording.q)
    assert q is not None
    return replace(recording, q=q, dq=across(recording.dq), tau=across(recording.tau))
