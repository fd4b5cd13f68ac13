# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Inspection of a recording, and check of a robot description."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TYPE_CHECKING

from armid_ros.api.arguments import (
    RecordingLike,
    recordings_of,
    Rng,
    robot_of,
    RobotLike,
    source_of,
    topics_of,
    USUAL,
)
from armid_ros.api.identification import identify
from armid_ros.api.table import data_frame, Shown, Summary
from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError, RecordingError
from armid_ros.identification.rows.checks import MIN_CORRELATION, torque_factors
from armid_ros.inspection import (
    check_links,
    description_remarks,
    Inspection,
    inspection_document,
    LinkCheck,
    Remark,
)
from armid_ros.inspection import inspect as look
from armid_ros.inspection.facts import TrialFit
from armid_ros.inspection.inspect import SCHEMA
from armid_ros.recording import Recording, Topic
from armid_ros.recording.reader import read_recording
from armid_ros.report.inspection_report import (
    check_word,
    description_check_report,
    headline,
    HEADS,
    inspection_report,
    inspection_word,
    joint_heads,
    joint_rows,
    link_rows,
    recording_facts,
)
from armid_ros.report.notation import robot_label
from armid_ros.report.provenance import DEFAULT_ORIGIN, ResultOrigin
from armid_ros.robots import Robot
import numpy as np

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, repr=False, eq=False)
class InspectionResult(Shown):
    """
    Result of the inspection of a recording.

    Attributes
    ----------
    core : Inspection
        Everything that the inspection found.

    Examples
    --------
    >>> import armid_ros as ar
    >>> found = ar.inspect('my_arm.urdf', 'monday')
    >>> found.report('inspection.html').name
    'inspection.html'

    """

    core: Inspection

    schema = SCHEMA
    files = ('inspection.json', 'inspection.html')

    @property
    def remarks(self) -> tuple[str, ...]:
        """Return remarks for the user, the most serious first."""
        return tuple(remark.text for remark in self.core.remarks)

    @property
    def recording(self) -> Recording:
        """Return the inspected recording."""
        return self.core.recording

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a pandas table with ranges, speeds and efforts of the joints."""
        return data_frame(self.core.joints)

    def document(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> dict[str, Any]:
        """Return the document that ``armid inspect --json`` prints."""
        return inspection_document(self.core)

    def page(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> str:
        """Return the text of inspection.html with the recorded curves of all joints."""
        return inspection_report(self.core, self.with_step(origin))

    def summary(self) -> Summary:
        """Return the terminal summary: verdict, joints, remarks and sampling."""
        heads, found = joint_heads(self.core), self.core
        trial = found.trial
        good = trial is not None and not trial.refused and trial.grade != 'unusable'
        fix = 'Correct the recording as stated, or record again; then inspect the new recording.'
        topics = [
            f'{one.name}: {one.count} x {one.type_name}'
            + ' (read)' * (one.name == found.recording.topic)
            for one in found.topics
        ]
        fitness = f'{found.recording.source}: {found.verdict}'
        faulty = any(remark.weight == 'bad' for remark in found.remarks)
        first, *others = [*self.remarks, fitness] if faulty else [fitness, *self.remarks]
        return Summary(
            first,
            inspection_word(found),
            heads=heads[:4] + heads[7:],
            rows=[row[:4] + row[7:] for row in joint_rows(found)],
            lines=(
                *others,
                *(f'{name}: {value}' for name, value in recording_facts(found)),
                *topics,
            ),
            steps=[] if good or trial is None else [fix],
            then='identify' if good else 'inspect' if found.robot is None else '',
        )


def inspect(
    robot: RobotLike | RecordingLike | None = None,
    recording: RecordingLike | None = None,
    *,
    topics: tuple[Topic, ...] | None = None,
    rng: Rng = 0,
) -> InspectionResult:
    """
    Inspect a recording: rate, gaps, ranges, suspicious units, fitness for identification.

    Parameters
    ----------
    robot : model, robot, name or path, optional
        Robot for the checks of limits and units, and for a trial identification.
    recording : Recording or path
        Bag or table; the only argument if no robot is given.
    topics : tuple of Topic, optional
        All topics of the bag; by default read from the bag if no robot is given.
    rng : int or Generator
        Seed, or source of randomness.

    Returns
    -------
    InspectionResult
        Prints as a table; ``remarks``, ``report``.

    Raises
    ------
    ArmidError
        If the file or the description cannot be read. The message names it and the remedy.

    Examples
    --------
    >>> import armid_ros as ar
    >>> ar.inspect('my_arm.urdf', 'monday').remarks
    ()

    """
    if recording is None:  # the only argument is the recording
        robot, recording = None, robot
    if recording is None or isinstance(recording, Robot | ArmModel):
        raise RecordingError('no recording was given: give a bag, a table or a Recording')
    if isinstance(robot, Recording):
        raise RecordingError('two recordings were given: the first argument has to be the robot')
    described = None if robot is None else robot_of(robot)
    if described is not None:
        (read,) = recordings_of(recording, described)
    elif isinstance(recording, Recording):
        read = recording
    else:
        topics = topics_of(Path(recording)) if topics is None else topics
        read = read_recording(recording)
    trial = None if described is None else _trial_fit(described, read, rng)
    return InspectionResult(look(read, described, trial, topics=topics or ()))


def _trial_fit(robot: Robot, recording: Recording, rng: Rng) -> TrialFit:
    """Return the quality of an identification from one recording, or the reason for none."""
    try:
        found = identify(robot, recording, physical=False, rng=rng)
        motions = [fit.motion for fit in found.core.training]
        factors, correlation = torque_factors(ArmModel(robot), motions)
        scale = np.where(np.abs(correlation) > MIN_CORRELATION, factors, np.nan)
        return TrialFit.of(found.core, found.graded, recording, scale)
    except ArmidError as refusal:
        return TrialFit(refused=str(refusal))


@dataclass(frozen=True, repr=False, eq=False)
class CheckResult(Shown):
    """
    Result of the check of a robot description, with or without recordings.

    Attributes
    ----------
    robot : Robot
        The robot as described.
    remarks : tuple of Remark
        Impossible and doubtful values, the worst first.
    links : LinkCheck or None
        Described and measured masses and centres of mass; None without a recording.

    """

    robot: Robot
    remarks: tuple[Remark, ...]
    links: LinkCheck | None

    schema = 'armid/check/1'
    files = ('check.json', 'report.html')

    @property
    def finding(self) -> str:
        """Return the result of the check in one sentence."""
        return headline(self.remarks, self.links)[0]

    @property
    def wrong(self) -> bool:
        """Whether a value of the description is impossible, or a recording contradicts a link."""
        impossible = any(one.weight == 'bad' for one in self.remarks)
        return impossible or (self.links is not None and not self.links.agrees)

    def document(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> dict[str, Any]:
        """Return the document that ``armid check --json`` prints."""
        links = {} if self.links is None else asdict(self.links)
        numbers = {name: v.tolist() for name, v in links.items() if hasattr(v, 'tolist')}
        return {
            'schema': self.schema,
            'robot': self.robot.name,
            'finding': self.finding,
            'remarks': [asdict(one) for one in self.remarks],
            'check': links | numbers or None,
        }

    def page(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> str:
        """Return the text of report.html with a table of the links."""
        return description_check_report(
            self.remarks, self.links, self.with_step(origin, self.robot)
        )

    def summary(self) -> Summary:
        """Return the terminal summary: finding, masses and centres of mass of the links."""
        links = self.links
        wrong = links is not None and not np.isnan(links.measured_mass).all()
        columns = slice(None) if wrong else slice(0, 4, 2)
        rows = (
            []
            if links is None
            else [(links.links[k], *row[1:5][columns]) for k, row in enumerate(link_rows(links))]
        )
        first, *others = headline(self.remarks, links)
        lines = [*others, *(one.text for one in self.remarks if one.weight == 'note')]
        heads = (HEADS[0], *HEADS[1:5][columns]) if rows else ()
        then = 'excite' if links is None else 'inspect' if links.fault else 'identify'
        steps, source = [], robot_label(source_of(self.robot))
        impossible = [one.text.split(':')[0] for one in self.remarks if one.weight == 'bad']
        if impossible:
            where = ', '.join(dict.fromkeys(impossible))
            steps, then = [f'Correct {where} in {source}, and check it again.'], ''
            if links is None:
                steps.append(f'Then check the masses with a recording: armid check {source} BAG.')
        word = check_word(self.remarks, links)
        return Summary(first, word, heads, rows, lines, steps, then)


def check(
    robot: RobotLike,
    recordings: RecordingLike | Sequence[RecordingLike] = (),
    *,
    effects: str = USUAL,
    rng: Rng = 0,
) -> CheckResult:
    """
    Find impossible values of a description, and links that a recording contradicts.

    Parameters
    ----------
    robot : robot, model, name or path
        The description.
    recordings : recording or path, or several, optional
        Recordings with torques; by default only the values of the description are checked.
    effects : str
        Effects of the arm besides the rigid body: catalogue names with commas.
    rng : int or Generator
        Seed, or source of randomness.

    Returns
    -------
    CheckResult
        Prints its finding; ``remarks``, ``links``, ``report``, ``save``.

    Raises
    ------
    ArmidError
        If the description or a recording cannot be used. The message names it and the remedy.

    Examples
    --------
    >>> import armid_ros as ar
    >>> ar.check('my_arm.urdf').wrong
    False
    >>> print(ar.check('my_arm.urdf', 'friday').finding)
    The URDF is 0.3... ± 0... kg too light at elbow, if the other links are right.

    """
    described = robot_of(robot)
    remarks = description_remarks(described)
    read = recordings_of(recordings, described)
    if not read:
        return CheckResult(described, remarks, None)
    found = identify(described, read, effects=effects, physical=False, rng=rng)
    graded = found.graded
    fault = next(iter(graded.faults), graded.reasons[0] if graded.word == 'unusable' else '')
    links = check_links(found.core, described, found.grade, fault)
    return CheckResult(described, remarks, links)
