# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Whether recorded velocities are those of the recorded positions, in the recorded time.

The integral of a velocity is compared with the position: noise and steps of a position that would
be differentiated do not matter, and neither do time stamps that jitter.

"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from armid_ros.identification.rows.checks import REST_RANGE
from armid_ros.identification.rows.signals import GAP_PERIODS
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
from scipy.integrate import cumulative_trapezoid

#: Velocities are integrated over pieces of at most so many seconds, which is a period and more of
#: what arms do: their noise adds up to a walk.
_PIECE = 10.0
#: What a joint of constant speed leaves its line by [rad or m].
_STEADY = 0.1 * REST_RANGE
#: Correlation from which a ratio is a plain factor. A low-pass that takes a twentieth of a
#: velocity delays it by a phase whose cosine is that much less than one, 0.95.
_PLAIN = 0.98
#: A common factor is one from so much on. A twentieth of the time is a tenth of what inertia
#: takes; scales of encoders and clocks are wrong by a hundredth at most, and so is the integral.
_TOLERANCE = 0.05
#: A velocity of this correlation with what its position does, within this factor of a unit, is in
#: that unit: half of its power follows, and no other unit or sign is near.
_FOLLOWS, _NEAR = 0.7, 1.25
#: Factors of joints that are one differ by less than this.
_ALIKE = 0.02
#: Velocities in degrees/s beside positions in rad, or the other way round, are no matter of time.
_DEGREES = np.deg2rad(1.0), np.rad2deg(1.0)


@dataclass(frozen=True)
class VelocityRatio:
    """
    Recorded velocities over those that positions have.

    Attributes
    ----------
    ratio : ndarray, shape (n,)
        1 in equal units; NaN where a joint rests, or goes at constant speed.
    fit : ndarray, shape (n,)
        Correlation of the two; 0 where a velocity is zero throughout.

    """

    ratio: FloatArray
    fit: FloatArray


def velocity_ratio(recording: Recording) -> VelocityRatio | None:
    """Compare velocities of a recording with its positions; None where it has none."""
    if recording.dq is None:
        return None
    # positions and integrated velocities of unbroken pieces, both without their line
    pairs, n = [], recording.n_joints
    breaks = np.flatnonzero(np.diff(recording.t) > GAP_PERIODS * recording.period) + 1
    for stretch in np.split(np.arange(len(recording.t)), breaks):
        duration = recording.t[stretch[-1]] - recording.t[stretch[0]]
        for part in np.array_split(stretch, max(1, int(np.ceil(duration / _PIECE)))):
            if len(part) > 3:
                t = recording.t[part] - recording.t[part[0]]
                line = np.linalg.qr(np.column_stack([np.ones(len(t)), t]))[0]
                made = cumulative_trapezoid(recording.dq[part], t, axis=0, initial=0.0)
                pairs.append([x - line @ (line.T @ x) for x in (recording.q[part], made)])
    if not pairs:
        return VelocityRatio(np.full(n, np.nan), np.zeros(n))
    moved, made = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    product, own, other = np.sum(moved * made, 0), np.sum(moved**2, 0), np.sum(made**2, 0)
    # A joint of constant speed has nothing but its line, and noise.
    rests = (np.ptp(recording.q, axis=0) < REST_RANGE) | (own < len(moved) * _STEADY**2)
    size = np.sqrt(own * other)
    return VelocityRatio(
        np.where(rests, np.nan, product / np.where(rests, 1.0, own)),
        np.where(~rests & (size > 0.0), product / np.where(size > 0.0, size, 1.0), 0.0),
    )


def time_base_fault(recording: Recording) -> str:
    """
    Say that all velocities are the same factor from what positions do; empty where they are not.

    Two joints at least have to agree, and no other that moves may disagree. One alone is a matter
    of that joint.

    """
    found = velocity_ratio(recording)
    if found is None:
        return ''
    plain = found.ratio[found.fit > _PLAIN]
    if len(plain) < 2 or np.any(np.abs(plain / np.median(plain) - 1.0) > _ALIKE):
        return ''
    factor = float(np.median(plain))
    known = (1.0, *_DEGREES)
    if any(abs(factor / one - 1.0) <= _TOLERANCE for one in known):
        return ''
    return (
        f'velocities of all joints that move are {factor:.3g} times what positions do in the '
        f'recorded time: time stamps run {factor:.3g} times as long as it took, and inertias are '
        'off by the square of that, or velocities are in another unit; put right which it is'
    )


def velocity_faults(recording: Recording) -> Iterator[str]:
    """
    Say whose velocities have another unit, or another sign, than what their positions do.

    Yields
    ------
    str
        Joints and what is wrong, without a full stop. Identification takes velocities from the
        positions, so that it may be right all the same.

    """
    found = velocity_ratio(recording)
    if found is None:
        return
    degree = np.deg2rad(1.0)
    for text, ratio in (
        ('are in degrees/s while positions are in rad', 1.0 / degree),
        ('are in rad/s while positions are in degrees', degree),
        ('have the opposite sign of what the positions do', -1.0),
    ):
        relative = found.ratio / ratio
        follows = found.fit * np.sign(ratio) > _FOLLOWS
        off = np.flatnonzero(follows & (relative > 1.0 / _NEAR) & (relative < _NEAR))
        if len(off):
            yield f'velocities of {", ".join(recording.joints[k] for k in off)} {text}'
