# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Checks for faults of the data, before physical causes of a residual are searched.

The checks cover the time base, units, signs, the order of joints, delays and clipped readings. A
fault of the data takes precedence over any effect. `mistakes` finds wrong names, signs and units.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from armid_ros.arm import ArmModel
from armid_ros.effects import CATALOGUE
from armid_ros.errors import IdentificationError
from armid_ros.identification.assess.hypotheses import in_unit
from armid_ros.identification.assess.mistakes import find_mistake, shared_mistakes, slow_motions
from armid_ros.identification.assess.sensor_faults import sensor_faults, units_beyond_drives
from armid_ros.identification.rows.checks import (
    check_motion,
    driven_by_friction,
    joined,
    laws_of_controllers,
    MAX_UNIT_RATIO,
    MIN_CORRELATION,
    SLOW_SHARE,
    torque_factors,
    TORQUE_UNITS,
    unit_of,
)
from armid_ros.identification.rows.regression import Stretch
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt


def check_data(
    arm: ArmModel,
    recordings: Sequence[Recording],
    used: Conditioning,
    data: Sequence[Stretch],
    before: Sequence[Recording] = (),
) -> tuple[list[str], list[str]]:
    """
    Return faults of recordings that prevent a diagnosis, and notes on smaller faults.

    Both contain remedies. `data` are the regression rows of the recordings. The torques of the
    baseline `before` have the unit of the model.

    """
    sensors = list(sensor_faults(arm, recordings, data, used))
    mistaken = [fault.text for fault in sensors if fault.word != 'good']
    alone = not any(one.partner is not None for one in recordings)
    if alone and not mistaken:
        now, then = (slow_motions(some, used) for some in (recordings, before))
        # with a baseline, the comparison with it gives the factor of all torques
        compared = bool(then) and bool(np.any(_torque_ratios(arm, now, then) > 0.0))
        # with a baseline, a mistake that needs a fitted body is a change of the arm instead
        for one, sources in shared_mistakes(arm.body, recordings, used, refit=not then):
            known = compared and one.hypotheses[0].of_masses
            if len(sources) == len(recordings) and one.of_data and not known:
                mistaken = [one.text]
                break
        mistaken = mistaken or unit_faults(arm, now, then)
        mistaken = mistaken or list(units_beyond_drives(arm.robot, recordings, now))
    if mistaken:
        return mistaken, []
    faults = [
        f'{part.source or "recording"}: {law}'
        for part in data
        for law in laws_of_controllers(arm.body, part.motion, part.informative)
    ]
    if alone and not faults:  # another machine that is tied to the arm may drive it
        driven = driven_by_friction(arm.robot, [part.motion for part in data])
        faults += [driven] if driven else []
    notes = [note for one in recordings for note in _limit_notes(arm.robot, one)]
    notes += [*_missing_friction(arm), *(one.text for one in sensors)]
    try:
        notes += check_motion(arm.robot, recordings)
    except IdentificationError as error:
        faults.append(str(error))
    return faults, notes


def mistaken_recordings(
    arm: ArmModel,
    recordings: Sequence[tuple[Recording, npt.NDArray[np.bool_]]],
    used: Conditioning,
    *,
    refit: bool = True,
) -> list[str]:
    """
    Return mistakes in joint names, signs or units of single recordings, with remedies.

    Each recording is paired with a mask of joints, (n,), in which it differs from the other
    recordings. `check_data` finds a mistake that all recordings share. Without `refit`, mistakes
    that only fitted links reveal are not returned.

    """
    found = []
    for recording, joints in recordings:
        mistake = find_mistake(arm.body, recording, used, refit=refit)
        if mistake is not None and joints[mistake.joint] and mistake.of_data:
            found.append(f'{recording.source or "recording"}: {mistake.text}')
    return found


def unit_faults(
    arm: ArmModel, motions: Sequence[Motion], before: Sequence[Motion] = ()
) -> list[str]:
    """
    Return notes on joints whose torques seem to be in another unit than N m.

    If the torque of a joint is mostly friction, as in a wrist, the fitted friction hides a wrong
    unit; see `mistakes`. A model with known friction, or a baseline, reveals the unit. Errors of
    the model's masses are the same in the baseline and cancel. Without a baseline, factors of most
    joints may be due to wrong masses of the model and are no fault.

    """
    factors, robot = _torque_ratios(arm, motions, before), arm.robot
    found = [
        in_unit(robot, joint, unit).text
        for joint, factor in enumerate(factors)
        for unit, per in TORQUE_UNITS.items()
        if per / MAX_UNIT_RATIO < factor < per * MAX_UNIT_RATIO
    ]
    if 2 * len(found) <= robot.n_joints and found:
        return found
    clear = np.flatnonzero(factors > 0.0).tolist()
    if not before or len(clear) < min(2, robot.n_joints):
        return []
    typical = float(np.median(factors[clear]))
    # errors of masses cancel in factors since a baseline: a unit is found within 5 % of its factor
    unit = unit_of(typical, factors[clear].tolist(), 1.05)
    if not unit and 1.0 / 4.0 < typical < 4.0:  # loads cause such factors
        return []
    named = ', '.join(f'{factors[k]:.3g} in {robot.joints[k]}' for k in clear)
    gains = ','.join(f'{1.0 / factor:.3g}' if factor > 0.0 else '?' for factor in factors)
    remedy = (
        f'the recording is in {unit}, if the baseline is in N m: convert the torques'
        if unit
        else 'one of the two is not in N m (currents? drivers change their unit with their '
        f'version): convert each joint by its own gain, as with --current-gain {gains}'
    )
    return [f'torques over those of the baseline: {named}; {remedy}']


def _torque_ratios(
    arm: ArmModel, motions: Sequence[Motion], before: Sequence[Motion]
) -> FloatArray:
    """Return each joint's ratio of measured to modelled torque; 0 if unknown."""
    best, factors = np.full((2, arm.robot.n_joints), 0.0)
    if not motions:
        return factors
    # first the rigid body, with fitted friction and offset; then the model with its own friction
    for model in (ArmModel(arm.body), arm):
        slope, correlation = torque_factors(model, motions)
        if before:
            then, follows = torque_factors(model, before)
            # the error of an undetermined model exceeds the baseline's torque; rows at rest are
            # included, as friction holds a joint with no more torque
            old = joined(before)
            assert old.tau is not None
            speed, expected = np.abs(old.dq), np.concatenate([model.torque(x) for x in before])
            size = np.mean(old.tau**2, axis=0, where=speed >= SLOW_SHARE * speed.max(axis=0))
            off = np.mean(np.square(old.tau - then * expected), axis=0)
            known = (then > 0.0) & (off < size)
            slope = np.where(known, slope / np.where(known, then, 1.0), 0.0)
            correlation = np.minimum(correlation, follows)
        better = (correlation > np.maximum(best, MIN_CORRELATION)) & (slope > 0.0)
        best = np.where(better, correlation, best)
        factors = np.where(better, slope, factors)
    return factors


def _missing_friction(arm: ArmModel) -> list[str]:
    """Return a note if the model lacks friction that the URDF states; otherwise an empty list."""
    robot = arm.robot
    there = {(effect.name, joint) for effect in arm.effects for joint in effect.joints}
    kinds = [kind for kind in CATALOGUE.values() if kind.traits.urdf_attribute]
    stated = [
        joint
        for k, joint in enumerate(robot.joints)
        if any(
            getattr(robot, f'urdf_{kind.traits.urdf_attribute}')[k] > 0.0
            and (kind.name, joint) not in there
            for kind in kinds
        )
    ]
    if not stated:
        return []
    where = ', '.join(stated) if len(stated) < 4 else f'{len(stated)} joints'
    return [
        f'friction in <dynamics> of the description is not in the model ({where}); '
        'use a model with friction'
    ]


def _limit_notes(robot: Robot, recording: Recording) -> Iterator[str]:
    """Yield notes on joints whose torque saturates or exceeds the drive's limit."""
    if recording.tau is None:
        return
    source = recording.source or 'recording'
    limits = np.where(robot.torque_limit > 0.0, robot.torque_limit, np.inf)
    for j, (joint, limit) in enumerate(zip(robot.joints, limits, strict=True)):
        reading, unit = recording.tau[:, j], robot.torque_units[j]
        top = np.abs(reading).max()
        share = float(np.mean(np.abs(reading) >= top * (1.0 - 1e-9)))
        if top > 0.0 and share > 0.02 and len(np.unique(reading)) > 10:  # the reading is clipped
            yield (
                f'{source}: {100 * share:.0f} % of the torques of {joint} are at the largest '
                f'value, {top:.4g} {unit}, which seems to be a limit'
            )
        if top > 1.5 * limit:
            yield (
                f'{source}: the torque of {joint} reaches {top:.4g} {unit}, but its described '
                f'limit is {limit:.4g} {unit}'
            )
