# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Arrangement of the parameters of an effect among those of all joints."""

from __future__ import annotations

from functools import lru_cache

from armid_ros.effects.base import Effect
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt


def joint_columns(effect: Effect, motion: Motion, *quantities: FloatArray) -> FloatArray:
    """
    Return the columns of an effect that acts on each of its joints separately.

    Parameters
    ----------
    effect : Effect
        Effect with the joints.
    motion : Motion
        Motion with the joint order.
    *quantities : ndarray, shape (N, n)
        One array per quantity of the effect: dtau_j / dtheta_j for all joints of the motion.

    Returns
    -------
    ndarray, shape (N, n, P)
        Zero where a parameter belongs to another joint.

    """
    own, places = _flat_places(effect.joints, motion.joints, len(quantities))
    size = len(quantities) * len(own)
    columns = np.zeros((len(motion), motion.n_joints * size))
    for place, values in zip(places, quantities, strict=True):
        columns[:, place] = values[:, own]
    return columns.reshape(len(motion), motion.n_joints, size)


def scatter(effect: Effect, values: FloatArray, robot: Robot) -> FloatArray:
    """
    Spread the values of a joint effect over all joints of the robot, zero elsewhere.

    Returns
    -------
    ndarray, shape (number of quantities, n)

    """
    spread = np.zeros((len(effect.quantities), robot.n_joints))
    spread[:, effect.indices(robot.joints)] = values.reshape(len(effect.joints), -1).T
    return spread


@lru_cache(maxsize=1024)
def _flat_places(
    joints: tuple[str, ...], among: tuple[str, ...], count: int
) -> tuple[npt.NDArray[np.intp], tuple[npt.NDArray[np.intp], ...]]:
    """Return indices of joints, and of the columns of each quantity in a flattened sample."""
    own = np.array([among.index(joint) for joint in joints], dtype=np.intp)
    size = count * len(own)
    return own, tuple(own * size + np.arange(first, size, count) for first in range(count))
