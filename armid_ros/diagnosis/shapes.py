# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the search for a shape starts, as far as what is left of the torque can tell."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from armid_ros.diagnosis.evidence import Trajectory
from armid_ros.diagnosis.fit import Fitted
from armid_ros.effects import Effect
from armid_ros.effects.interaction import InterfaceSlack
from armid_ros.model import points_motion
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Peaks of a spectrum over the angle that are tried, and between which orders [1/rad]: below, it
#: is gravity and springs; above, filters take it away.
_MOST_PEAKS, _ORDERS = 6, (3.0, 80.0)
#: Anchors of straps that are tried: how far from the middle of where the attachment comes to, over
#: the spread of that, in all directions of a cube. Slacks are quantiles of the length.
_DISTANCES, _SLACKS = (0.0, 0.7, 1.5, 3.0), (0.0, 0.2, 0.4, 0.6, 0.8)
#: Straps that go on to be compared with other causes; rows that are looked at.
_STRAPS, _ROWS = 2, 400


def shape_starts(
    effect: Effect, fitted: Fitted, data: Sequence[Trajectory]
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

    """
    if effect.name == 'torque_ripple':
        return (_orders(effect, fitted, data),)
    if isinstance(effect, InterfaceSlack) and effect.anchor is None:
        return _straps(effect, fitted, data)
    parts = [part.motion for part in data]
    names = ('q', 'dq', 'ddq', 'tau')
    arrays = (np.concatenate([getattr(part, name) for part in parts]) for name in names)
    whole = Motion(parts[0].joints, np.concatenate([part.t for part in parts]), *arrays)
    return effect.shape_grids(whole, fitted.arm)


def _orders(effect: Effect, fitted: Fitted, data: Sequence[Trajectory]) -> FloatArray:
    """
    Return the orders at which the residual of all trajectories has its peaks, (owners, K).

    The rows of all trajectories count together, as a ripple has one order and phase in all.

    """
    left = _left(fitted, data)
    q = np.concatenate([part.motion.q[part.rows] for part in data])
    rows = []
    for joint in effect.indices(fitted.arm.robot.joints):
        step = 0.5 * np.pi / max(float(np.ptp(q[:, joint])), 0.1)
        orders = np.arange(_ORDERS[0], _ORDERS[1], step)
        wave = np.exp(-1j * np.outer(orders, q[:, joint]))
        power = np.abs(wave @ (left[:, joint] - left[:, joint].mean())) ** 2
        padded = np.concatenate([[0.0], power, [0.0]])
        peaks = np.flatnonzero((power >= padded[:-2]) & (power > padded[2:]))
        best = peaks[np.argsort(-power[peaks])[:_MOST_PEAKS]]
        rows.append(np.resize(orders[best] if len(best) else orders[:1], _MOST_PEAKS))
    return np.array(rows)


def _left(fitted: Fitted, data: Sequence[Trajectory]) -> FloatArray:
    """Return what is left in all rows that tell something, shape (R, n) [N m]."""
    parts = zip(fitted.residual, data, strict=True)
    return np.concatenate([left * part.told for left, part in parts])


def _straps(
    effect: InterfaceSlack, fitted: Fitted, data: Sequence[Trajectory]
) -> tuple[FloatArray, ...]:
    """Return the anchors and slacks that take most of what is left, beside what is free."""
    robot, left = fitted.arm.robot, _left(fitted, data)
    q = np.concatenate([part.motion.q[part.rows] for part in data])
    told = np.concatenate([part.told for part in data])
    size = np.maximum(np.sqrt(np.mean(left**2, axis=0)), 1e-12)
    rows = np.unique(np.linspace(0, len(q) - 1, _ROWS).astype(int))
    weight = told[rows] / np.maximum(size, 1e-3 * size.max())
    beside = np.concatenate(fitted.columns)[rows] * weight[:, :, np.newaxis]
    basis, _ = np.linalg.qr(beside.reshape(weight.size, -1))

    def rest(values: FloatArray) -> FloatArray:
        flat = (values * weight.reshape(*weight.shape, *[1] * (values.ndim - 2))).reshape(
            weight.size, -1
        )
        return np.asarray(flat - basis @ (basis.T @ flat))

    target = rest(left[rows])[:, 0]
    starts = []
    for owner, joint in enumerate(effect.joints):
        shape = effect.shape_values[owner]
        single = InterfaceSlack((joint,), tuple(shape.tolist()))
        places = points_motion(robot, (joint,), shape[np.newaxis, :3], q[rows])[0][:, 0]
        anchors, slacks = _proposals(places)
        columns = rest(single.columns_of_straps(robot, q[rows], anchors, slacks))
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
    anchors, slacks = [], []
    for anchor in np.concatenate([middle[np.newaxis], *around]):
        lengths = np.linalg.norm(places - anchor, axis=1)
        for share in _SLACKS:
            anchors.append(anchor)
            slacks.append(float(np.quantile(lengths, share)) if share else 0.0)
    return np.array(anchors), np.array(slacks)
