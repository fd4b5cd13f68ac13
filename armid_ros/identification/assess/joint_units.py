# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Detection of torques in another unit than N m where the described body does not reveal it.

A joint whose torque is mostly friction, such as a wrist, fits as well in any unit, as its friction
is fitted; see `mistakes`. The unit follows from the limit of its drive, from a model with its
friction, or from a baseline. Wrong masses of a model are wrong on both days and cancel.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from armid_ros.arm import ArmModel
from armid_ros.identification.assess.hypotheses import in_unit
from armid_ros.identification.assess.prediction_error import SLOW
from armid_ros.identification.rows.checks import (
    FOLLOWS,
    NEAR,
    torque_factors,
    TORQUE_UNITS,
    units_near,
)
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

#: Median factor of torques from which they are in other units; putting down a load makes less.
_GAINS = 4.0
#: Ratio of the median reading of a joint to the limit of its drive from which it is in another
#: unit. The smallest factor of a unit is a hundred, of which this is half in the logarithm, and no
#: drive gives as much.
_BEYOND_DRIVE = 10.0
#: Largest ratio of a factor since a baseline to that of a unit of force: masses cancel.
_NEAR_SINCE = 1.05


def units_beyond_drives(
    robot: Robot, recordings: Sequence[Recording], motions: Sequence[Motion]
) -> Iterator[str]:
    """
    Yield notes on torques in another unit, by the limits of the drives.

    No note is given if most joints are beyond their limits, or if the described body needs as
    much: then the limits of the description are wrong.

    Parameters
    ----------
    robot : Robot
        Robot of the description.
    recordings : sequence of Recording
        Recordings to check.
    motions : sequence of Motion
        Filtered motions of the recordings.

    """
    measured = [recording.tau for recording in recordings if recording.tau is not None]
    if not measured or not motions:
        return
    usual = np.median(np.abs(np.concatenate(measured)), axis=0)
    known = np.isfinite(robot.torque_limit) & (robot.torque_limit > 0.0)
    beyond = known & (usual > _BEYOND_DRIVE * robot.torque_limit)
    if 2 * np.sum(beyond) > np.sum(known):
        return
    needed = np.max([np.abs(inverse_dynamics(robot, one)).max(axis=0) for one in motions], axis=0)
    for joint in np.flatnonzero(beyond & (needed < robot.torque_limit)).tolist():
        limit, unit = robot.torque_limit[joint], robot.torque_units[joint]
        yield (
            f'the torque of {robot.joints[joint]} seems to be in another unit than {unit}: '
            f'half of its readings are beyond {usual[joint]:.3g}, its drive gives '
            f'{limit:.4g} {unit}. Convert it, or correct the limit in the description'
        )


def unit_faults(
    arm: ArmModel, motions: Sequence[Motion], before: Sequence[Motion] = ()
) -> list[str]:
    """
    Return notes on the unit of torques, by a model with friction or by a baseline.

    Parameters
    ----------
    arm : ArmModel
        The model.
    motions : sequence of Motion
        Filtered motions with torque.
    before : sequence of Motion
        Filtered motions of a baseline, to which factors are relative. Without it, factors of
        most joints may be due to wrong masses of the model and are no fault.

    """
    factors, robot = factors_since(arm, motions, before), arm.robot
    found = [
        in_unit(robot, joint, unit).text
        for joint, factor in enumerate(factors)
        for unit, per in TORQUE_UNITS.items()
        if per / NEAR < factor < per * NEAR
    ]
    if 2 * len(found) <= robot.n_joints and found:
        return found
    clear = np.flatnonzero(factors > 0.0).tolist()
    if not before or len(clear) < min(2, robot.n_joints):
        return []
    typical = float(np.median(factors[clear]))
    units = set(units_near(typical)).intersection(
        *(units_near(factors[k], _NEAR_SINCE) for k in clear)
    )
    if not units and 1.0 / _GAINS < typical < _GAINS:
        return []
    named = ', '.join(f'{factors[k]:.3g} in {robot.joints[k]}' for k in clear)
    gains = ','.join(f'{1.0 / factor:.3g}' if factor > 0.0 else '?' for factor in factors)
    remedy = (
        f'{" or ".join(sorted(units))} if those of the baseline are in N m: convert them'
        if units
        else 'other units than N m (currents? drivers change from one to the other with their '
        f'version): convert each joint by its own gain, as with --current-gain {gains}'
    )
    return [f'torques are those of the baseline times {named}: one of the two is in {remedy}']


def factors_since(
    arm: ArmModel, motions: Sequence[Motion], before: Sequence[Motion] = ()
) -> FloatArray:
    """
    Return the ratio of measured to modelled torque, relative to that of a baseline if given.

    A factor is zero if the error of the model on the baseline is larger than the torque itself: a
    motion that does not determine the model reveals its errors there. Rows at rest count, as
    friction holds a joint with no more torque than that of its motion.

    Returns
    -------
    ndarray, shape (n,)
        Zero where a torque does not follow the model clearly.

    """
    best, factors = np.full((2, arm.robot.n_joints), 0.0)
    if not motions:
        return factors
    # first the body, with friction and offset fitted; then the model with its own friction
    for model in (ArmModel(arm.body), arm):
        slope, correlation = _factors(model, motions)
        if before:
            then, follows = _factors(model, before)
            moves, expected, measured = _torques(model, before)
            off = np.mean(np.square(measured - then * expected), axis=0)
            known = (then > 0.0) & (off < np.mean(np.square(measured), axis=0, where=moves))
            slope = np.where(known, slope / np.where(known, then, 1.0), 0.0)
            correlation = np.minimum(correlation, follows)
        better = (correlation > np.maximum(best, FOLLOWS)) & (slope > 0.0)
        best = np.where(better, correlation, best)
        factors = np.where(better, slope, factors)
    return factors


def _factors(arm: ArmModel, motions: Sequence[Motion]) -> tuple[FloatArray, FloatArray]:
    """Return slope and correlation of measured on modelled torques, each (n,)."""
    moves, expected, measured = _torques(arm, motions)
    if not arm.effects:
        torques = [motion.tau for motion in motions if motion.tau is not None]
        return torque_factors(arm.robot, motions, torques)
    x, y = (
        np.where(moves, torque - np.mean(torque, axis=0, where=moves), 0.0)
        for torque in (expected, measured)
    )
    product, own, other = (np.sum(one, axis=0) for one in (x * y, x * x, y * y))
    known = own * other > 0.0
    slope = np.divide(product, own, out=np.zeros_like(own), where=known)
    return slope, np.divide(product, np.sqrt(own * other), out=np.zeros_like(own), where=known)


def _torques(
    arm: ArmModel, motions: Sequence[Motion]
) -> tuple[npt.NDArray[np.bool_], FloatArray, FloatArray]:
    """Return where joints move, modelled torque and measured torque, each (N, n)."""
    speed = np.abs(np.concatenate([motion.dq for motion in motions]))
    expected = np.concatenate([arm.torque(motion) for motion in motions])
    measured = np.concatenate([motion.tau for motion in motions if motion.tau is not None])
    return speed >= SLOW * speed.max(axis=0), expected, measured
