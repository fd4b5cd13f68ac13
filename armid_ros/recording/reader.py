# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Reads the joint measurements of a bag."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from armid_ros.errors import nearest, RecordingError
from armid_ros.files import reading
from armid_ros.motion import FloatArray
from armid_ros.recording.bag import Bag
from armid_ros.recording.joint_state.conversion import holds_joint_state, joint_state_blocks
from armid_ros.recording.joint_state.decoder import JointSamples, JointStateDecoder
from armid_ros.recording.message_types import JOINT_STATE
from armid_ros.recording.recording import PositionRange, Recording
from armid_ros.recording.series import (
    choose_clock,
    clock_problem,
    gather,
    MAX_NOT_FINITE,
    merged,
    not_finite,
    ordered,
    recorded,
)
from armid_ros.recording.settings import DEFAULT, ReadSettings
from armid_ros.recording.source import Topic
import numpy as np

_QUANTITIES = ('position', 'velocity', 'effort')
#: This many messages tell which joints a topic names.
_PEEK_MESSAGES = 1000


def read_recording(
    path: str | Path,
    *,
    joints: Sequence[str],
    topic: str | None = None,
    settings: ReadSettings = DEFAULT,
) -> Recording:
    """
    Read the measurements of some joints from a bag.

    Parameters
    ----------
    path : str or Path
        A rosbag2 directory (MCAP or SQLite, split, compressed, with or without metadata.yaml), or
        a file .mcap or .db3. A file cut off by a crash is read as far as it goes.
    joints : sequence of str
        The joints wanted, in this order; of others in the messages (a gripper's) the range of the
        positions is kept.
    topic : str, optional
        Topic of sensor_msgs/JointState; by default the only one, or the only one that names all
        the joints, or of several such the only one called 'joint_states', or those that name all
        joints together, none of them twice.
    settings : ReadSettings
        Whether checksums are compared, and how much memory to take.

    Returns
    -------
    Recording
        Samples in order of time, without repeated stamps and values that are not finite; its
        report says what was done to get them. Time is that of the message headers, unless their
        stamps are zero, stand still or jump: then the time of reception, and ``clock`` says so.

    Raises
    ------
    RecordingError
        There is no such bag or topic, the topic does not name a joint, nothing usable is left, or
        it takes more memory than the settings allow.

    """
    joints = tuple(joints)
    if not joints or len(set(joints)) != len(joints):
        raise RecordingError(f'{path}: joints wanted must differ and not be none, got {joints}')
    with Bag(path, settings) as bag:
        chosen = choose_topics(bag, joints, topic)
        decoder = JointStateDecoder(joints, sum(one.count for one in chosen))
        name = ' + '.join(one.name for one in chosen)
        where = f'{path}: {name}'
        with reading(path, RecordingError):
            pieces, size = [], 0
            for one in chosen:
                for block in joint_state_blocks(bag, one):
                    for piece in decoder.decode(block):
                        size += piece.nbytes
                        settings.require(size, f'{where}: the recording')
                        pieces.append(piece)
        damage = bag.damage
    check_joints(where, decoder, joints)
    with reading(where, RecordingError):
        return assemble(str(path), name, joints, pieces, decoder, damage)


def assemble(
    path: str,
    topic: str,
    joints: tuple[str, ...],
    pieces: list[JointSamples],
    decoder: JointStateDecoder,
    damage: str,
) -> Recording:
    """Make one recording of all messages."""
    where = f'{path}: {topic}'
    counts: Counter[str] = Counter()
    gathered = gather(pieces)
    pieces.clear()
    clock, note = choose_clock(gathered)
    for states in gathered if clock == 'receive' else ():
        assert states.receive is not None
        problem = clock_problem(states.receive, states.values[0])
        if problem:
            raise RecordingError(
                f'{where} has no usable time: {note}, and receive times {problem}'
            )
    series = merged([ordered(states, clock, counts) for states in gathered], joints, counts)
    quantities, absent = _measured_quantities(where, series)
    bad, culprits = not_finite(joints, zip(_QUANTITIES, quantities, strict=True), len(series))
    dropped = int(bad.sum())
    if dropped > MAX_NOT_FINITE * len(series):
        raise RecordingError(
            f'{where}: {dropped} of {len(series)} samples are not finite ({"; ".join(culprits)})'
        )
    counts['nan'] += dropped
    samples = JointSamples(joints, series.stamps, quantities)
    samples = samples.select(~bad) if dropped else samples
    stamps = samples.stamps
    if len(stamps) < 2:
        lost = [f'{n} {name.replace("_", " ")}' for name, n in counts.items() if n]
        raise RecordingError(
            f'{where}: {len(stamps)} samples are left of {decoder.messages} messages '
            f'({", ".join(lost) or "the bag is too short"})'
        )
    if damage:
        length = (stamps[-1] - stamps[0]) * 1e-9
        read = f'{decoder.messages} messages over {length:.4g} s could be read'
        damage = f'of a damaged bag {read}: {damage}'
    met = {
        **counts,
        'messages': decoder.messages,
        'malformed': decoder.malformed,
        'not_finite': culprits,
        'absent': absent,
        'clock_note': note,
        'damage': damage,
    }
    return recorded(
        samples,
        met,
        start_ns=int(stamps[0]),
        source=path,
        topic=topic,
        clock=clock,
        others=tuple(PositionRange(name, *ends) for name, ends in decoder.others.items()),
    )


def choose_topics(bag: Bag, joints: Sequence[str], wanted: str | None) -> tuple[Topic, ...]:
    """Return the topic to read, or the topics that name the joints between them."""
    topics = bag.topics()
    candidates = [topic for topic in topics if topic.type_name == JOINT_STATE]
    candidates = candidates or [topic for topic in topics if holds_joint_state(topic)]
    available = ', '.join(f'{topic.name} ({topic.count} messages)' for topic in candidates)
    if wanted is not None:
        name = '/' + wanted.lstrip('/')
        for topic in topics:
            if '/' + topic.name.lstrip('/') != name:
                continue
            if not holds_joint_state(topic):
                raise RecordingError(
                    f'{bag.path}: {topic.name} is a topic of {topic.type_name}, not of '
                    f'{JOINT_STATE}; of that type there are: {available or "none"}'
                )
            return (topic,)
        raise RecordingError(
            f'{bag.path}: there is no topic {wanted}; topics of {JOINT_STATE}: '
            f'{available or "none"}'
        )
    if not candidates:
        others = ', '.join(f'{topic.name} ({topic.type_name})' for topic in topics)
        damage = f' ({bag.damage})' if bag.damage else ''
        raise RecordingError(
            f'{bag.path}: no topic of {JOINT_STATE}; the bag has {others or "no topics"}{damage}'
        )
    if len(candidates) == 1:
        return (candidates[0],)
    named = {topic.name: named_joints(bag, topic) for topic in candidates}
    complete = [topic for topic in candidates if set(joints) <= set(named[topic.name])]
    if len(complete) > 1:
        plain = [topic for topic in complete if topic.name.split('/')[-1] == 'joint_states']
        complete = plain if len(plain) == 1 else complete
    if len(complete) == 1:
        return (complete[0],)
    parts = tuple(one for one in candidates if set(joints) & set(named[one.name]))
    between = [name for one in parts for name in named[one.name]]
    if not complete and set(joints) <= set(between) and len(between) == len(set(between)):
        return parts
    listed = '; '.join(f'{name} names {", ".join(n) or "none"}' for name, n in named.items())
    which = 'several topics name' if complete else 'no topic names'
    raise RecordingError(
        f'{bag.path}: {which} all of {", ".join(joints)}; say which topic to read: {listed}'
    )


def named_joints(bag: Bag, topic: Topic) -> tuple[str, ...]:
    """Return the joints that the first messages of a topic name."""
    decoder = JointStateDecoder(())
    for block in joint_state_blocks(bag, topic):
        for _ in decoder.decode(block):
            pass
        if decoder.messages >= _PEEK_MESSAGES:
            break
    return decoder.names_seen


def bag_contents(path: str | Path, settings: ReadSettings = DEFAULT) -> tuple[Topic, ...]:
    """
    Return the topics of a bag, with the joints that those of JointState name.

    Raises
    ------
    RecordingError
        There is no bag that can be read.

    """
    with Bag(path, settings) as bag:
        return tuple(
            replace(topic, joints=named_joints(bag, topic)) if holds_joint_state(topic) else topic
            for topic in bag.topics()
        )


def check_joints(where: str, decoder: JointStateDecoder, joints: Sequence[str]) -> None:
    """Refuse a topic that does not name all joints, or nothing at all."""
    if not decoder.messages:
        raise RecordingError(f'{where} has no messages')
    missing = [joint for joint in joints if joint not in decoder.names_seen]
    if not missing:
        return
    if not decoder.names_seen:
        raise RecordingError(
            f'{where}: none of {decoder.messages} messages names a joint; '
            f'{decoder.first_problem or "the names are empty"}'
        )
    listed = ', '.join(f"'{name}'" for name in missing)
    found = nearest(missing[0], [name for name in decoder.names_seen if name not in joints])
    present = ','.join(name for name in joints if name in decoder.names_seen)
    hint = f'; --joints {present} reads the others' if present else ''
    if found:
        hint = f"; if '{found}' is '{missing[0]}', say --rename {found}:{missing[0]}{hint}"
    raise RecordingError(
        f'{where} does not name {"joint" if len(missing) == 1 else "joints"} {listed}; '
        f'its joints are {", ".join(decoder.names_seen)}{hint}'
    )


def _measured_quantities(
    where: str, series: JointSamples
) -> tuple[tuple[FloatArray | None, ...], tuple[str, ...]]:
    """Tell quantities that were measured from those never filled in."""
    absent: list[str] = []
    kept: list[FloatArray | None] = []
    for name, values in zip(_QUANTITIES, series.values, strict=True):
        if values is None:
            lacking = list(series.joints)
        else:
            # NaN in the first sample of a joint is a matter of its column, and rare.
            suspect = np.flatnonzero(np.isnan(values[:1]).any(axis=0))
            lacking = [series.joints[j] for j in suspect if np.isnan(values[:, j]).all()]
        if lacking:
            everyone = len(lacking) == len(series.joints)
            absent.append(name if everyone else f'{name} of {", ".join(lacking)}')
        kept.append(None if lacking else values)
    if kept[0] is None:
        raise RecordingError(f'{where} has no {absent[0]}')
    return tuple(kept), tuple(absent)
