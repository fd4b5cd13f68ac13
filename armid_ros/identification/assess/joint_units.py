# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Torques in another unit than N m, where the described body does not show it.

A joint whose torque is mostly friction, as that of a wrist, fits as well in any unit, for its
friction is free; see `mistakes`. The limit of its drive shows it, or a model with its friction,
or a baseline: masses that a model has wrong are wrong on both days.

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

#: Median factor of torques from which they are in other units: a load that is put down makes less.
_GAINS = 4.0
#: Half of the readings of a joint at so many times the limit of its drive are in another unit: the
#: smallest factor of one is a hundred, of which this is half in the logarithm, and no drive gives
#: as much.
_BEYOND_DRIVE = 10.0
#: A factor since a baseline is that of a unit of force within this factor: masses cancel.
_NEAR_SINCE = 1.05


def units_beyond_drives(
    robot: Robot, recordings: Sequence[Recording], motions: Sequence[Motion]
) -> Iterator[str]:
    """
    Yield notes on torques in another unit, by the limits of the drives.

    Where most joints are beyond their limits, or the described body needs as much, it is
    the limits of the description that are wrong.

    Parameters
    ----------
    robot : Robot
        The description.
    recordings : sequence of Recording
        The data.
    motions : sequence of Motion
        Their filtered motions.

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
        The same from when nothing was wrong: factors are those since then. Without it, factors
        of most joints may be of masses that the model has wrong, and no fault.

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

    A model is off by less than the torque of a baseline itself, times the factor, or it gives
    none: a motion that does not determine a model shows its errors there. Rows at rest count:
    friction holds a joint with any torque up to that of its motion, and no more.

    Returns
    -------
    ndarray, shape (n,)
        Zero where a torque does not follow the model clearly.

    """
    best, factors = np.full((2, arm.robot.n_joints), 0.0)
    if not motions:
        return factors
    # the body with friction and offset of the data, and the model with its own friction
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
