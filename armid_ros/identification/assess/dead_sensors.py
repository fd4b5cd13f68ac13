# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Torques and encoders that read the same though their joint moves.

A passive joint and a drive at its limit have a torque that does not change, too: the model takes
next to none of the one, and the other is the highest there is.

A joint may be locked: its reading stays the same, its velocity is zero, and its torque is what
weight and the motion of other joints make of it. A reading that does not change by one count is
dead where the recorded velocity goes on, or where the torque is of a motion that nobody recorded.
Where no velocity is recorded, a joint whose torque is mostly weight that others turn is not told
from a locked one.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from armid_ros.arm import ArmModel
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.assess.prediction_error import left_of_blocks, thinned
from armid_ros.identification.rows.checks import REST_RANGE, SILENT
from armid_ros.identification.rows.row_noise import sensor_noise
from armid_ros.model import inverse_dynamics, regressor
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.recording.series import NOTHING
from armid_ros.robots import Robot
import numpy as np

#: Range of a Brownian bridge over its scale that chance exceeds once in a million (Kuiper 1960).
_WALK = 3.0
#: Rows of which a torque that nobody recorded the motion of is told.
_ROWS = 600
#: Rows in a part of a recording below which nothing is told of its torque, and the share of what
#: a torque varies by while its joint moves that it does while the joint moves unseen.
_LEAST, _LIVELY = 100, 0.5
#: Share of the way of a joint that the integral of a constant speed may miss: clocks and units are
#: off by less, and a joint that turns round misses half of it.
_WAY = 0.1
#: Share of a recording below which a reading that stays the same until its end is a joint that has
#: come to rest.
_PART = 0.2
#: For so long [s], and while the joint goes so far of its way.
_LONG, _FAR = 1.0, 0.2
#: Share of weight or inertia by which what the model takes has to change meanwhile; of a passive
#: joint the two cancel.
_TAKEN = 0.5


def dead_channels(arm: ArmModel, recording: Recording, motions: Sequence[Motion]) -> Iterator[str]:
    """
    Say whose torque stays the same, though the joint moves and takes another one.

    Where it is that of every joint, nobody measured any, and that alone is said.

    Parameters
    ----------
    arm : ArmModel
        What is believed of the arm.
    recording : Recording
        As it was read, with torques.
    motions : sequence of Motion
        Its stretches, filtered.

    Yields
    ------
    str
        Recording, joint, time and remedy, without a full stop.

    """
    assert recording.tau is not None
    if np.all(np.ptp(recording.tau, axis=0) < NOTHING):
        yield f'in {recording.source or "a recording"} {SILENT}'
        return
    units = arm.robot.torque_units
    t, least = recording.t, max(2, round(_LONG / recording.period))
    for j, joint in enumerate(recording.joints):
        reading, q = recording.tau[:, j], recording.q[:, j]
        start, stop = _longest_same(reading, NOTHING)
        moved = float(np.ptp(q[start:stop])) > _FAR * float(np.ptp(q))
        top = float(np.abs(reading).max())
        at_limit = 0.0 < top == abs(reading[start]) and stop - start < len(reading)
        if stop - start < least or not moved or at_limit:
            continue
        if _changes(arm, motions, j, float(t[start]), float(t[stop - 1])):
            when, remedy = _when(t, start, stop, 'record with the joint held still')
            value = f'{reading[start] + 0.0:.4g} {units[j]}'
            yield (
                f'in {recording.source or "a recording"} the torque of {joint} stays at '
                f'{value} {when} while the joint moves: its channel is dead; {remedy}'
            )


def _changes(
    arm: ArmModel, motions: Sequence[Motion], joint: int, start: float, stop: float
) -> bool:
    """Return whether what the model takes of a joint changes between two times."""
    for motion in motions:
        inside = (motion.t >= start) & (motion.t <= stop)
        if np.count_nonzero(inside) < 2:
            continue
        load = arm.load(motion)[inside, joint]
        weight = arm.load(motion.at_rest())[inside, joint]
        largest = max(float(np.std(weight)), float(np.std(load - weight)))
        if float(np.std(load)) > _TAKEN * largest > 0.0:
            return True
    return False


def dead_encoders(
    robot: Robot | None, recording: Recording, motions: Sequence[Motion] = ()
) -> Iterator[str]:
    """
    Say which positions, or velocities, stay the same while their joint moves.

    Parameters
    ----------
    robot : Robot or None
        The description; without one only positions and velocities are compared.
    recording : Recording
        As it was read.
    motions : sequence of Motion
        Its stretches, filtered, with torque; without any the torque is not asked.

    Yields
    ------
    str
        Recording, joint, reading and remedy, without a full stop.

    """
    source = recording.source or 'a recording'
    units = ('rad',) * recording.n_joints if robot is None else robot.position_units
    for j, joint in enumerate(recording.joints):
        unit = units[j]
        q = recording.q[:, j]
        start, stop = _longest_same(q)
        # a step of the encoder, and as much as a joint at rest goes
        steps = np.abs(np.diff(q))
        hidden = REST_RANGE + (float(steps[steps > 0.0].min()) if steps.any() else 0.0)
        goes = _distance(recording, j, start, stop)
        t = recording.t
        when, remedy = _when(t, start, stop, 'record again')
        reads = f'{recording.q[start, j]:.4g} {unit}'
        said = f'in {source} the position of {joint} stays at {reads} {when}'
        if goes > hidden:
            yield (
                f'{said}, while its velocity goes {goes:.3g} {unit}: its encoder is dead; {remedy}'
            )
        elif (
            robot is not None
            # what has died stays dead; a joint that turns round slowly, or comes to rest, goes
            # from one end of its friction to the other while a coarse encoder reads the same
            and stop == len(recording)
            and stop - start > _PART * len(recording)
            and _moves_unseen(robot, motions, j, (t[start], t[stop - 1]))
        ):
            yield (
                f'{said}, while its torque is not what weight and the other joints make of a '
                f'joint at rest: its encoder is dead; {remedy}'
            )
    yield from _dead_velocities(recording, source, units)


def _dead_velocities(recording: Recording, source: str, units: Sequence[str]) -> Iterator[str]:
    """Say which velocities stay the same, if those of other joints that move do not."""
    # A wheel or a turntable may go at constant speed: then its way is the integral of that.
    if recording.dq is None:
        return
    way = recording.q - recording.dq * (recording.t - recording.t[0])[:, np.newaxis]
    moved = np.ptp(recording.q, axis=0)
    moves = moved > REST_RANGE
    same = moves & (np.ptp(recording.dq, axis=0) == 0.0)  # noqa: RUF069 - as recorded
    same &= np.ptp(way, axis=0) > _WAY * moved
    if not np.any(moves & (np.ptp(recording.dq, axis=0) > 0.0)):
        return  # a driver that does not measure velocities
    for j in np.flatnonzero(same).tolist():
        moved = f'{np.ptp(recording.q[:, j]):.3g} {units[j]}'
        yield (
            f'in {source} the velocity of {recording.joints[j]} stays at '
            f'{recording.dq[0, j] + 0.0:.4g} {units[j]}/s throughout, while its position goes '
            f'{moved}: one of the two is dead; record again, or '
            'leave velocities out if the positions are right'
        )


def _when(t: FloatArray, start: int, stop: int, always: str) -> tuple[str, str]:
    """Return when a reading stays the same, in words, and what to do."""
    if stop - start == len(t):
        return 'throughout', always
    return f'from {t[start]:.3f} s to {t[stop - 1]:.3f} s', 'leave that time out'


def _longest_same(reading: FloatArray, step: float = 0.0) -> tuple[int, int]:
    """Return where the longest run without a larger step starts and stops."""
    edges = np.flatnonzero(np.abs(np.diff(reading)) > step) + 1
    bounds = np.concatenate([[0], edges, [len(reading)]])
    longest = int(np.argmax(np.diff(bounds)))
    return int(bounds[longest]), int(bounds[longest + 1])


def _distance(recording: Recording, joint: int, start: int, stop: int) -> float:
    """Return how far a recorded velocity goes beyond its mean, [rad or m]."""
    # What the integral of its white noise may reach by chance is taken off.
    if recording.dq is None or stop - start < 3:
        return 0.0
    dq, t = recording.dq[start:stop, joint], recording.t[start:stop]
    steps = np.diff(t)
    way = np.concatenate([[0.0], np.cumsum(0.5 * (dq[1:] + dq[:-1]) * steps)])
    way -= (t - t[0]) * way[-1] / (t[-1] - t[0])
    walk = _WALK * np.sqrt(_white(dq) * np.sum(steps**2))
    return max(float(np.ptp(way) - walk), 0.0)


def _moves_unseen(
    robot: Robot, motions: Sequence[Motion], joint: int, time: tuple[float, float]
) -> bool:
    """Return whether the torque of a joint that reads the same is none of one at rest."""
    # A joint at rest takes what its links weigh and what the other joints do to them. Its friction
    # answers to that: the drive gives what is left, none at least and all at most. What is
    # described is within a factor of two, so that a joint at rest is off it by no more than it
    # varies itself. One that is off by more, and by more than noise of its sensor, is at rest
    # where a good model of that describes it, with free masses and a share of the friction of
    # other joints. A joint that moves before or after varies as much then, and no more by far.
    within, other = [], []  # parts of motions within the time, and those before and after it
    for one in motions:
        first, last = np.searchsorted(one.t, [time[0], time[1] + 1e-9])
        within.append(one.select(slice(first, last)))
        pieces = (one.select(slice(0, first)), one.select(slice(last, len(one))))
        other += [piece for piece in pieces if len(piece)]
    motion = thinned(within, _ROWS)
    if motion is None or len(motion) < min(_LEAST, sum(len(one) for one in motions)):
        return False
    assert motion.tau is not None
    described, torque = inverse_dynamics(robot, motion)[:, joint], motion.tau[:, joint]
    size, off = float(np.std(torque)), float(np.std(torque - described))
    moving = [one.tau[:, joint] for one in other if one.tau is not None]
    if moving and size < _LIVELY * float(np.std(np.concatenate(moving))):
        return False
    if not off > float(np.std(described)) + sensor_noise(robot, None)[joint]:
        return False
    others = [k for k in range(motion.n_joints) if k != joint]
    rubs = motion.dq[:, others], np.sign(motion.dq[:, others])
    columns = np.column_stack([regressor(robot, motion)[:, joint], np.ones(len(motion)), *rubs])
    length = np.sqrt(np.mean(columns**2, axis=0))
    columns = columns / np.where(length > 0.0, length, 1.0)
    left = left_of_blocks(columns, (torque - described) / size)
    smooth = float(np.mean(left**2)) - _white(left)
    return bool(100.0 * np.sqrt(max(smooth, 0.0)) > LIMITS.poor)


def _white(values: FloatArray) -> float:
    """Return the variance of white noise, of which second differences have six times as much."""
    return float(np.mean(np.diff(values, 2) ** 2)) / 6.0
