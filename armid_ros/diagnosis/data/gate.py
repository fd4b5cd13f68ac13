# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Data first: time base, units, signs, order of joints, delay and clipped readings.

A fault of the data explains any gap and no physics should be blamed for it. Every test compares
torques with those of the model, joint by joint, with friction and offset taken out.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import product

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.dead_channels import dead_channels
from armid_ros.diagnosis.data.evidence import Trajectory
from armid_ros.effects import CATALOGUE, Effect
from armid_ros.errors import IdentificationError
from armid_ros.identification.assess.hypotheses import Exchanged, InDegrees, Reversed
from armid_ros.identification.assess.mistakes import find_mistake
from armid_ros.identification.rows.checks import (
    check_motion,
    driven_by_friction,
    wrong_sign,
)
from armid_ros.identification.rows.feedback import laws_of_controllers
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np

#: Mistakes that are of the data and of nothing that may happen to an arm.
_OF_DATA = Exchanged | InDegrees | Reversed
#: A torque follows the model of its own joint when this much of it is the model's ...
_FOLLOWS = 0.9
#: Two joints are exchanged when each one's torque is this near to the other's model, and less than
#: half as far from it as from its own.
_ALIKE = 0.6
_UNITS = (
    (57.2958, 'a gain of 57.3: degrees against radians'),
    (1000.0, 'N mm instead of N m'),
    (0.001, 'kN m instead of N m'),
)
#: A torque of so many times the limit of its drive is said.
_BEYOND = 1.5
#: Share of samples at the very extreme of a reading, above which it is clipped.
_CLIPPED = 0.02
#: A step of a position at this multiple of the highest velocity is none of the arm.
_IMPOSSIBLE = 10.0
#: Share of steps in time that differ from the median by more than half of it.
_UNEVEN = 0.05
#: Jitter of stamps that blurs a torque at the end of the band by less than this share of it is
#: harmless.
_BLURRED = 0.1


def check_data(
    arm: ArmModel,
    recordings: Sequence[Recording],
    used: Conditioning,
    data: Sequence[Trajectory],
) -> tuple[list[str], list[str]]:
    """
    Look for faults of the data.

    Returns
    -------
    faults : list of str
        What makes a diagnosis meaningless, in words, with the remedy.
    notes : list of str
        What a reader should know.

    """
    slopes, correlation = _compare(_as_it_may_be(arm, data), data)
    mistaken = _mistaken(arm, recordings, used)
    if mistaken:
        return mistaken, []
    faults = [*_time_base(recordings, _band(data)), *_torques(arm, slopes, correlation)]
    faults += _laws(arm, data)
    for recording in recordings:
        faults += [*_jumps(arm.robot, recording), *dead_channels(arm, recording, data)]
    faults += [] if faults else _signs(arm, recordings, data)
    notes = [*_clipped(recordings), *_beyond_limits(arm.robot, recordings)]
    notes += _described_friction(arm)
    try:
        notes += check_motion(arm.robot, recordings, used)
    except IdentificationError as error:
        faults.append(str(error))
    return faults, notes


def _as_it_may_be(arm: ArmModel, data: Sequence[Trajectory]) -> ArmModel:
    """
    Return an arm under the gravity, or with the load, that explains torques better than a fault.

    An arm that hangs takes the opposite torques of one that stands, but for its inertia, and one
    that carries a load takes many times the torque in a wrist. Other units or exchanged joints
    make torques that some gravity or some load explains in part.

    """
    bare = ArmModel(arm.robot, quasi_static=arm.quasi_static)
    left = np.concatenate([part.residual(bare) for part in data])
    torque = left + np.concatenate([part.reduce(bare.torque(part.motion)) for part in data])
    scale = np.maximum(np.sqrt(np.mean(torque**2, axis=0)), 1e-12)
    repaired = _repaired(torque / scale, (torque - left) / scale, scale)
    least, best = min(repaired, 0.5 * float(np.sum((left / scale) ** 2))), bare
    for columns, changed in _changes(bare, data):
        flat = (columns / scale[:, np.newaxis]).reshape(-1, columns.shape[2])
        values = np.linalg.lstsq(flat, (left / scale).ravel(), rcond=1e-6)[0]
        after = float(np.sum(((left - columns @ values) / scale) ** 2))
        other = changed(values)
        if after < least and other is not None:
            least, best = after, other
    return best


def _signs(
    arm: ArmModel, recordings: Sequence[Recording], data: Sequence[Trajectory]
) -> list[str]:
    """Say whose friction drives; another machine that an arm is tied to may drive it."""
    if any(one.partner is not None for one in recordings):
        return []
    motions, torques = [part.at_rows for part in data], [part.torque for part in data]
    driven = driven_by_friction(arm.robot, motions, torques)
    return [wrong_sign(driven)] if driven else []


def _mistaken(arm: ArmModel, recordings: Sequence[Recording], used: Conditioning) -> list[str]:
    """Say what every recording shows to be wrong with it: names, signs or units of joints."""
    if any(one.partner is not None for one in recordings):
        return []
    said: set[tuple[str, ...]] = set()
    for recording in recordings:
        mistake = find_mistake(arm.body, recording, used)
        if mistake is None or not all(isinstance(h, _OF_DATA) for h in mistake.hypotheses):
            return []
        said.add(tuple(one.sentence(arm.robot) for one in mistake.hypotheses))
    return [', or '.join(said.pop())] if len(said) == 1 else []


def _jumps(robot: Robot, recording: Recording) -> Iterator[str]:
    """Say where positions first step faster than a joint can move."""
    time = np.maximum(np.diff(recording.t), recording.period)[:, np.newaxis]
    known = np.isfinite(robot.velocity_limit) & (robot.velocity_limit > 0.0)
    limit = np.where(known, _IMPOSSIBLE * robot.velocity_limit, np.inf)
    at = np.argwhere(np.abs(np.diff(recording.q, axis=0)) > limit * time)
    if len(at):
        row, joint = at[0]
        step = recording.q[row + 1, joint] - recording.q[row, joint]
        yield (
            f'in {recording.source or "a recording"} the position of {robot.joints[joint]} jumps '
            f'by {step:.3g} at {recording.t[row + 1]:.3f} s: leave out what is faulty'
        )


_Change = Callable[[FloatArray], ArmModel | None]


def _changes(bare: ArmModel, data: Sequence[Trajectory]) -> Iterator[tuple[FloatArray, _Change]]:
    """Yield columns, and the arm that values of them make; None where no arm is like that."""

    def falling(change: FloatArray) -> ArmModel:
        return ArmModel(
            bare.robot.with_gravity(bare.robot.gravity + change), quasi_static=bare.quasi_static
        )

    yield np.concatenate([p.reduce(bare.gravity_columns(p.motion)) for p in data]), falling
    for kind in CATALOGUE.values():
        if kind.comes_and_goes:
            load = kind.on(bare.robot)
            rows = [part.columns(bare, load) for part in data]
            yield np.concatenate(rows), partial(_loaded, bare, load)


def _loaded(bare: ArmModel, load: Effect, values: FloatArray) -> ArmModel | None:
    """Return an arm with a load; None if it could not be one, or is more than an arm carries."""
    possible = bool(0.0 < values[0] < load.spread(bare.robot)[0])
    possible = possible and load.plausible(values, np.zeros_like(values), bare)
    return bare.with_effect(load, values) if possible else None


def _repaired(torque: FloatArray, model: FloatArray, scale: FloatArray) -> float:
    """Return the squares left where each joint has another one's torque, sign or unit, (N, n)."""
    factors = [1.0, *(factor for factor, _ in _UNITS)]
    best = np.full(len(scale), np.inf)
    for joint, other in product(range(len(scale)), repeat=2):
        taken = model[:, other] * scale[other] / scale[joint]
        for factor in (sign * size for size in factors for sign in (1.0, -1.0)):
            best[joint] = min(best[joint], np.sum((torque[:, joint] - factor * taken) ** 2))
    return float(best.sum())


def _band(data: Sequence[Trajectory]) -> float:
    """Return up to which frequency rows hold motion [Hz]."""
    return min(data[0].used.kept_hz, *(part.motion.band_hz for part in data))


def _time_base(recordings: Sequence[Recording], band_hz: float) -> list[str]:
    faults = []
    for recording in recordings:
        steps = np.diff(recording.t)
        median = float(np.median(steps))
        uneven = float(np.mean(np.abs(steps - median) > 0.5 * median))
        jitter = float(np.sqrt(np.mean(np.minimum(np.abs(steps - median), median) ** 2)))
        if uneven > _UNEVEN and 2.0 * np.pi * band_hz * jitter > _BLURRED:
            faults.append(
                f'{recording.source or "recording"}: {100 * uneven:.0f} % of the time stamps are '
                'uneven by more than half a period; record with the stamps of the driver'
            )
    return faults


def _torques(arm: ArmModel, slopes: FloatArray, correlation: FloatArray) -> list[str]:
    joints = arm.robot.joints
    faults = []
    own = np.diag(correlation)
    error = _unlike(slopes, correlation)
    for j, joint in enumerate(joints):
        best = int(np.argmin(error[j]))
        pair = error[j, best], error[best, j]
        nearer = pair[0] < error[j, j] / 2 and pair[1] < error[best, best] / 2
        if best != j and max(pair) < _ALIKE and nearer:
            faults.append(
                f'the torque of {joint} follows what the model has for {joints[best]}: are the '
                'joints in the right order?'
            )
        elif own[j] < -_FOLLOWS:
            faults.append(
                f'the torque of {joint} has the opposite sign of what the model takes; effort has '
                'to be positive along the URDF joint axis: negate it'
            )
        elif own[j] > _FOLLOWS:
            for factor, unit in _UNITS:
                if factor / 1.5 < slopes[j, j] < factor * 1.5:
                    faults.append(
                        f'the torque of {joint} is {slopes[j, j]:.3g} times what the model '
                        f'takes, {unit}: convert it'
                    )
    return faults


def _described_friction(arm: ArmModel) -> list[str]:
    """Say that a description states friction that the model does not have."""
    robot = arm.robot
    there = {(effect.name, joint) for effect in arm.effects for joint in effect.joints}
    stated = [
        joint
        for k, joint in enumerate(robot.joints)
        if any(
            getattr(robot, f'urdf_{kind.urdf_attribute}')[k] > 0.0
            and (kind.name, joint) not in there
            for kind in CATALOGUE.values()
            if kind.urdf_attribute
        )
    ]
    if not stated:
        return []
    return [
        f'the description states friction of {", ".join(stated)} in <dynamics>, which the model '
        'does not have: it is looked for like any other; give a model that has it'
    ]


def _laws(arm: ArmModel, data: Sequence[Trajectory]) -> Iterator[str]:
    for part in data:
        rows = part.at_rows.with_torque(part.torque)
        for law in laws_of_controllers(arm.body, rows, part.informative):
            yield f'{part.source or "recording"}: {law}'


def _unlike(slopes: FloatArray, correlation: FloatArray) -> FloatArray:
    """Return |tau_i - model_j| / |tau_i| of all joints, shape (n, n); 1 for no likeness."""
    safe = np.where(slopes == 0.0, np.inf, slopes)
    square = 1.0 - 2.0 * correlation**2 / safe + (correlation / safe) ** 2
    return np.asarray(np.sqrt(np.maximum(square, 0.0)))


def _clipped(recordings: Sequence[Recording]) -> list[str]:
    notes = []
    for recording in recordings:
        if recording.tau is None:
            continue
        for j, joint in enumerate(recording.joints):
            reading = recording.tau[:, j]
            top = np.abs(reading).max()
            share = float(np.mean(np.abs(reading) >= top * (1.0 - 1e-9)))
            if top > 0.0 and share > _CLIPPED and len(np.unique(reading)) > 10:
                notes.append(
                    f'{recording.source or "recording"}: {100 * share:.0f} % of the torque of '
                    f'{joint} is at {top:.4g}, its highest value: a limit'
                )
    return notes


def _beyond_limits(robot: Robot, recordings: Sequence[Recording]) -> Iterator[str]:
    """Say where a torque is beyond what the description lets a drive give."""
    limit = np.where(robot.torque_limit > 0.0, robot.torque_limit, np.inf)
    for recording in recordings:
        if recording.tau is None:
            continue
        largest = np.max(np.abs(recording.tau), axis=0)
        for j in np.flatnonzero(largest > _BEYOND * limit).tolist():
            yield (
                f'{recording.source or "recording"}: the torque of {robot.joints[j]} reaches '
                f'{largest[j]:.4g}, its limit is {limit[j]:.4g}'
            )


def _compare(arm: ArmModel, data: Sequence[Trajectory]) -> tuple[FloatArray, FloatArray]:
    """
    Regress torques on the model's, with constant, velocity and its sign taken out.

    Returns
    -------
    slopes : ndarray, shape (n, n)
        Measured torque of each joint (row) on the model's of each (column).
    correlation : ndarray, shape (n, n)
        The correlations that go with them.

    """
    n = arm.robot.n_joints
    slopes, correlation = np.zeros((2, n, n))
    measured = np.concatenate([part.residual(arm) for part in data])
    load = np.concatenate([part.reduce(arm.torque(part.motion)) for part in data])
    measured = measured + load
    dq = np.concatenate([part.motion.dq[part.rows] for part in data])
    for i in range(n):
        nuisance = np.column_stack([np.ones(len(dq)), dq[:, i], np.sign(dq[:, i])])
        both = np.column_stack([load, measured[:, i]])
        rest = both - nuisance @ np.linalg.lstsq(nuisance, both, rcond=None)[0]
        target = rest[:, n]
        for j in range(n):
            size = float(rest[:, j] @ rest[:, j])
            product = float(rest[:, j] @ target)
            norm = np.sqrt(size * float(target @ target))
            if norm > 0.0:
                slopes[i, j], correlation[i, j] = product / size, product / norm
    return slopes, correlation
