# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Inspection of a recording: its statistics, remarks for the user, and a verdict."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, get_args, Literal

from armid_ros.identification.assess.sensor_faults import encoder_faults, velocity_faults
from armid_ros.identification.rows.checks import beyond_limits, short_recording_note, SILENT
from armid_ros.identification.rows.stamps import rounded_stamps, two_senders
from armid_ros.inspection.facts import joint_facts, JointFacts, Sampling, TrialFit
from armid_ros.recording import Recording, Topic
from armid_ros.robots import driven_in_words, held_joints, Robot
import numpy as np

SCHEMA = 'armid/inspection/1'
Weight = Literal['bad', 'doubt', 'note']


@dataclass(frozen=True)
class Remark:
    """
    Remark for the user on a fault of a recording or of a robot description.

    Attributes
    ----------
    weight : {'bad', 'doubt', 'note'}
        'bad' spoils results, 'doubt' may spoil results, 'note' is information.
    text : str
        The fault, its place and the remedy.

    """

    weight: Weight
    text: str


@dataclass(frozen=True)
class Inspection:
    """
    Result of the inspection of a recording.

    Attributes
    ----------
    recording : Recording
        The recording that was inspected.
    topics : tuple of Topic
        Topics of the bag; empty for a table.
    robot : Robot or None
        Description of the robot; None if none was given.
    sampling : Sampling
        Rate, jitter, gaps, period.
    joints : tuple of JointFacts
        In the order of the recording.
    trial : TrialFit or None
        Result of a trial identification; None without a robot.
    remarks : tuple of Remark
        The worst first.

    """

    recording: Recording
    topics: tuple[Topic, ...]
    robot: Robot | None
    sampling: Sampling
    joints: tuple[JointFacts, ...]
    trial: TrialFit | None
    remarks: tuple[Remark, ...]

    @property
    def verdict(self) -> str:
        """Return a sentence that states whether the recording is suitable for identification."""
        if self.trial is None:
            if self.recording.tau is None:
                return 'No efforts: nothing can be identified from motion alone.'
            if any(remark.weight == 'bad' for remark in self.remarks):
                return 'The recording is not fit for identification.'
            return 'No fault found; add --robot to check limits and try an identification.'
        if self.trial.refused:
            return '`armid identify` refuses the recording.'
        if self.trial.grade != 'good':
            reason = self.trial.reasons[0]
            known = _contains_any(reason, [remark.text for remark in self.remarks])
            why = '.' if known else f': {reason}'
            return f'Graded {self.trial.grade} by `armid identify`{why}'
        return (
            f'Ready for `armid identify`: {self.trial.rank} of {self.trial.theory} parameters are '
            f'identifiable (trial fit: {self.trial.relative_error_percent:.1f} % error).'
        )

    @property
    def units(self) -> tuple[str, ...]:
        """Return the unit of the position of each joint, 'rad' or 'm'."""
        if self.robot is None:
            return ('rad',) * self.recording.n_joints
        return self.robot.position_units


def inspect(
    recording: Recording,
    robot: Robot | None = None,
    trial: TrialFit | None = None,
    *,
    topics: tuple[Topic, ...] = (),
) -> Inspection:
    """
    Inspect a recording: its time stamps, units, motion and efforts.

    Parameters
    ----------
    recording : Recording
        The recording. With a robot, its joints are those of the robot, in the same order.
    robot : Robot, optional
        The described robot, for checks of limits and units.
    trial : TrialFit, optional
        Quality of a trial identification of the robot from the recording.
    topics : tuple of Topic, optional
        Topics of the bag.

    """
    sampling, joints = Sampling.of(recording), joint_facts(recording)
    found = [
        *_time_remarks(recording, sampling),
        *_unit_remarks(recording, joints, robot),
        *_motion_remarks(joints, sampling),
        *_effort_remarks(joints, trial),
    ]
    mixed = two_senders(recording)
    if trial is None and mixed:
        found.append(Remark('bad', mixed))
    if trial is None or trial.refused:
        units = None if robot is None else robot.position_units
        found += [Remark('bad', one.text) for one in encoder_faults(recording, units)]
    if trial is not None and trial.refused:
        found.insert(0, Remark('bad', trial.refused.removeprefix(f'{recording.source}: ')))
    elif trial is not None:
        found += _fit_remarks(trial, [remark.text for remark in found])
        found += [Remark('doubt', text) for text in trial.elsewhere]
        known = {remark.text for remark in found}
        found += [Remark('note', note) for note in trial.notes if note not in known]
    if robot is not None:
        found += [Remark('note', note) for note in notes_on(robot)]
    return Inspection(recording, topics, robot, sampling, joints, trial, worst_first(found))


def inspection_document(found: Inspection) -> dict[str, Any]:
    """Return the result of an inspection as a JSON document."""
    trial = None
    if found.trial is not None:
        trial = asdict(found.trial)
        scale = found.trial.scale
        trial['scale'] = (
            None if scale is None else [s if np.isfinite(s) else None for s in scale.tolist()]
        )
    return {
        'schema': SCHEMA,
        'source': found.recording.source,
        'topic': found.recording.topic,
        'topics': [
            {'name': t.name, 'type_name': t.type_name, 'count': t.count, 'joints': list(t.joints)}
            for t in found.topics
        ],
        'samples': len(found.recording),
        'sampling': asdict(found.sampling),
        'joints': [asdict(joint) for joint in found.joints],
        'remarks': [asdict(remark) for remark in found.remarks],
        'trial': trial,
        'verdict': found.verdict,
    }


def notes_on(robot: Robot) -> list[str]:
    """Return the texts of notes on a robot description; undriven joints share one note."""
    held = {f"joint '{joint.name}'" for joint in held_joints(robot)}
    others = [note for note in robot.notes if note.partition(': not')[0] not in held]
    return list(
        dict.fromkeys([*robot.description.inertia_doubts(), *driven_in_words(robot), *others])
    )


def worst_first(remarks: Iterable[Remark]) -> tuple[Remark, ...]:
    """Sort remarks from the worst to the mildest; equally bad remarks keep their order."""
    return tuple(sorted(remarks, key=lambda remark: get_args(Weight).index(remark.weight)))


def _contains_any(text: str, others: Iterable[str]) -> bool:
    return any(other.casefold() in text.casefold() for other in others)


def _fit_remarks(trial: TrialFit, known: Sequence[str]) -> Iterator[Remark]:
    """Yield remarks on faults that only the trial identification has found."""
    weight: Weight = 'bad' if trial.grade == 'unusable' else 'doubt'
    others = [*known, *trial.elsewhere]
    yield from (
        Remark(weight, fault) for fault in trial.faults if not _contains_any(fault, others)
    )
    if trial.poor and not trial.faults:
        yield Remark(
            'doubt',
            f'rigid body and friction do not explain {", ".join(trial.poor)}; check axes, zero '
            'positions and units of the description, and look for contact',
        )


def _time_remarks(recording: Recording, sampling: Sampling) -> Iterator[Remark]:
    """Yield remarks on damaged data, time stamps, gaps, jitter and a motion without repetition."""
    report = recording.report
    if report.damage:
        yield Remark('doubt', report.damage)
    if report.clock_note:
        yield Remark('doubt', f'time is the time of reception: header stamps {report.clock_note}')
    lost = report.duplicates + report.out_of_order + report.restarted + report.nan
    rounded = rounded_stamps(recording)
    if rounded:
        yield Remark('doubt', rounded)
    elif lost or report.malformed or report.unstamped or report.incomplete:
        yield Remark('doubt', report.describe())
    if report.unwrapped:
        joints = ', '.join(report.unwrapped)
        yield Remark('note', f'position jumps by whole turns were removed: {joints}')
    if sampling.gaps:
        yield Remark(
            'doubt',
            f'{sampling.gaps} {"gap" if sampling.gaps == 1 else "gaps"} in time, the longest '
            f'{sampling.longest_step:.3g} s; segments between gaps are filtered separately',
        )
    # with more jitter, derivatives are inaccurate
    if sampling.jitter > 0.2:
        yield Remark(
            'doubt',
            f'steps between samples vary by {100 * sampling.jitter:.0f} %; velocities and '
            'accelerations from the positions are less accurate',
        )
    yield from (Remark('doubt', text) for text in short_recording_note([recording]))
    if sampling.period is None:
        yield Remark(
            'note',
            'the motion does not repeat; two periods of one excitation separate noise from '
            'model error',
        )


def _unit_remarks(
    recording: Recording, joints: tuple[JointFacts, ...], robot: Robot | None
) -> Iterator[Remark]:
    """Yield remarks on units of positions, and on velocities that contradict positions."""
    if robot is not None:
        yield from (Remark('doubt', text) for text in beyond_limits(robot, [recording]))
    turned = [
        joint
        for k, joint in enumerate(joints)
        if max(abs(joint.lower), abs(joint.upper)) > 4.0 * np.pi  # two turns
        and not (robot is not None and robot.prismatic[k])
    ]
    if turned:
        named = ', '.join(f'{j.name} reaches {max(-j.lower, j.upper):.4g}' for j in turned[:3])
        yield Remark('doubt', f'{named}: are positions in degrees, or of motors before a gear?')
    if recording.dq is None:
        yield Remark('note', 'no velocities; they are computed from positions')
        return
    for fault in velocity_faults(recording):
        yield Remark('doubt' if fault.word == 'good' else 'bad', fault.what)
    empty = [j.name for j in joints if j.velocity_ratio == 0.0]  # noqa: RUF069 - zeros as recorded
    if empty:
        yield Remark('doubt', f'velocities of {", ".join(empty)} are zero, but positions change')


def _motion_remarks(joints: tuple[JointFacts, ...], sampling: Sampling) -> Iterator[Remark]:
    """Yield remarks on joints at rest, and on joints with many repeated encoder readings."""
    still = [joint.name for joint in joints if joint.still]
    if len(still) == len(joints):
        yield Remark('bad', 'no joint moves')
    elif still:
        yield Remark('note', f'at rest throughout: {", ".join(still)}')
    coarse = [j.name for j in joints if j.repeated > 0.5]
    if coarse:
        yield Remark(
            'doubt',
            f'positions of {", ".join(coarse)} repeat in most samples while they move: the '
            f'encoder is read slower than at {sampling.rate_hz:.4g} Hz, or its steps are coarse',
        )


def _effort_remarks(joints: tuple[JointFacts, ...], trial: TrialFit | None) -> Iterator[Remark]:
    """Yield remarks on efforts that are missing, constant or in wrong units."""
    if joints[0].effort_rms is None:
        yield Remark('bad', 'no efforts: nothing can be identified; is JointState.effort filled?')
        return
    silent = [joint.name for joint in joints if not joint.effort_varies]
    if silent and not (trial is not None and SILENT in trial.refused):
        weight: Weight = 'bad' if len(silent) == len(joints) else 'doubt'
        yield Remark(weight, f'efforts of {", ".join(silent)} never change')
    if trial is None or trial.scale is None or trial.faults:
        return
    known = np.flatnonzero(np.isfinite(trial.scale))
    off = [k for k in known if not 0.4 < trial.scale[k] < 2.5]
    if len(off) >= max(1, len(known) / 2):
        named = ', '.join(f'{joints[k].name} {trial.scale[k]:.3g}' for k in off)
        yield Remark(
            'doubt',
            f'efforts are multiples of the described torques ({named}): they may be currents or '
            'motor torques, or described masses are wrong; --current-gain scales efforts',
        )
