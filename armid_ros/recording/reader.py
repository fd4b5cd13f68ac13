# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read the joint measurements of a bag of ROS 2 or ROS 1, or of a table."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
import struct
from typing import TYPE_CHECKING

from armid_ros.errors import nearest, RecordingError
from armid_ros.files import reading
from armid_ros.recording.bag import Bag, is_bag_file
from armid_ros.recording.columns import (
    ColumnSettings,
    in_si,
    name_in_file,
    refuse_columns,
    renamed,
    renaming,
)
from armid_ros.recording.joint_state.conversion import holds_joint_state, joint_state_blocks
from armid_ros.recording.joint_state.decoder import JointSamples, JointStateDecoder
from armid_ros.recording.message_types import BYTE_ORDERS, JOINT_STATE, STRING
from armid_ros.recording.recording import PositionRange, Recording
from armid_ros.recording.series import assemble
from armid_ros.recording.source import DEFAULT, ReadSettings, Topic
from armid_ros.recording.temperature import read_temperatures
import numpy as np

if TYPE_CHECKING:
    from armid_ros.recording.tables import TablePlan

#: Callback that shows the plan of a table.
Show = Callable[['TablePlan'], None]
#: Package that reads tables, a plug-in.
_TABLES = 'armid_ros.recording.tables'


def read_recording(
    path: str | Path,
    *,
    joints: Sequence[str] | None = None,
    topic: str | None = None,
    columns: ColumnSettings | None = None,
    slides: Sequence[bool] | None = None,
    show: Show | None = None,
    settings: ReadSettings = DEFAULT,
) -> Recording:
    """
    Read the measurements of some joints from a bag or a table.

    Parameters
    ----------
    path : str or Path
        A rosbag2 directory (MCAP or SQLite, split, compressed, with or without metadata.yaml), a
        file .mcap, .db3 or (ROS 1) .bag, or a table: CSV, NPZ, MAT, Parquet, or the folder of a
        LeRobot dataset. A bag truncated by a crash is read up to its end.
    joints : sequence of str, optional
        Joints to read, in this order; by default all of the table or topic. Of other joints, such
        as a gripper's, only the range of the positions is kept.
    topic : str, optional
        Topic of sensor_msgs/JointState. The default is the only topic of this type, or the only
        one that names all joints. Of several such topics the one called 'joint_states' is taken.
        If no topic names all joints, topics are combined that name each joint once. Without
        ``joints``, the default is the topic with the most messages.
    columns : ColumnSettings, optional
        Which columns of a table hold which quantity, in which unit. Missing settings are guessed
        from the file. Names, units, zeros and gears apply to bags too; columns and rate do not.
    slides : sequence of bool, optional
        Whether each joint is prismatic. Positions of prismatic joints are never in degrees.
    show : callable, optional
        Called with the plan of a table before the table is read.
    settings : ReadSettings
        Whether checksums are compared, and the memory limit.

    Returns
    -------
    Recording
        Samples in order of time, without repeated stamps and non-finite values. The report lists
        dropped and repaired messages. Time is taken from the message headers. If header stamps are
        zero, stand still or jump, the time of reception is used and ``clock`` is 'receive'.

    Raises
    ------
    RecordingError
        If the file or topic does not exist, a joint is not named, no usable sample remains, or the
        memory limit is exceeded. The message names the file, the topic, joint, column or line,
        and the remedy.

    """
    path = Path(path)
    columns = columns or ColumnSettings()
    if is_table(path):
        return read_tables([path], columns, joints, slides, show)
    if columns.temperature == 'none':
        columns = replace(columns, temperature=None)
        settings = replace(settings, temperatures=False)
    refuse_columns(path, columns)
    rules = columns.rename
    if joints is not None:
        joints = [name_in_file(joint, rules) for joint in joints]
        if not joints or len(set(joints)) != len(joints):
            raise RecordingError(
                f'{path}: at least one joint has to be named, and each only once; got {joints}'
            )
    recording = _read_bag(path, joints, topic, settings)
    if rules:
        recording = replace(
            recording,
            joints=tuple(renamed(joint, rules) for joint in recording.joints),
            others=tuple(replace(o, joint=renamed(o.joint, rules)) for o in recording.others),
        )
    return in_si(recording, columns, slides)


def _read_bag(
    path: Path, wanted: Sequence[str] | None, topic: str | None, settings: ReadSettings
) -> Recording:
    """Read some joints, by their names in the bag, with the numbers of the bag."""
    with Bag(path, settings) as bag:
        chosen = choose_topics(bag, wanted, topic)
        joints = tuple(named_joints(bag, chosen[0]) if wanted is None else wanted)
        decoder = JointStateDecoder(joints, sum(one.count for one in chosen))
        name = ' + '.join(one.name for one in chosen)
        pieces, size = [], 0
        for piece in chain.from_iterable(_decoded(bag, one, decoder) for one in chosen):
            size += piece.nbytes
            settings.require(size, f'{path}: {name}: the recording')
            pieces.append(piece)
        recording = assembled(path, name, joints, pieces, decoder, bag.damage)
        measured = read_temperatures(bag, recording) if settings.temperatures else None
    return replace(recording, temperature=measured) if measured else recording


def is_table(path: Path) -> bool:
    """Return whether a path is a table; without the package `tables`, all but bags are tables."""
    if find_spec(_TABLES) is None:
        return path.is_file() and not is_bag_file(path)
    from armid_ros.recording import tables

    return tables.is_table(path)


def read_tables(
    paths: Sequence[Path],
    columns: ColumnSettings,
    joints: Sequence[str] | None = None,
    slides: Sequence[bool] | None = None,
    show: Show | None = None,
) -> Recording:
    """
    Read the measurements of some joints from tables of the same samples.

    Parameters
    ----------
    paths : sequence of Path
        Files with the columns of the same samples.
    columns : ColumnSettings
        Which columns hold which quantity, in which unit; missing settings are guessed.
    joints : sequence of str, optional
        Joints to read, in this order; by default named by the columns.
    slides : sequence of bool, optional
        Whether each joint is prismatic.
    show : callable, optional
        Called with the plan before the columns are converted.

    Raises
    ------
    RecordingError
        If a file cannot be read, or the package that reads tables is not installed.

    """
    if find_spec(_TABLES) is None:
        raise RecordingError(
            f'{paths[0]}: not a bag; reading a table needs {_TABLES}, which this installation '
            'does not have'
        )
    from armid_ros.recording.tables import measured, open_table, plan, side_by_side

    table = side_by_side([open_table(path, episode=columns.episode) for path in paths])
    settled = plan(table, columns, joints, slides)
    if show is not None:
        show(settled)
    return measured(settled)


def assembled(
    path: str | Path,
    topic: str,
    joints: tuple[str, ...],
    pieces: list[JointSamples],
    decoder: JointStateDecoder,
    damage: str,
) -> Recording:
    """Assemble the recording of joints in messages, and free the memory of the messages."""
    where = f'{path}: {topic}'
    if not decoder.messages:
        raise RecordingError(f'{where} has no messages')
    if not decoder.names_seen:
        raise RecordingError(
            f'{where}: none of the {decoder.messages} messages names a joint; '
            f'{decoder.first_problem or "the names are empty"}'
        )
    missing = [joint for joint in joints if joint not in decoder.names_seen]
    if missing:
        listed = ', '.join(f"'{name}'" for name in missing)
        others = [name for name in decoder.names_seen if name not in joints]
        found, rule = nearest(missing[0], others), renaming(missing, others)
        present = ','.join(name for name in joints if name in decoder.names_seen)
        hint = f'; --joints {present} reads the others' if present else ''
        if rule:
            hint = f'; if only the names differ, use --rename {rule}{hint}'
        elif found:
            hint = f"; if '{found}' is '{missing[0]}', use --rename {found}:{missing[0]}{hint}"
        ask = '' if present or rule else ': is it a recording of another robot?'
        raise RecordingError(
            f'{where} does not name {"joint" if len(missing) == 1 else "joints"} {listed}{ask}; '
            f'its joints are {", ".join(decoder.names_seen)}{hint}'
        )
    if damage:
        damage = f'of a damaged bag {decoder.messages} messages could be read: {damage}'
    with reading(where, RecordingError):
        return assemble(
            where,
            joints,
            pieces,
            {
                'messages': decoder.messages,
                'malformed': decoder.malformed,
                'damage': damage,
            },
            source=str(path),
            topic=topic,
            others=tuple(PositionRange(name, *ends) for name, ends in decoder.others.items()),
        )


def read_pieces(
    path: str | Path,
    *,
    joints: Sequence[str],
    topic: str | None = None,
    samples: int,
    keep: Callable[[Recording], int],
    settings: ReadSettings = DEFAULT,
) -> Iterator[tuple[Recording, bool]]:
    """
    Yield the measurements of some joints in pieces, in the order of storage.

    Parameters
    ----------
    path, joints, topic, settings
        See ``read_recording``.
    samples : int
        Largest number of new messages per piece. Messages kept from the previous piece come on
        top.
    keep : callable
        Called with every piece but the last. Messages before the stamp that it returns [ns] are
        dropped.

    Yields
    ------
    piece : Recording
        Part of the recording; times count from its first sample.
    last : bool
        Whether the piece is the last one.

    Raises
    ------
    RecordingError
        See ``read_recording``.

    """
    joints = tuple(joints)
    with Bag(path, settings) as bag:
        chosen, *others = choose_topics(bag, joints, topic)
        if others:
            raise RecordingError(
                f'{path}: joints are spread over the topics {chosen.name} and {others[0].name}, '
                'so the bag cannot be read in pieces: merge the topics with joint_state_merger'
            )
        decoder = JointStateDecoder(joints)
        held: list[JointSamples] = []
        new = 0

        def made(damage: str = '') -> Recording:
            return assembled(path, chosen.name, joints, list(held), decoder, damage)

        for states in _decoded(bag, chosen, decoder):
            for start in range(0, len(states), samples):
                part = states.select(slice(start, start + samples))
                if new and new + len(part) > samples:
                    piece = made()
                    yield piece, False
                    stamp, new = keep(piece), 0
                    times = [
                        one.stamps if piece.clock == 'header' else one.receive for one in held
                    ]
                    late = [np.flatnonzero(t >= stamp) for t in times if t is not None]
                    held = [one.select(k) for one, k in zip(held, late, strict=True) if len(k)]
                held.append(part)
                new += len(part)
        yield made(bag.damage), True


def _decoded(bag: Bag, topic: Topic, decoder: JointStateDecoder) -> Iterator[JointSamples]:
    """Yield the samples of a topic."""
    with reading(bag.path, RecordingError):
        for block in joint_state_blocks(bag, topic):
            yield from decoder.decode(block)


def choose_topics(bag: Bag, joints: Sequence[str] | None, wanted: str | None) -> tuple[Topic, ...]:
    """Return the topic to read, or several topics that together name all joints."""
    there = [topic for topic in bag.topics() if holds_joint_state(topic)]
    candidates = [topic for topic in there if topic.type_name == JOINT_STATE] or there
    if wanted is not None or not candidates:
        return (bag.topic_of(JOINT_STATE, wanted, holds_joint_state),)
    if joints is None or len(candidates) == 1:
        return (max(candidates, key=lambda topic: topic.count),)
    names = {topic.name: named_joints(bag, topic) for topic in candidates}
    complete = [topic for topic in candidates if set(joints) <= set(names[topic.name])]
    if len(complete) > 1:
        plain = [topic for topic in complete if topic.name.split('/')[-1] == 'joint_states']
        complete = plain if len(plain) == 1 else complete
    if len(complete) == 1:
        return (complete[0],)
    parts = tuple(one for one in candidates if set(joints) & set(names[one.name]))
    between = [name for one in parts for name in names[one.name]]
    if not complete and set(joints) <= set(between) and len(between) == len(set(between)):
        return parts
    listed = '; '.join(f'{name} names {", ".join(n) or "none"}' for name, n in names.items())
    which = 'several topics name' if complete else 'no topic names'
    raise RecordingError(
        f'{bag.path}: {which} all of {", ".join(joints)}; choose a topic to read: {listed}'
    )


def named_joints(bag: Bag, topic: Topic) -> tuple[str, ...]:
    """Return the joints that the first messages of a topic name."""
    decoder = JointStateDecoder(())
    for block in joint_state_blocks(bag, topic):
        for _ in decoder.decode(block):
            pass
        if decoder.messages >= 1000:
            break
    return decoder.names_seen


def topics(path: str | Path, settings: ReadSettings = DEFAULT) -> tuple[Topic, ...]:
    """
    Return the topics of a bag, with types, definitions, QoS and counts.

    Topics of JointState have the names of their joints, too.

    Raises
    ------
    RecordingError
        If the path is not a readable bag.

    """
    with Bag(path, settings) as bag:
        return tuple(
            replace(topic, joints=named_joints(bag, topic)) if holds_joint_state(topic) else topic
            for topic in bag.topics()
        )


def read_robot_description(path: str | Path, settings: ReadSettings = DEFAULT) -> str | None:
    """
    Return the robot description in a bag.

    Parameters
    ----------
    path : str or Path
        A rosbag2 directory, or a bare file.
    settings : ReadSettings
        Whether checksums are compared, and the memory limit.

    Returns
    -------
    str or None
        The last message on a std_msgs/String topic whose name ends in 'robot_description'; None
        without such a topic.

    Raises
    ------
    RecordingError
        If the bag cannot be read, or holds different descriptions on several topics.

    """
    with Bag(path, settings) as bag:
        texts: dict[str, str] = {}
        for topic in bag.topics():
            if topic.type_name != STRING or not topic.name.endswith('robot_description'):
                continue
            for block in bag.blocks(topic.name):
                cdr = block.message(len(block) - 1)
                order = BYTE_ORDERS.get(cdr[:2])
                if order is None or len(cdr) < 8:
                    continue
                (length,) = struct.unpack_from(order + 'I', cdr, 4)
                text = cdr[8 : 8 + length].rstrip(b'\0').decode('utf-8', 'replace')
                if text and length <= len(cdr) - 8:
                    texts[topic.name] = text
    if len(set(texts.values())) > 1:
        raise RecordingError(
            f'{path}: holds the descriptions of several robots ({", ".join(texts)}); '
            'save the description of the right arm as a URDF file'
        )
    return next(iter(texts.values()), None)
