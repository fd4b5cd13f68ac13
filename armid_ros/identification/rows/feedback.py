# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Torques that follow a control law instead of the dynamics of the arm.

Gravity compensation outputs the weight of the arm while a hand moves it; energy shaping outputs a
constant torque in the direction of motion. Such a torque is a function of position and direction
alone and does not contain the torque of inertia. A fit then attributes everything to friction,
or finds an arm without mass.

"""

from __future__ import annotations

from armid_ros.identification.rows.regression import REST_SPEED
from armid_ros.model import inverse_dynamics, regressor
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
from scipy.ndimage import maximum_filter1d


def laws_of_controllers(
    robot: Robot, motion: Motion, informative: npt.NDArray[np.bool_]
) -> tuple[str, ...]:
    """
    Return messages if the torque of every driven joint is a law of position and direction alone.

    If only some joints follow such a law, the model lacks their inertia instead. There is no
    result if the motion is too short to test most joints.

    Parameters
    ----------
    robot : Robot
        The arm.
    motion : Motion
        Filtered motion with the torque filtered alike, R samples of n joints.
    informative : ndarray of bool, shape (R, n)
        False where a joint is at rest.

    Returns
    -------
    tuple of str
        A sentence for each such joint, with the remedy; none if any driven joint obeys no law, or
        if at least as many joints cannot be tested.

    """
    # rows where a joint reverses, and three on either side, which filters smear
    speed = np.abs(motion.dq)
    slow = speed <= REST_SPEED * speed.max(axis=0, initial=0.0)
    slow[1:] |= np.diff(np.sign(motion.dq), axis=0) != 0
    smeared = maximum_filter1d(slow, 7, axis=0, mode='constant')
    # 5000 rows are about sixty for every value of seven joints
    some = slice(None, None, max(1, len(motion) // 5000))
    informative = (informative & ~smeared)[some]
    motion = motion.select(some)
    assert motion.tau is not None
    weight, needed = regressor(robot, motion.at_rest()), inverse_dynamics(robot, motion)
    laws: list[str] = []
    silent = 0
    for joint, (name, unit) in enumerate(zip(robot.joints, robot.torque_units, strict=True)):
        rows = informative[:, joint]
        tau = motion.tau[rows, joint]
        direction = np.sign(motion.dq[rows, joint])
        law = np.column_stack([weight[rows, joint], direction, np.ones_like(tau)])
        left, lacking = (
            _residual_rms(law, torque[rows, joint]) for torque in (motion.tau, needed)
        )
        if left is None or lacking is None:
            silent += 1
            continue
        size = float(np.sqrt(np.mean(tau**2)))
        # smallest torque of a driven joint as a share of the torque of the model. With less, the
        # joint swings freely, or the model is wrong.
        if size < 0.5 * float(np.sqrt(np.mean(needed[rows, joint] ** 2))):
            continue
        # largest residual of a law as a share of the torque: friction of a real joint depends on
        # speed, so it differs by more from a law without speed; and over the torque that the
        # model needs in addition to the law: no model has an inertia that is ten times too large
        if left > 0.03 * size or left > 0.1 * lacking:
            return ()
        laws.append(
            f'the torque of {name} is a law of position and direction of motion alone, to '
            f'{100 * left / size:.1f} %. A controller that holds the weight or pushes along '
            f'makes such a torque. The {lacking:.2g} {unit} of the inertia are missing in it. '
            'Something else moves the arm, or body and friction cannot be distinguished: record '
            'the arm while it follows a trajectory'
        )
    return tuple(laws) if len(laws) > silent else ()


def _residual_rms(law: FloatArray, torque: FloatArray) -> float | None:
    """Return the RMS residual of a torque after the fit of a law; None with too few rows."""
    rank = int(np.linalg.matrix_rank(law)) if len(law) else 0
    # with fewer rows, any torque fits
    if len(law) < 10 * max(rank, 1):
        return None
    return float(np.sqrt(np.sum(residual_of_fit(torque, law) ** 2) / (len(law) - rank)))


def residual_of_fit(values: FloatArray, columns: FloatArray) -> FloatArray:
    """Return the residual of a least-squares fit of values by columns, shape (N, ...)."""
    return np.asarray(values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0])
