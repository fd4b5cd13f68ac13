# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read joint measurements from a bag of ROS 2 or ROS 1, or from a table."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
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
from armid_ros.recording.message_types import JOINT_STATE, STRING
from armid_ros.recording.recording import PositionRange, Recording
from armid_ros.recording.series import assemble
from armid_ros.recording.source import DEFAULT, ReadSettings, Topic
from armid_ros.recording.temperature import read_temperatures
import numpy as np

if TYPE_CHECKING:
    from armid_ros.recording.tables import TablePlan

#: Callback that shows the columns and units chosen for a table.
Show = Callable[['TablePlan'], None]
#: Plug-in package that reads tables.
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
    Read positions, velocities and torques of joints from a bag or a table.

    Parameters
    ----------
    path : str or Path
        A rosbag2 directory (MCAP or SQLite, split, compressed, with or without metadata.yaml), a
        file .mcap, .db3 or (ROS 1) .bag, or a table: CSV, NPZ, MAT, Parquet, or the folder of a
        LeRobot dataset. A bag truncated by a crash is read up to its end.
    joints : sequence of str, optional
        Joints to read, in this order; by default all joints of the table or topic. Only the range
        of positions is kept of other joints, such as those of a gripper.
    topic : str, optional
        Topic of sensor_msgs/JointState. The default is the only topic of this type, or the only
        topic that has all joints. If several topics have all joints, 'joint_states' is read. If no
        topic has all joints, topics are combined that have each joint once. Without ``joints``,
        the default is the topic with the most messages.
    columns : ColumnSettings, optional
        Columns and units of the quantities of a table. Missing settings are guessed from the file.
        Names, units, zeros and gears apply to bags too; columns and rate do not.
    slides : sequence of bool, optional
        Whether each joint is prismatic. Positions of prismatic joints are never in degrees.
    show : callable, optional
        Called with the columns and units chosen for a table, before the table is converted.
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
                f'{path}: give at least one joint, and each joint once; the given joints are '
                f'{", ".join(joints) or "none"}'
            )
    with Bag(path, settings) as bag:
        chosen = choose_topics(bag, joints, topic)
        names = tuple(named_joints(bag, chosen[0]) if joints is None else joints)
        decoder = JointStateDecoder(names, sum(one.count for one in chosen))
        topic_names = ' + '.join(one.name for one in chosen)
        pieces, size = [], 0
        for piece in chain.from_iterable(_decoded(bag, one, decoder) for one in chosen):
            size += piece.nbytes
            settings.require(size, f'{path}: {topic_names}: the recording')
            pieces.append(piece)
        recording = assembled(path, topic_names, names, pieces, decoder, bag.damage)
        measured = read_temperatures(bag, recording) if settings.temperatures else None
    recording = replace(recording, temperature=measured) if measured else recording
    if rules:
        recording = replace(
            recording,
            joints=tuple(renamed(joint, rules) for joint in recording.joints),
            others=tuple(replace(o, joint=renamed(o.joint, rules)) for o in recording.others),
        )
    return in_si(recording, columns, slides)


def is_table(path: Path) -> bool:
    """Return whether a path is a table or, without the plug-in `tables`, any file but a bag."""
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
    Read joint measurements from one table, or from several tables with the same rows.

    Parameters
    ----------
    paths : sequence of Path
        Files with the columns of the same samples.
    columns : ColumnSettings
        Columns and units of the quantities; missing settings are guessed.
    joints : sequence of str, optional
        Joints to read, in this order; by default those in the column names.
    slides : sequence of bool, optional
        Whether each joint is prismatic.
    show : callable, optional
        Called with the chosen columns and units before the columns are converted.

    Raises
    ------
    RecordingError
        If a file cannot be read, or the package that reads tables is not installed.

    """
    if find_spec(_TABLES) is None:
        raise RecordingError(
            f'{paths[0]}: the file is not a bag, and reading a table needs {_TABLES}, which is '
            'not installed; reinstall armid_ros'
        )
    from armid_ros.recording.tables import converted, open_table, plan, side_by_side

    table = side_by_side([open_table(path, episode=columns.episode) for path in paths])
    chosen = plan(table, columns, joints, slides)
    if show is not None:
        show(chosen)
    return converted(chosen)


def assembled(
    path: str | Path,
    topic: str,
    joints: tuple[str, ...],
    pieces: list[JointSamples],
    decoder: JointStateDecoder,
    damage: str,
) -> Recording:
    """Build a recording from decoded samples; clear the list `pieces` to free memory."""
    where = f'{path}: {topic}'
    if not decoder.messages:
        raise RecordingError(f'{where}: the topic has no messages; record again')
    if not decoder.names_seen:
        raise RecordingError(
            f'{where}: none of the {decoder.messages} messages has the name of a joint; '
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
        question = ''
        if not present and not rule:
            question = '; is this another robot? If only the names differ, use --rename OLD:NEW'
        raise RecordingError(
            f'{where}: the messages lack {"joint" if len(missing) == 1 else "joints"} {listed}; '
            f'their joints are {", ".join(decoder.names_seen)}{question}{hint}'
        )
    if damage:
        damage = f'the bag is damaged, and {decoder.messages} messages could be read: {damage}'
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
    Read joints of a bag as successive short recordings, to limit the use of memory.

    Parameters
    ----------
    path, joints, topic, settings
        See ``read_recording``.
    samples : int
        Largest number of new messages per piece, in addition to those kept from the previous
        piece.
    keep : callable
        Called with every piece but the last; returns a stamp [ns]. The next piece begins with the
        messages after this stamp.

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
                f'{path}: the joints are on two topics, {chosen.name} and {others[0].name}, so '
                'the bag cannot be read in pieces; merge the topics with the node '
                'joint_state_merger'
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
    """Yield the decoded joint samples of a topic; each error message names the bag."""
    with reading(bag.path, RecordingError):
        for block in joint_state_blocks(bag, topic):
            yield from decoder.decode(block)


def choose_topics(bag: Bag, joints: Sequence[str] | None, wanted: str | None) -> tuple[Topic, ...]:
    """Return the JointState topic to read, or several topics that together contain all joints."""
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
    listed = '; '.join(f'{name} has {", ".join(n) or "none"}' for name, n in names.items())
    raise RecordingError(
        f'{bag.path}: {len(complete)} topics have all of the joints {", ".join(joints)}, but one '
        f'is needed; choose a topic to read with --topic: {listed}'
    )


def named_joints(bag: Bag, topic: Topic) -> tuple[str, ...]:
    """Return the joint names in the first thousand messages of a topic."""
    decoder = JointStateDecoder(())
    for block in joint_state_blocks(bag, topic):
        for _ in decoder.decode(block):
            pass
        if decoder.messages >= 1000:
            break
    return tuple(decoder.names_seen)


def topics(path: str | Path, settings: ReadSettings = DEFAULT) -> tuple[Topic, ...]:
    """
    Return the topics of a bag with message types, definitions, QoS profiles and counts.

    A JointState topic also has the names of its joints.

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
    Return the URDF in the last message of the topic '.../robot_description' of a bag.

    Parameters
    ----------
    path : str or Path
        A rosbag2 directory, or a bare file.
    settings : ReadSettings
        Whether checksums are compared, and the memory limit.

    Returns
    -------
    str or None
        Text of the last std_msgs/String message; None if the bag has no such topic.

    Raises
    ------
    RecordingError
        If the bag cannot be read, or has different descriptions on several topics.

    """
    with Bag(path, settings) as bag:
        texts: dict[str, str] = {}
        for topic in bag.topics():
            if topic.type_name != STRING or not topic.name.endswith('robot_description'):
                continue
            for block in bag.blocks(topic.name):
                text = bag.decoded(topic, block.message(len(block) - 1)).data
                if text:
                    texts[topic.name] = text
    if len(set(texts.values())) > 1:
        raise RecordingError(
            f'{path}: the topics {", ".join(texts)} have different robot descriptions; save the '
            'description of the right arm as a URDF file and give this file'
        )
    return next(iter(texts.values()), None)
