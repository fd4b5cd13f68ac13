# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Joints by name, in whatever order a message has them."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.errors import RecordingError
import numpy as np
import numpy.typing as npt


def joint_places(joints: Sequence[str], names: Sequence[str]) -> npt.NDArray[np.intp]:
    """
    Return the positions of wanted joints among the names of a message; others are left out.

    Parameters
    ----------
    joints : sequence of str
        The joints that are wanted, in the order that is wanted.
    names : sequence of str
        Joint names of the message, such as JointState.name.

    Returns
    -------
    ndarray of int, shape (n,)
        ``position[indices]`` is in the order that is wanted.

    Raises
    ------
    RecordingError
        If joints are missing or named twice; the message lists them.

    """
    missing = [joint for joint in joints if joint not in names]
    if missing:
        raise RecordingError(
            f'joint states without {", ".join(missing)}; they name '
            f'{", ".join(names) or "no joints"}'
        )
    twice = [joint for joint in joints if list(names).count(joint) > 1]
    if twice:
        raise RecordingError(f'joint states name {", ".join(twice)} twice')
    return np.array([list(names).index(joint) for joint in joints], dtype=np.intp)
