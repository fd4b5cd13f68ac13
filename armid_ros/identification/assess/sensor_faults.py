# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Faults of sensors and clocks: constant channels, wrong velocities, wrong joint positions.

The reading of a locked joint is constant and its velocity is zero. A constant position is a dead
sensor only if the recorded velocity is not zero. A passive joint and a drive at its limit have a
constant torque, too. They are recognised: the model predicts hardly any torque for a passive
joint, and a saturated drive has its largest torque.

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
from armid_ros.robots import described_at, held_joints, Robot
import numpy as np
from scipy.integrate import cumulative_trapezoid


@dataclass(frozen=True)
class Fault:
    """
    Fault of one or of all recordings, and the best grade possible with the fault.

    Attributes
    ----------
    what : str
        Joint, fault and remedy, without the recording and without a full stop.
    word : {'good', 'poor', 'unusable'}
        Best grade that an identification can have with the fault; 'good' for a note.
    source : str or None
        The recording; None if all recordings have the fault.

    """

    what: str
    word: Word
    source: str | None = None

    @property
    def text(self) -> str:
        """Return the fault as text, with the name of its recording."""
        return (
            self.what if self.source is None else f'in {self.source or "a recording"} {self.what}'
        )


def sensor_faults(
    arm: ArmModel, recordings: Sequence[Recording], rows: Sequence[Stretch], used: Conditioning
) -> Iterator[Fault]:
    """
    Yield faults of clocks and sensors, and undriven joints that are at unexpected positions.

    The recordings have torques and no damaged samples (see `damage`); `rows` are the regression
    rows of the same recordings.

    """
    for one in recordings:
        uneven = uneven_stamps(one, used.cutoff_hz)
        if uneven:
            yield Fault(f'in {uneven}', 'poor')
        if one.report.restarted:
            yield Fault(
                f'the clock jumped back; {one.report.restarted} of {one.report.messages} '
                'messages, on the shorter side of the jump, are left out',
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
    """Yield a fault for the first jump of a position that is too fast for the joint."""
    if len(recording) < 2:
        return
    # a step is no motion if it is ten times as fast as the limit and as 99 % of all steps
    time = np.maximum(np.diff(recording.t), recording.period)[:, np.newaxis]
    steps = np.diff(recording.q, axis=0)
    usual = np.percentile(np.abs(steps) / time, 99.0, axis=0)
    known = np.isfinite(robot.velocity_limit) & (robot.velocity_limit > 0.0)
    limit = np.maximum(usual, np.where(known, robot.velocity_limit, 0.0))
    jumps = np.argwhere((np.abs(steps) > 10.0 * limit * time) & (limit > 0.0))
    for row, joint in jumps[:1].tolist():
        yield Fault(
            f'the position of {robot.joints[joint]} jumps by {steps[row, joint]:.3g} '
            f'{robot.position_units[joint]} at {recording.t[row + 1]:.3f} s: leave out the '
            'faulty part, or record again',
            'poor',
            recording.source,
        )


def encoder_faults(recording: Recording, units: Sequence[str] | None) -> Iterator[Fault]:
    """Yield faults of recorded positions or velocities that are constant while the joint moves."""
    if recording.dq is None:
        return
    t, units = recording.t, units or ('rad',) * recording.n_joints
    moved = np.ptp(recording.q, axis=0)
    # A wheel or a turntable may have constant speed, whose integral is its distance to a tenth.
    # Errors of clocks and units are smaller; a reversal changes half of the distance.
    deviation = np.ptp(recording.q - recording.dq * (t - t[0])[:, np.newaxis], axis=0)
    changes = np.ptp(recording.dq, axis=0) > 0.0
    measured = bool(np.any((moved > REST_RANGE) & changes))  # or there are no velocities
    for j, unit in enumerate(units):
        start, stop = _longest_constant(recording.q[:, j])
        # range of positions at rest, plus one step of the encoder
        steps = np.abs(np.diff(recording.q[:, j]))
        hidden = REST_RANGE + (float(steps[steps > 0.0].min()) if steps.any() else 0.0)
        distance = 0.0  # range of the integral of the velocity minus its mean
        if stop - start > 2:
            time, dq = t[start:stop], recording.dq[start:stop, j]
            integral = cumulative_trapezoid(dq, time, initial=0.0)
            integral -= (time - time[0]) * integral[-1] / (time[-1] - time[0])
            # Integrated white noise is a random walk; its second differences have 6 times its
            # variance. The range of a Brownian bridge is 3 times its scale with a probability of
            # 1e-6 (Kuiper 1960).
            noise = float(np.mean(np.diff(dq, 2) ** 2)) / 6.0
            walk = float(np.sqrt(noise * np.sum(np.diff(time) ** 2)))
            distance = float(np.ptp(integral)) - 3.0 * walk
        if distance > hidden:
            why = (
                f', while its velocity integrates to {distance:.3g} {unit}: its encoder is frozen'
            )
            value = f'{recording.q[start, j]:.4g} {unit}'
            yield _constant_channel(
                recording, j, 'position', value, (start, stop), why, 'record again'
            )
        if measured and moved[j] > REST_RANGE and not changes[j] and deviation[j] > 0.1 * moved[j]:
            why = f', while its position moves by {moved[j]:.3g} {unit}: one of the two is frozen'
            remedy = 'record again, or leave velocities out if the positions are right'
            value = f'{recording.dq[0, j] + 0.0:.4g} {unit}/s'
            yield _constant_channel(recording, j, 'velocity', value, (0, len(t)), why, remedy)


def torque_faults(
    arm: ArmModel, recording: Recording, motions: Sequence[Motion]
) -> Iterator[Fault]:
    """Yield faults of recorded torques that are constant while the load on the joint varies."""
    assert recording.tau is not None
    if np.all(np.ptp(recording.tau, axis=0) < NOTHING):
        yield Fault(SILENT, 'unusable', recording.source)
        return
    # A channel is dead if it is constant for 1 s over a fifth of the joint's range, while its load
    # changes by half of weight or inertia, which cancel in a passive joint.
    t, least = recording.t, max(2, round(1.0 / recording.period))
    for j in range(recording.n_joints):
        reading, q = recording.tau[:, j], recording.q[:, j]
        start, stop = _longest_constant(reading, NOTHING)
        moved = float(np.ptp(q[start:stop])) > 0.2 * float(np.ptp(q))
        at_limit = 0.0 < np.abs(reading).max() == abs(reading[start]) and stop - start < len(t)
        if stop - start < least or not moved or at_limit:
            continue
        for motion in motions:
            part = motion.select((motion.t >= t[start]) & (motion.t <= t[stop - 1]))
            if len(part) < 2:
                continue
            load, weight = arm.load(part)[:, j], arm.load(part.at_rest())[:, j]
            largest = max(float(np.std(weight)), float(np.std(load - weight)))
            if float(np.std(load)) > 0.5 * largest > 0.0:
                value = f'{reading[start] + 0.0:.4g} {arm.robot.torque_units[j]}'
                why = ' while the joint moves: its channel is frozen'
                remedy = 'record with the joint held still'
                yield _constant_channel(recording, j, 'torque', value, (start, stop), why, remedy)
                break


def units_beyond_drives(
    robot: Robot, recordings: Sequence[Recording], motions: Sequence[Motion]
) -> Iterator[str]:
    """
    Yield notes on torques so far above the drive limit that their unit must be wrong.

    There is no note if most joints exceed their limits, or if the described links need as much
    torque along the filtered motions: then the described limits are wrong.

    """
    measured = [recording.tau for recording in recordings if recording.tau is not None]
    if not measured or not motions:
        return
    usual = np.median(np.abs(np.concatenate(measured)), axis=0)
    known = np.isfinite(robot.torque_limit) & (robot.torque_limit > 0.0)
    # the smallest factor of a unit is 100; no drive exceeds its limit by the square root of it
    beyond = known & (usual > 10.0 * robot.torque_limit)
    if 2 * np.sum(beyond) > np.sum(known):
        return
    needed = np.max([np.abs(inverse_dynamics(robot, one)).max(axis=0) for one in motions], axis=0)
    for joint in np.flatnonzero(beyond & (needed < robot.torque_limit)).tolist():
        limit, unit = robot.torque_limit[joint], robot.torque_units[joint]
        yield (
            f'the torque of {robot.joints[joint]} seems to be in another unit than {unit}: '
            f'half of its readings exceed {usual[joint]:.3g}; the limit of its drive is '
            f'{limit:.4g} {unit}. Convert it, or correct the limit in the description'
        )


def _constant_channel(
    recording: Recording,
    joint: int,
    quantity: str,
    value: str,
    run: tuple[int, int],
    why: str,
    remedy: str,
) -> Fault:
    """Return the fault that a recorded quantity is constant for some time or throughout."""
    when = 'throughout'
    if run != (0, len(recording)):
        first, last = recording.t[run[0]], recording.t[run[1] - 1]
        when, remedy = f'from {first:.3f} s to {last:.3f} s', 'leave out these seconds'
    text = f'the {quantity} of {recording.joints[joint]} stays at {value} {when}{why}; {remedy}'
    return Fault(text, 'unusable', recording.source)


def _longest_constant(reading: FloatArray, step: float = 0.0) -> tuple[int, int]:
    """Return the index range of the longest run in which a signal changes by at most ``step``."""
    edges = np.flatnonzero(np.abs(np.diff(reading)) > step) + 1
    bounds = np.concatenate([[0], edges, [len(reading)]])
    longest = int(np.argmax(np.diff(bounds)))
    return int(bounds[longest]), int(bounds[longest + 1])


def velocity_ratio(recording: Recording) -> tuple[FloatArray, FloatArray]:
    """
    Return each joint's ratio of recorded velocity to position rate, and the correlation.

    The integral of a velocity is compared with the position, so that noise and steps of positions
    and jitter of time stamps do not matter.

    Returns
    -------
    ratio : ndarray, shape (n,)
        Recorded velocities over those of the positions; NaN where a joint rests or has constant
        speed, and where no velocities are recorded.
    fit : ndarray, shape (n,)
        Correlation of the two; 0 where the ratio is NaN.

    """
    nothing = np.full(recording.n_joints, np.nan), np.zeros(recording.n_joints)
    if recording.dq is None:
        return nothing
    # positions and integrated velocities of unbroken pieces, both without linear trend; of at most
    # 10 s, above a usual period, as integrated noise is a random walk
    pairs = []
    for stretch in unbroken(recording, 1.0 / recording.period):
        duration = recording.t[stretch[-1]] - recording.t[stretch[0]]
        for part in np.array_split(stretch, max(1, int(np.ceil(duration / 10.0)))):
            if len(part) > 3:
                t = recording.t[part] - recording.t[part[0]]
                line = np.linalg.qr(np.column_stack([np.ones(len(t)), t]))[0]
                integral = cumulative_trapezoid(recording.dq[part], t, axis=0, initial=0.0)
                pairs.append([x - line @ (line.T @ x) for x in (recording.q[part], integral)])
    if not pairs:
        return nothing
    moved, integral = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    product, own, other = np.sum(moved * integral, 0), np.sum(moved**2, 0), np.sum(integral**2, 0)
    # a joint with constant speed has only a linear trend and noise: a tenth of the range at rest
    rests = np.ptp(recording.q, axis=0) < REST_RANGE
    rests |= own < len(moved) * (0.1 * REST_RANGE) ** 2
    size = np.sqrt(own * other)
    return (
        np.where(rests, np.nan, product / np.where(rests, 1.0, own)),
        np.where(~rests & (size > 0.0), product / np.where(size > 0.0, size, 1.0), 0.0),
    )


def velocity_faults(recording: Recording) -> Iterator[Fault]:
    """
    Yield faults of recorded velocities that contradict the positions in time, unit or sign.

    Identification differentiates the positions, so a wrong unit or sign of velocities is harmless.
    A wrong time base needs at least two joints that agree, and no moving joint that disagrees.

    """
    degree = float(np.deg2rad(1.0))
    ratio, fit = velocity_ratio(recording)
    # A low-pass that reduces a velocity by 5 % delays it by a phase with cosine 0.95: a higher
    # correlation shows a plain factor. Ratios of joints with a common factor differ by 2 %.
    plain = ratio[fit > 0.98]
    factor = float(np.median(plain)) if len(plain) > 1 else 1.0
    # An error of time by 5 % changes the torque of inertia by 10 %. Errors of encoders, clocks and
    # the integral are at most 1 %.
    known = any(abs(factor / one - 1.0) <= 0.05 for one in (1.0, degree, 1.0 / degree))
    if not known and np.all(np.abs(plain / factor - 1.0) <= 0.02):
        yield Fault(
            f'velocities of all moving joints are {factor:.3g} times the rates of the positions. '
            f'Either time stamps run {factor:.3g} times the true time, and inertias are off by '
            'the square of this factor, or velocities are in another unit. Correct the stamps '
            'or the velocities',
            'poor',
            recording.source,
        )
    texts = {
        1.0 / degree: 'are in degrees/s while positions are in rad',
        degree: 'are in rad/s while positions are in degrees',
        -1.0: 'have the opposite sign of the rates of the positions',
    }
    for expected, text in texts.items():
        # a correlation of 0.7 explains half of the power; a factor is near that of the unit
        follows = fit * np.sign(expected) > 0.7
        off = follows & (ratio / expected > 1.0 / 1.25) & (ratio / expected < 1.25)
        if off.any():
            named = ', '.join(recording.joints[k] for k in np.flatnonzero(off))
            what = f'velocities of {named} {text}; the fit takes velocities from the positions'
            yield Fault(what, 'good', recording.source)


def held_elsewhere(
    robot: Robot, recordings: Sequence[Recording], motions: Sequence[Motion]
) -> Iterator[Fault]:
    """
    Yield faults of undriven joints away from their modelled position, if this affects torques.

    If such a joint moves, or carries driven joints at another position, the arm differs from the
    model. The size of this error is the change of the described torque along the recorded motions
    of the driven joints, over the measured torque.

    """
    for joint in held_joints(robot):
        seen = [other for one in recordings for other in one.others if other.joint == joint.name]
        if not seen:
            continue
        lowest, highest = min(one.lowest for one in seen), max(one.highest for one in seen)
        moves = highest - lowest > REST_RANGE
        if not (moves or joint.carries):
            continue
        # largest relative change of the described torque between positions of the joint; several
        # positions, as weight and inertia may be equal at both ends of the range
        places = [*np.linspace(lowest, highest, 7 if moves else 1), joint.position]
        robots = [described_at(robot, {joint.name: place}) for place in places]
        described = [np.concatenate([inverse_dynamics(r, m) for m in motions]) for r in robots]
        changes = [np.linalg.norm(a - b, axis=0) for a, b in combinations(described, 2)]
        measured = [motion.tau for motion in motions if motion.tau is not None]
        torque = np.linalg.norm(np.concatenate(measured), axis=0)
        share = np.max(changes, axis=0) / np.where(torque > 0.0, torque, np.inf)
        worst = int(np.argmax(share))
        if share[worst] > LIMITS.floor or (moves and joint.carries):
            error = f'{100.0 * share[worst]:.0f} % of the torque of {robot.joints[worst]}'
            model = f'the model has it at {joint.position:.3g} {joint.unit}'
            carries = f', and carries {", ".join(joint.carries)}' if joint.carries else ''
            remedy = 'drive it too (--joints), or hold it still where its torque is not measured'
            text = (
                f'joint {joint.name} is not driven, but moves from {lowest:.3g} to {highest:.3g} '
                f'{joint.unit}{carries}; {model}; its position makes up to {error}; '
                f'{"leave out the time in which it moves" if joint.follows else remedy}'
            )
            if not moves:
                text = (
                    f'joint {joint.name} is not driven and stands at {lowest:.3g} {joint.unit}, '
                    f'where {model}, which makes {error}; make it fixed there in the '
                    'description, or drive it (--joints)'
                )
            word: Word = 'poor' if 100.0 * share[worst] > LIMITS.poor else 'good'
            yield Fault(text, word)
