# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Faults that readings show by themselves: dead sensors, velocities, clocks, joints held elsewhere.

A joint may be locked: its reading stays the same and its velocity is zero. A reading that does not
change by one count is dead where the recorded velocity goes on. A passive joint and a drive at its
limit have a torque that does not change, too: the model takes next to none of the one, and the
other is the highest there is.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

from armid_ros.arm import ArmModel
from armid_ros.identification.assess.grade_limits import LIMITS, Word
from armid_ros.identification.rows.checks import REST_RANGE, SILENT
from armid_ros.identification.rows.regression import Stretch
from armid_ros.identification.rows.signals import Conditioning, unbroken
from armid_ros.identification.rows.stamps import rounded_stamps, uneven_stamps
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.recording.series import NOTHING
from armid_ros.robots import described_at, held_joints, HeldJoint, Robot
import numpy as np
from scipy.integrate import cumulative_trapezoid

#: A step of a position at this multiple of the highest velocity, or of what so many percent of
#: the steps have, is none of the arm; one that is undone within so many samples is repaired.
_IMPOSSIBLE, _USUAL, _BRIDGED = 10.0, 99.0, 10
#: Range of a Brownian bridge over its scale that chance exceeds once in a million (Kuiper 1960).
_WALK = 3.0
#: Share of the way of a joint that the integral of a constant speed may miss: clocks and units are
#: off by less, and a joint that turns round misses half of it.
_WAY = 0.1
#: A torque is dead that stays the same for so long [s], while the joint goes so far of its way
#: and what the model takes changes by so much of weight or inertia: of a passive one they cancel.
_LONG, _FAR, _TAKEN = 1.0, 0.2, 0.5
#: Velocities are integrated over pieces of at most so many seconds, which is a period and more of
#: what arms do: their noise adds up to a walk. What a joint of constant speed leaves its line by
#: [rad or m].
_PIECE, _STEADY = 10.0, 0.1 * REST_RANGE
#: Correlation from which a ratio is a plain factor: a low-pass that takes a twentieth of a
#: velocity delays it by a phase whose cosine is 0.95. Factors that are one differ by less than
#: the second.
_PLAIN, _ALIKE = 0.98, 0.02
#: A common factor is one from so much on. A twentieth of the time is a tenth of what inertia
#: takes; scales of encoders and clocks are wrong by a hundredth at most, and so is the integral.
_TOLERANCE = 0.05
#: A velocity of this correlation with what its position does, within this factor of a unit, is in
#: that unit: half of its power follows, and no other unit or sign is near.
_FOLLOWS, _NEAR = 0.7, 1.25
_DEGREE = float(np.deg2rad(1.0))
#: Velocities over those of the positions, and what is wrong with them.
_RATIOS = {
    1.0 / _DEGREE: 'are in degrees/s while positions are in rad',
    _DEGREE: 'are in rad/s while positions are in degrees',
    -1.0: 'have the opposite sign of what the positions do',
}


@dataclass(frozen=True)
class Fault:
    """
    A fault of recordings.

    Attributes
    ----------
    what : str
        Joint, what is wrong and what to do, without the recording and without a full stop.
    word : {'good', 'poor', 'unusable'}
        The best grade of an identification of it; 'good' where it is only worth knowing.
    source : str or None
        The recording; None where it is of all of them.

    """

    what: str
    word: Word
    source: str | None = None

    @property
    def text(self) -> str:
        """Return the fault with its recording."""
        return (
            self.what if self.source is None else f'in {self.source or "a recording"} {self.what}'
        )


def sensor_faults(
    arm: ArmModel, recordings: Sequence[Recording], rows: Sequence[Stretch], used: Conditioning
) -> Iterator[Fault]:
    """
    Yield faults of clocks and sensors, and undriven joints at another position.

    Parameters
    ----------
    arm : ArmModel
        What the data are compared with.
    recordings : sequence of Recording
        The data as they were recorded, with torques.
    rows : sequence of Stretch
        The data in rows.
    used : Conditioning
        Filters.

    """
    band_hz = min(used.kept_hz, *(part.motion.band_hz for part in rows))
    for one in recordings:
        uneven = uneven_stamps(one, used.cutoff_hz, band_hz)
        if uneven:
            yield Fault(f'in {uneven}', 'poor')
        if one.report.restarted:
            yield Fault(
                f'the clock jumped back; {one.report.restarted} of {one.report.messages} '
                'messages, on the shorter side of it, are left out',
                'good',
                one.source,
            )
        rounded = rounded_stamps(one)
        if rounded:
            yield Fault(rounded, 'good', one.source)
        yield from encoder_faults(one, arm.robot.position_units)
        yield from velocity_faults(one)
        yield from _jumps(arm.robot, one)
        own = [part.motion for part in rows if part.source == one.source]
        yield from torque_faults(arm, one, own)
    yield from held_elsewhere(arm.robot, recordings, [part.motion for part in rows])


def _jumps(robot: Robot, recording: Recording) -> Iterator[Fault]:
    """Yield the first position jump that no joint can make and that does not revert."""
    if len(recording) < 2:
        return
    time = np.maximum(np.diff(recording.t), recording.period)[:, np.newaxis]
    steps = np.diff(recording.q, axis=0)
    usual = np.percentile(np.abs(steps) / time, _USUAL, axis=0)
    known = np.isfinite(robot.velocity_limit) & (robot.velocity_limit > 0.0)
    limit = np.maximum(usual, np.where(known, robot.velocity_limit, 0.0))
    jumps = (np.abs(steps) > _IMPOSSIBLE * limit * time) & (limit > 0.0)
    for row, joint in np.argwhere(jumps).tolist():
        step, later = steps[row, joint], recording.q[row + 1 :, joint][: _BRIDGED + 1]
        if abs(later[-1] - recording.q[row, joint]) > 0.5 * abs(step):
            yield Fault(
                f'the position of {robot.joints[joint]} jumps by {step:.3g} '
                f'{robot.position_units[joint]} at {recording.t[row + 1]:.3f} s: leave out what '
                'is faulty, or record again',
                'poor',
                recording.source,
            )
            return


def encoder_faults(recording: Recording, units: Sequence[str] | None = None) -> Iterator[Fault]:
    """Yield position and velocity channels that are constant while the joint moves."""
    if recording.dq is None:
        return
    t, units = recording.t, units or ('rad',) * recording.n_joints
    moved = np.ptp(recording.q, axis=0)
    # A wheel or a turntable may go at constant speed: then its way is the integral of that.
    way = np.ptp(recording.q - recording.dq * (t - t[0])[:, np.newaxis], axis=0)
    changes = np.ptp(recording.dq, axis=0) > 0.0
    measured = bool(np.any((moved > REST_RANGE) & changes))  # or the driver has no velocities
    for j, (joint, unit) in enumerate(zip(recording.joints, units, strict=True)):
        start, stop = _longest_same(recording.q[:, j])
        # a step of the encoder, and as much as a joint at rest goes
        steps = np.abs(np.diff(recording.q[:, j]))
        hidden = REST_RANGE + (float(steps[steps > 0.0].min()) if steps.any() else 0.0)
        goes = _distance(t[start:stop], recording.dq[start:stop, j])
        if goes > hidden:
            when, remedy = _when(t, start, stop, 'record again')
            yield Fault(
                f'the position of {joint} stays at {recording.q[start, j]:.4g} {unit} {when}, '
                f'while its velocity goes {goes:.3g} {unit}: its encoder is dead; {remedy}',
                'unusable',
                recording.source,
            )
        if measured and moved[j] > REST_RANGE and not changes[j] and way[j] > _WAY * moved[j]:
            yield Fault(
                f'the velocity of {joint} stays at {recording.dq[0, j] + 0.0:.4g} {unit}/s '
                f'throughout, while its position goes {moved[j]:.3g} {unit}: one of the two is '
                'dead. Record again, or leave velocities out if the positions are right',
                'unusable',
                recording.source,
            )


def torque_faults(
    arm: ArmModel, recording: Recording, motions: Sequence[Motion]
) -> Iterator[Fault]:
    """Yield torque channels that are constant while the joint needs another torque."""
    assert recording.tau is not None
    if np.all(np.ptp(recording.tau, axis=0) < NOTHING):
        yield Fault(SILENT, 'unusable', recording.source)
        return
    t, least = recording.t, max(2, round(_LONG / recording.period))
    for j, joint in enumerate(recording.joints):
        reading, q = recording.tau[:, j], recording.q[:, j]
        start, stop = _longest_same(reading, NOTHING)
        moved = float(np.ptp(q[start:stop])) > _FAR * float(np.ptp(q))
        at_limit = 0.0 < np.abs(reading).max() == abs(reading[start]) and stop - start < len(t)
        if stop - start < least or not moved or at_limit:
            continue
        for motion in motions:
            part = motion.select((motion.t >= t[start]) & (motion.t <= t[stop - 1]))
            if len(part) < 2:
                continue
            load, weight = arm.load(part)[:, j], arm.load(part.at_rest())[:, j]
            largest = max(float(np.std(weight)), float(np.std(load - weight)))
            if float(np.std(load)) > _TAKEN * largest > 0.0:
                when, remedy = _when(t, start, stop, 'record with the joint held still')
                value = f'{reading[start] + 0.0:.4g} {arm.robot.torque_units[j]}'
                yield Fault(
                    f'the torque of {joint} stays at {value} {when} while the joint moves: its '
                    f'channel is dead; {remedy}',
                    'unusable',
                    recording.source,
                )
                break


def _when(t: FloatArray, start: int, stop: int, always: str) -> tuple[str, str]:
    """Describe when a channel is constant, and the remedy."""
    if stop - start == len(t):
        return 'throughout', always
    return f'from {t[start]:.3f} s to {t[stop - 1]:.3f} s', 'leave that time out'


def _longest_same(reading: FloatArray, step: float = 0.0) -> tuple[int, int]:
    """Return start and stop of the longest run without a step larger than ``step``."""
    edges = np.flatnonzero(np.abs(np.diff(reading)) > step) + 1
    bounds = np.concatenate([[0], edges, [len(reading)]])
    longest = int(np.argmax(np.diff(bounds)))
    return int(bounds[longest]), int(bounds[longest + 1])


def _distance(t: FloatArray, dq: FloatArray) -> float:
    """Return the distance that a recorded velocity covers beyond its mean [rad or m]."""
    if len(t) < 3:
        return 0.0
    way = cumulative_trapezoid(dq, t, initial=0.0)
    way -= (t - t[0]) * way[-1] / (t[-1] - t[0])
    # white noise of which second differences have six times the variance adds up to a walk
    noise = float(np.mean(np.diff(dq, 2) ** 2)) / 6.0
    return max(float(np.ptp(way)) - _WALK * float(np.sqrt(noise * np.sum(np.diff(t) ** 2))), 0.0)


def velocity_ratio(recording: Recording) -> tuple[FloatArray, FloatArray]:
    """
    Compare velocities of a recording with its positions, in the recorded time.

    The integral of a velocity is compared with the position: noise and steps of a position that
    would be differentiated do not matter, and neither do time stamps that jitter.

    Returns
    -------
    ratio : ndarray, shape (n,)
        Recorded velocities over those that positions have; NaN where a joint rests, or goes at
        constant speed, and where none are recorded.
    fit : ndarray, shape (n,)
        Correlation of the two; 0 where there is none.

    """
    nothing = np.full(recording.n_joints, np.nan), np.zeros(recording.n_joints)
    if recording.dq is None:
        return nothing
    # positions and integrated velocities of unbroken pieces, both without their line
    pairs = []
    for stretch in unbroken(recording, 1.0 / recording.period):
        duration = recording.t[stretch[-1]] - recording.t[stretch[0]]
        for part in np.array_split(stretch, max(1, int(np.ceil(duration / _PIECE)))):
            if len(part) > 3:
                t = recording.t[part] - recording.t[part[0]]
                line = np.linalg.qr(np.column_stack([np.ones(len(t)), t]))[0]
                made = cumulative_trapezoid(recording.dq[part], t, axis=0, initial=0.0)
                pairs.append([x - line @ (line.T @ x) for x in (recording.q[part], made)])
    if not pairs:
        return nothing
    moved, made = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    product, own, other = np.sum(moved * made, 0), np.sum(moved**2, 0), np.sum(made**2, 0)
    # A joint of constant speed has nothing but its line, and noise.
    rests = (np.ptp(recording.q, axis=0) < REST_RANGE) | (own < len(moved) * _STEADY**2)
    size = np.sqrt(own * other)
    return (
        np.where(rests, np.nan, product / np.where(rests, 1.0, own)),
        np.where(~rests & (size > 0.0), product / np.where(size > 0.0, size, 1.0), 0.0),
    )


def velocity_faults(recording: Recording) -> Iterator[Fault]:
    """
    Yield faults of velocities against positions: time base, unit or sign.

    Identification takes velocities from the positions, so that a unit or a sign spoils nothing.
    Of a wrong time two joints at least have to agree, and no other that moves may disagree.

    """
    ratio, fit = velocity_ratio(recording)
    plain = ratio[fit > _PLAIN]
    factor = float(np.median(plain)) if len(plain) > 1 else 1.0
    known = any(abs(factor / one - 1.0) <= _TOLERANCE for one in (1.0, _DEGREE, 1.0 / _DEGREE))
    if not known and np.all(np.abs(plain / factor - 1.0) <= _ALIKE):
        yield Fault(
            f'velocities of all joints that move are {factor:.3g} times what positions do in the '
            f'recorded time. Either time stamps run {factor:.3g} times as long as it took, and '
            'inertias are off by the square of that, or velocities are in another unit. Correct '
            'which it is',
            'poor',
            recording.source,
        )
    for expected, text in _RATIOS.items():
        follows = fit * np.sign(expected) > _FOLLOWS
        off = follows & (ratio / expected > 1.0 / _NEAR) & (ratio / expected < _NEAR)
        if off.any():
            named = ', '.join(recording.joints[k] for k in np.flatnonzero(off))
            said = f'velocities of {named} {text}; the fit takes velocities from the positions'
            yield Fault(said, 'good', recording.source)


def held_elsewhere(
    robot: Robot, recordings: Sequence[Recording], motions: Sequence[Motion]
) -> Iterator[Fault]:
    """
    Yield undriven joints that were at another position, if that matters.

    Where such a joint moves, or stands elsewhere and carries driven joints, the arm is another one
    than the model; how much that matters is what its position makes of the described torque along
    the recorded motion, beside the torque that was measured.

    Parameters
    ----------
    robot : Robot
        Whose description it is.
    recordings : sequence of Recording
        With the range of joints that were not asked for.
    motions : sequence of Motion
        Of the driven joints, with their torque.

    """
    for joint in held_joints(robot):
        seen = [other for one in recordings for other in one.others if other.joint == joint.name]
        if not seen:
            continue
        lowest, highest = min(one.lowest for one in seen), max(one.highest for one in seen)
        moves = highest - lowest > REST_RANGE
        if not (moves or joint.carries):
            continue  # a part of the body that carries it, in whatever position
        # the largest change of the described torque between places, as a share
        # places of its range at which a joint that moves is compared: weight and inertia may be
        # the same at both ends, as those of a link that swings as far to either side
        places = [*np.linspace(lowest, highest, 7 if moves else 1), joint.position]
        robots = [described_at(robot, {joint.name: place}) for place in places]
        described = [np.concatenate([inverse_dynamics(r, m) for m in motions]) for r in robots]
        changes = [np.linalg.norm(a - b, axis=0) for a, b in combinations(described, 2)]
        measured = [motion.tau for motion in motions if motion.tau is not None]
        whole = np.linalg.norm(np.concatenate(measured), axis=0)
        share = np.max(changes, axis=0) / np.where(whole > 0.0, whole, np.inf)
        worst = int(np.argmax(share))
        if share[worst] > LIMITS.floor or (moves and joint.carries):
            makes = f'{100.0 * share[worst]:.0f} % of the torque of {robot.joints[worst]}'
            word: Word = 'poor' if 100.0 * share[worst] > LIMITS.poor else 'good'
            yield Fault(_elsewhere(joint, lowest, highest, moves, makes), word)


def _elsewhere(joint: HeldJoint, lowest: float, highest: float, moves: bool, makes: str) -> str:
    """Describe where a joint was, its effect on the torque, and the remedy."""
    name, unit = joint.name, joint.unit
    model = f'the model has it at {joint.position:.3g} {unit}'
    if not moves:
        return (
            f'joint {name} is not driven and stands at {lowest:.3g} {unit}, where {model}, which '
            f'makes {makes}; make it fixed there in the description, or drive it (--joints)'
        )
    carries = f', and carries {", ".join(joint.carries)}' if joint.carries else ''
    remedy = 'drive it as well (--joints), or hold it still where its torque is not measured'
    return (
        f'joint {name} is not driven, but moves from {lowest:.3g} to {highest:.3g} '
        f'{unit}{carries}; {model}; where it is makes up to {makes}; '
        f'{"leave out where it moves" if joint.follows else remedy}'
    )
