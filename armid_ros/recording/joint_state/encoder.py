# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Serialise joint measurements as JointState messages, and write bags of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from armid_ros.errors import RecordingError
from armid_ros.motion import Motion
from armid_ros.recording.joint_state.layout import JointStateLayout
from armid_ros.recording.mcap.writer import Compression
from armid_ros.recording.message_types import JOINT_STATE, QUANTITIES
from armid_ros.recording.recording import Recording
from armid_ros.recording.temperature import write_temperatures
from armid_ros.recording.writer import atomic_bag, BagWriter, DEFAULT_CHUNK_SIZE
import numpy as np
import numpy.typing as npt


def joint_state_cdr(
    joints: Sequence[str],
    stamps_ns: npt.ArrayLike,
    q: npt.ArrayLike | None,
    dq: npt.ArrayLike | None = None,
    tau: npt.ArrayLike | None = None,
    *,
    frame_id: str = '',
) -> Iterator[npt.NDArray[np.void]]:
    """
    Serialise joint measurements as JointState messages, one message per sample.

    Parameters
    ----------
    joints : sequence of str
        Joint names, n of them.
    stamps_ns : array_like, shape (N,)
        Stamps of the headers [ns].
    q, dq, tau : array_like, shape (N, n), or None
        Positions, velocities, efforts; None leaves the field empty.
    frame_id : str
        Frame of the headers.

    Yields
    ------
    ndarray of void
        Messages in CDR, little endian, up to 4096 at a time.

    """
    stamps = np.asarray(stamps_ns, np.int64)
    fields = [None if v is None else np.asarray(v, np.float64) for v in (q, dq, tau)]
    n = len(joints)
    for name, values in zip(('q', 'dq', 'tau'), fields, strict=True):
        if values is not None and values.shape != (len(stamps), n):
            raise RecordingError(
                f'the array {name} has shape {values.shape}, but {len(stamps)} stamps and {n} '
                f'joints need shape {(len(stamps), n)}'
            )
    frame = frame_id.encode()
    counts = tuple(0 if values is None else n for values in fields)
    layout = JointStateLayout('<', len(frame) + 1, tuple(joints), counts)
    message = bytearray(layout.fixed[0].tobytes())
    message[16 : 16 + len(frame)] = frame
    template = np.frombuffer(message, layout.record)
    size = 4096
    for at in range(0, len(stamps), size):
        batch = slice(at, at + size)
        rows = np.repeat(template, len(stamps[batch]))
        rows['sec'], rows['nanosec'] = np.divmod(stamps[batch], 10**9)
        for name, values in zip(QUANTITIES, fields, strict=True):
            if values is not None and n:
                rows[name] = values[batch]
        yield rows.view(np.dtype((np.void, layout.end)))


def write_joint_states(
    writer: BagWriter,
    topic: str,
    joints: Sequence[str],
    stamps_ns: npt.ArrayLike,
    q: npt.ArrayLike | None,
    dq: npt.ArrayLike | None = None,
    tau: npt.ArrayLike | None = None,
) -> None:
    """
    Write joint measurements to a topic of a bag; log times equal the time stamps.

    See ``joint_state_cdr`` for the parameters.

    """
    stamps = np.asarray(stamps_ns, np.int64)
    writer.add_topic(topic, JOINT_STATE)
    at = 0
    for rows in joint_state_cdr(joints, stamps, q, dq, tau):
        writer.write_many(topic, rows, stamps[at : at + len(rows)])
        at += len(rows)


def write_recording(
    path: str | Path,
    measured: Recording | Motion,
    *,
    topic: str = '/joint_states',
    start_ns: int | None = None,
    robot_description: str | None = None,
    compression: Compression = 'zstd',
    chunk_size: int = DEFAULT_CHUNK_SIZE,
) -> None:
    """
    Write a recording or a motion as a bag of JointState messages, with its temperatures.

    Parameters
    ----------
    path : str or Path
        Bag directory to create; it must not exist.
    measured : Recording or Motion
        Measured or simulated motion; velocities and torques may be None.
    topic : str
        Topic of the messages.
    start_ns : int, optional
        Offset of the times [ns]; by default that of the recording, else 1 s, since a stamp of zero
        means no stamp.
    robot_description : str, optional
        URDF to be written to /robot_description.
    compression : {'zstd', 'lz4', 'none'}
        Compression of the chunks.
    chunk_size : int
        Size of the messages in a chunk [bytes].

    Raises
    ------
    RecordingError
        The bag exists already, or a stamp is negative.

    Examples
    --------
    >>> import armid_ros as ar
    >>> run = ar.read_recording('log.csv', 'my_arm.urdf', effort='amps_{}', effort_scale=4.0)
    >>> ar.write_recording('log_bag', run)
    >>> len(ar.read_recording('log_bag', 'my_arm.urdf')) == len(run)
    True

    """
    joints = tuple(measured.joints)
    if start_ns is None:
        start_ns = int(getattr(measured, 'start_ns', 0)) or 10**9
    stamps = start_ns + np.rint(np.asarray(measured.t) * 1e9).astype(np.int64)
    if len(stamps) and stamps.min() < 0:
        raise RecordingError(
            f'{path}: the first stamp is {stamps.min() * 1e-9:g} s, but ROS time cannot be '
            'negative; give a larger start_ns'
        )
    with atomic_bag(path, compression=compression, chunk_size=chunk_size) as writer:
        if robot_description is not None:
            first = int(stamps[0]) if len(stamps) else start_ns
            writer.write_description(robot_description, first)
        write_joint_states(writer, topic, joints, stamps, measured.q, measured.dq, measured.tau)
        if measured.temperature is not None:
            write_temperatures(writer, joints, measured.temperature, start_ns)
