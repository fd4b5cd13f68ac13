# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is in a recording, and what is wrong with it."""

from __future__ import annotations

from pathlib import Path
import textwrap

from armid_ros.cli import columns, options
from armid_ros.cli.origin import provenance
from armid_ros.cli.terminal import print_rows, progress, say
from armid_ros.errors import RecordingError
from armid_ros.files import json_text, write_file
from armid_ros.files.cells import listed
from armid_ros.inspection import inspect as look
from armid_ros.inspection import Inspection, inspection_document
from armid_ros.inspection.output import SCHEMA
from armid_ros.recording import Recording
from armid_ros.recording.anything import read_anything
from armid_ros.recording.contents import bag_contents, TopicContent
from armid_ros.recording.message_types import JOINT_STATE
from armid_ros.recording.ros1 import is_ros1
from armid_ros.recording.tables import is_table, measured, open_table, plan
from armid_ros.report.inspection_report import inspection_report
from armid_ros.report.notation import counted, plain
from armid_ros.report.sections.inspection import joint_heads, joint_rows, repetition
import click
import numpy as np

_SIGNS = {'bad': 'x', 'doubt': '!', 'note': '-'}


def inspect(
    bag: Path,
    robot_source: str | None,
    out: Path | None,
    topic: str | None,
    gravity: str,
    joints: str | None,
    seed: int,
    as_json: bool,
) -> None:
    """Look at a recording: a bag, or a table."""
    staged = None if out is None else options.stage(out, SCHEMA, robot_source or '')
    robot = None
    if robot_source is not None:
        robot = options.open_robot(robot_source, gravity, joints, [bag])
    topics = () if is_table(bag) or is_ros1(bag) else bag_contents(bag, options.read_settings())
    with progress('reading') as tick:
        if robot is None:
            recording = _without_robot(bag, topics, topic, joints)
        else:
            (recording,) = columns.read([bag], robot, topic, options.read_settings())
        tick(0.5, 'trying to identify' if robot else 'looking')
        found = look(recording, robot, topics=topics, rng=np.random.default_rng(seed))
    if staged is not None:
        page = inspection_report(
            found, robot=robot_source or '', provenance=provenance([bag], seed=seed)
        )
        write_file(staged.folder / 'inspection.html', page)
        staged.keep()
    if as_json:
        click.echo(json_text(inspection_document(found)))
        return
    _print(found)
    if out is not None:
        say(f'{out}: inspection.html')


def _without_robot(
    bag: Path, topics: tuple[TopicContent, ...], topic: str | None, joints: str | None
) -> Recording:
    """Read the joints that are named, or all that the topic or the table has."""
    said = columns.settings()
    wanted = list(listed(joints)) if joints else None
    if is_table(bag):
        settled = plan(open_table(bag, episode=said.episode), said, wanted)
        for line in settled.lines():
            click.echo(line, err=True)
        return measured(settled)
    if is_ros1(bag) and wanted is None:
        raise RecordingError(f'{bag}: of a bag of ROS 1 say which joints: --robot or --joints')
    if wanted is None:
        chosen = _topic(bag, topics, topic)
        topic, wanted = chosen.name, list(chosen.joints)
    return read_anything(
        bag, joints=wanted, topic=topic, columns=said, settings=options.read_settings()
    )


def _topic(bag: Path, topics: tuple[TopicContent, ...], wanted: str | None) -> TopicContent:
    """Return the topic to look at: the one wanted, or the one with most messages."""
    of_joints = [topic for topic in topics if topic.joints]
    if wanted is not None:
        of_joints = [t for t in of_joints if t.name.lstrip('/') == wanted.lstrip('/')]
    if not of_joints:
        listed = ', '.join(f'{t.name} ({t.type_name}, {t.count} messages)' for t in topics)
        named = f'{wanted} of ' if wanted else 'topic of '
        raise RecordingError(f'{bag}: no {named}{JOINT_STATE}; there are {listed or "no topics"}')
    return max(of_joints, key=lambda topic: topic.count)


def _print(found: Inspection) -> None:
    """Print within 80 columns."""
    recording, sampling = found.recording, found.sampling
    say(f'{recording.source}')
    for topic in found.topics:
        read = ' <- read' if topic.name == recording.topic else ''
        say(f'  {topic.name}  {topic.count} x {topic.type_name}{read}')
    say(
        f'  {sampling.duration:.2f} s, {len(recording)} samples, {plain(sampling.rate_hz, 4)} Hz, '
        f'steps vary by {100 * sampling.jitter:.1f} %'
    )
    gaps = counted(sampling.gaps, 'gap') if sampling.gaps else 'no gaps'
    say(
        f'  {gaps}, longest step {plain(1000 * sampling.longest_step)} ms; motion '
        f'{repetition(found)}'
    )
    heads = joint_heads(found)
    rows = [dict(zip(heads, row, strict=True)) for row in joint_rows(found)]
    for row in rows:
        del row['step']
    print_rows(rows, as_json=False, right=heads[1:], spare=('moving', heads[3]))
    for remark in found.remarks:
        say(_wrapped(f'{_SIGNS[remark.weight]} {remark.text}'))
    say(_wrapped(found.verdict, ''))


def _wrapped(text: str, indent: str = '  ') -> str:
    return textwrap.fill(
        text, 80, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )
