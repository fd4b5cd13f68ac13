# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A bag that may be larger than the memory, as recordings of a part of its time each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from armid_ros.errors import RecordingError
from armid_ros.files import reading
from armid_ros.recording.bag import Bag
from armid_ros.recording.joint_state.conversion import joint_state_blocks
from armid_ros.recording.joint_state.decoder import JointSamples, JointStateDecoder
from armid_ros.recording.reader import assemble, check_joints, choose_topics
from armid_ros.recording.recording import Recording
from armid_ros.recording.settings import DEFAULT, ReadSettings
from armid_ros.recording.source import Topic
import numpy as np

#: Returns the stamp [ns] from which on samples of a piece are to be in the next one as well.
Keep = Callable[[Recording], int]


def read_pieces(
    path: str | Path,
    *,
    joints: Sequence[str],
    topic: str | None = None,
    samples: int,
    keep: Keep,
    settings: ReadSettings = DEFAULT,
) -> Iterator[tuple[Recording, bool]]:
    """
    Yield the measurements of some joints piece by piece, in the order of storage.

    Parameters
    ----------
    path, joints, topic, settings
        As of ``read_recording``.
    samples : int
        Messages that a piece reads at most, in addition to those carried over from the one before.
    keep : callable
        Asked of every piece but the last; what lies before the stamp that it returns is let go.

    Yields
    ------
    piece : Recording
        With times from its own first sample on.
    last : bool
        Whether it is the last one.

    Raises
    ------
    RecordingError
        As ``read_recording``.

    """
    joints = tuple(joints)
    with Bag(path, settings) as bag:
        chosen, *others = choose_topics(bag, joints, topic)
        if others:
            raise RecordingError(
                f'{path}: joints are spread over {chosen.name} and {others[0].name}, which cannot '
                'be read piece by piece: merge them with joint_state_merger'
            )
        decoder = JointStateDecoder(joints)
        where = f'{path}: {chosen.name}'
        held: list[JointSamples] = []
        new = 0

        def made(damage: str = '') -> Recording:
            check_joints(where, decoder, joints)
            with reading(where, RecordingError):
                return assemble(str(path), chosen.name, joints, list(held), decoder, damage)

        for part in _parts(bag, chosen, decoder, samples):
            if new and new + len(part) > samples:
                piece = made()
                yield piece, False
                held, new = list(_from(held, keep(piece), piece.clock)), 0
            held.append(part)
            new += len(part)
        yield made(bag.damage), True


def _parts(
    bag: Bag, topic: Topic, decoder: JointStateDecoder, most: int
) -> Iterator[JointSamples]:
    """Yield the messages of a topic, so many at a time at most."""
    with reading(bag.path, RecordingError):
        for block in joint_state_blocks(bag, topic):
            for states in decoder.decode(block):
                for start in range(0, len(states), most):
                    yield states.select(slice(start, start + most))


def _from(held: Sequence[JointSamples], stamp: int, clock: str) -> Iterator[JointSamples]:
    """Yield what messages have from a stamp on."""
    for states in held:
        stamps = states.stamps if clock == 'header' else states.receive
        assert stamps is not None
        late = stamps >= stamp
        if late.any():
            yield states.select(np.flatnonzero(late))
