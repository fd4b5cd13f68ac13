# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Torques that are a law of a controller, and not what the arm takes.

Gravity compensation plays the weight of the arm while a hand moves it; energy shaping plays a
constant torque in the direction of motion. Such a torque is a function of position and direction
alone: the inertia of the arm, which acts all the same, is nowhere in it, so that a fit blames
friction, or finds an arm without mass.

"""

from __future__ import annotations

from dataclasses import replace

from armid_ros.model import inverse_dynamics, regressor
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

#: What the law leaves of a torque, over the torque that an arm needs beside it: a model whose
#: inertia is ten times too large does not move an arm.
_WITHOUT_INERTIA = 0.1
#: A law that leaves more than this share of the torque is none; friction of a real joint differs
#: by more from what does not know of its speed.
_FOLLOWS = 0.03
#: A joint whose torque is less than this share of what the arm needs swings freely, or the model
#: is wrong: its equation holds without a drive.
_DRIVEN = 0.5
#: Rows beside a reversal over which filters smear a direction, and the share of its top speed
#: below which a joint may be turning round.
_BESIDE, _TURNING = 3, 0.02
#: Rows per column of a law, below which it follows anything.
_ROWS_PER_COLUMN = 10


def laws_of_controllers(
    robot: Robot, motion: Motion, told: npt.NDArray[np.bool_]
) -> tuple[str, ...]:
    """
    Say that the torque of every joint that is driven is a law of position and direction alone.

    Of a single joint among others it is the model that is wrong: its inertia was not told. Where
    the motion is too short to ask about most joints, a few of them say nothing of a controller.

    Parameters
    ----------
    robot : Robot
        The arm.
    motion : Motion
        Filtered motion with the torque filtered alike, R samples of n joints.
    told : ndarray of bool, shape (R, n)
        False where a joint rests.

    Returns
    -------
    tuple of str
        A sentence for each such joint, with the remedy; none if any of them obeys no law, or as
        many cannot be asked.

    """
    assert motion.tau is not None
    still = np.zeros_like(motion.q)
    weight = regressor(robot, replace(motion, dq=still, ddq=still))
    needed = inverse_dynamics(robot, motion)
    said: list[str] = []
    silent = 0
    for joint, (name, unit) in enumerate(zip(robot.joints, robot.torque_units, strict=True)):
        # where a joint turns round, or filters smear that it does
        dq = motion.dq[:, joint]
        slow = np.abs(dq) <= _TURNING * np.abs(dq).max(initial=0.0)
        slow[1:] |= np.diff(np.sign(dq)) != 0
        beside = np.convolve(slow, np.ones(2 * _BESIDE + 1))
        rows = told[:, joint] & ~(beside[_BESIDE : _BESIDE + len(slow)] > 0.0)
        tau = motion.tau[rows, joint]
        direction = np.sign(motion.dq[rows, joint])
        law = np.column_stack([weight[rows, joint], direction, np.ones_like(tau)])
        left, lacking = (_left(law, torque[rows, joint]) for torque in (motion.tau, needed))
        if left is None or lacking is None:
            silent += 1
            continue
        size = float(np.sqrt(np.mean(tau**2)))
        if size < _DRIVEN * float(np.sqrt(np.mean(needed[rows, joint] ** 2))):
            continue
        if left > _FOLLOWS * size or left > _WITHOUT_INERTIA * lacking:
            return ()
        said.append(
            f'the torque of {name} is a law of position and direction of motion alone, to '
            f'{100 * left / size:.1f} %. It holds the weight or pushes along, as a controller '
            f'commands it, and has nothing of the {lacking:.2g} {unit} that inertia takes. '
            'Something else moves the arm, or body and friction cannot be distinguished: record '
            'the arm while it follows a trajectory'
        )
    return tuple(said) if len(said) > silent else ()


def _left(law: FloatArray, torque: FloatArray) -> float | None:
    """Return the root mean square that a law leaves of a torque; None if it follows anything."""
    rank = int(np.linalg.matrix_rank(law)) if len(law) else 0
    if len(law) < _ROWS_PER_COLUMN * max(rank, 1):
        return None
    rest = torque - law @ np.linalg.lstsq(law, torque, rcond=None)[0]
    return float(np.sqrt(np.sum(rest**2) / (len(law) - rank)))
