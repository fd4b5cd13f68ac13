# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the search for a shape starts, as far as what is left of the torque can tell."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from armid_ros.diagnosis.data.evidence import Trajectory
from armid_ros.diagnosis.data.rows import row_weights
from armid_ros.diagnosis.search.fit import Fitted
from armid_ros.effects import Effect
from armid_ros.effects.interaction import InterfaceSlack
from armid_ros.model import LinkFrames
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Orders of a ripple that go on to be compared, of how many likely ones that are looked at finely,
#: and between which orders [1/rad]: below, it is gravity and springs; above, filters take it away.
_MOST_PEAKS, _LIKELY, _FINER, _ORDERS = 3, 12, 8, (3.0, 80.0)
#: Anchors of straps that are tried: how far from the middle of where the attachment comes to, over
#: the spread of that, in all directions of a cube. Slacks are quantiles of the length.
_DISTANCES, _SLACKS = (0.0, 0.7, 1.5, 3.0), (0.0, 0.2, 0.4, 0.6, 0.8)
#: Straps that go on to be compared with other causes; rows that are looked at.
_STRAPS, _ROWS = 2, 400


def shape_starts(
    effect: Effect,
    fitted: Fitted,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
) -> tuple[FloatArray, ...]:
    """
    Return values of every shape to start from, each of shape (number of owners, G).

    Parameters
    ----------
    effect : Effect
        The effect on all its joints.
    fitted : Fitted
        The arm without it, what that leaves, and the columns of what is fitted anew beside it.
    data : sequence of Trajectory
        The data.
    sigma : sequence of ndarray, shape (n,)
        Noise of each trajectory [N m].

    """
    if effect.name == 'torque_ripple':
        return (_orders(effect, fitted, data, sigma),)
    if isinstance(effect, InterfaceSlack) and not effect.anchored:
        return _straps(effect, fitted, data, sigma)
    parts = [part.motion for part in data]
    names = ('q', 'dq', 'ddq', 'tau')
    arrays = (np.concatenate([getattr(part, name) for part in parts]) for name in names)
    whole = Motion(parts[0].joints, np.concatenate([part.t for part in parts]), *arrays)
    return effect.shape_grids(whole, fitted.arm)


def _orders(
    effect: Effect, fitted: Fitted, data: Sequence[Trajectory], sigma: Sequence[FloatArray]
) -> FloatArray:
    """
    Return the orders at which waves over the angle take most of what is left, (owners, K).

    The rows of all trajectories count together, as a ripple has one order and phase in all.

    """
    weight = row_weights(data, sigma)
    left = np.concatenate(fitted.residual) * weight
    q = np.concatenate([part.motion.q[part.rows] for part in data])
    starts = []
    for joint in effect.indices(fitted.arm.robot.joints):
        rows = weight[:, joint] > 0.0
        if not rows.any():
            starts.append(np.full(_MOST_PEAKS, _ORDERS[0]))
            continue
        angle, rest, scale = q[rows, joint], left[rows, joint], weight[rows, joint]
        step = 0.5 * np.pi / max(float(np.ptp(angle)), 0.1)
        orders = np.arange(_ORDERS[0], _ORDERS[1], step)
        gain = wave_gains(angle, rest, scale, orders)
        padded = np.concatenate([[0.0], gain, [0.0]])
        peaks = np.flatnonzero((gain >= padded[:-2]) & (gain > padded[2:]))
        likely = orders[peaks[np.argsort(-gain[peaks])[:_LIKELY]]]
        likely = likely if len(likely) else orders[:1]
        fine = likely[:, np.newaxis] + step * np.linspace(-1.0, 1.0, 2 * _FINER + 1)
        gain = wave_gains(angle, rest, scale, fine.ravel()).reshape(fine.shape)
        best = np.argsort(-gain.max(axis=1))[:_MOST_PEAKS]
        starts.append(np.resize(fine[best, np.argmax(gain[best], axis=1)], _MOST_PEAKS))
    return np.array(starts)


def wave_gains(
    angle: FloatArray, rest: FloatArray, weight: FloatArray, orders: FloatArray
) -> FloatArray:
    """
    Return what a sine and cosine of each order take of the squares of a weighted rest, (K,).

    Few cycles of a wave leak into each other; least squares tell them apart where the height of
    a spectrum does not.

    """
    wave = np.exp(1j * np.outer(orders, angle))
    aim, twice, count = wave @ (weight * rest), wave**2 @ weight**2, np.sum(weight**2)
    cosines, sines, mixed = count + twice.real, count - twice.real, twice.imag
    determinant = np.maximum(cosines * sines - mixed**2, 1e-6 * count**2)
    squares = sines * aim.real**2 - 2.0 * mixed * aim.real * aim.imag + cosines * aim.imag**2
    return np.asarray(2.0 * squares / determinant)


def _straps(
    effect: InterfaceSlack,
    fitted: Fitted,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
) -> tuple[FloatArray, ...]:
    """Return the anchors and slacks that take most of what is left, beside what is free."""
    left = np.concatenate(fitted.residual)
    q = np.concatenate([part.motion.q[part.rows] for part in data])
    rows = np.unique(np.linspace(0, len(q) - 1, _ROWS).astype(int))
    weight = row_weights(data, sigma)[rows]
    beside = np.concatenate(fitted.columns)[rows] * weight[:, :, np.newaxis]
    basis, _ = np.linalg.qr(beside.reshape(weight.size, -1))

    def rest(values: FloatArray) -> FloatArray:
        flat = (values * weight.reshape(*weight.shape, *[1] * (values.ndim - 2))).reshape(
            weight.size, -1
        )
        return np.asarray(flat - basis @ (basis.T @ flat))

    target = rest(left[rows])[:, 0]
    starts, frames = [], LinkFrames.of(fitted.arm.robot, q[rows])
    for owner, joint in enumerate(effect.joints):
        shape = effect.shape_values[owner]
        single = InterfaceSlack((joint,), tuple(shape.tolist()))
        anchors, slacks = _proposals(frames.places(joint, shape[:3]))
        columns = rest(single.columns_of_straps(frames, anchors, slacks))
        own, aim = np.sum(columns**2, axis=0), columns.T @ target
        gain = np.maximum(aim, 0.0) ** 2 / np.maximum(own, max(1e-12 * own.max(), 1e-300))
        best = np.argsort(-gain)[:_STRAPS]
        starts.append([(*shape[:3], *anchors[k], slacks[k]) for k in best])
    return tuple(np.array(starts).transpose(2, 0, 1))


def _proposals(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return anchors (A, 3) and slacks (A,) around where an attachment comes to."""
    middle, spread = places.mean(axis=0), float(places.std(axis=0).max())
    ways = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    around = [middle + d * spread * ways for d in _DISTANCES if d]
    anchors = np.concatenate([middle[np.newaxis], *around])
    lengths = np.linalg.norm(places - anchors[:, np.newaxis], axis=2)
    slacks = np.quantile(lengths, _SLACKS, axis=1).T * (np.array(_SLACKS) > 0.0)
    return np.repeat(anchors, len(_SLACKS), axis=0), slacks.ravel()
