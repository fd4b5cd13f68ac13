# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Speed of reading joint states from bags: this package, rosbags and mcap-ros2-support.

Each reader returns the header stamps, positions, velocities and efforts of one topic of an MCAP
file as arrays. The files are written by mcap's own writer with its default chunks of 1 MiB, first
with one topic of 7 joints, then with three alternating topics, of which one is read.

    python benchmarks/reading.py [--messages 1000000]

The time of this package is the median of five runs; the slower readers run once. Every reader
has to decompress the chunks. This package also verifies their checksums, in two threads.

"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from pathlib import Path
import platform
import tempfile
import time
from typing import Any

from armid_ros.motion import FloatArray
from armid_ros.recording import joint_state_cdr, read_recording
from armid_ros.recording.message_types import JOINT_STATE, message_type
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer
from mcap_ros2.decoder import DecoderFactory
import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import get_typestore, Stores

JOINTS = tuple(f'joint_{number}' for number in range(1, 8))
TOPIC = '/joint_states'
OTHER_TOPICS = ('/left/joint_states', '/controller/reference_joint_states')
START_NS = 1_795_254_519_961_369_502
WANTED = {CompressionType.ZSTD: 15.0, CompressionType.NONE: 20.0}

Arrays = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


def write_file(path: Path, count: int, compression: CompressionType, topics: list[str]) -> None:
    """Write an MCAP file with a number of messages on each topic."""
    described = message_type(JOINT_STATE)
    with path.open('wb') as stream:
        writer = Writer(
            stream,
            compression=compression,
            index_types=IndexType.CHUNK | IndexType.MESSAGE | IndexType.METADATA,
        )
        writer.start(profile='ros2')
        schema = writer.register_schema(JOINT_STATE, 'ros2msg', described.definition.encode())
        channels = [writer.register_channel(topic, 'cdr', schema) for topic in topics]
        for begin in range(0, count, 10_000):
            stamps = START_NS + np.arange(begin, min(begin + 10_000, count)) * 1_000_000
            messages = [motion_messages(stamps, number) for number in range(len(topics))]
            for at, stamp in enumerate(stamps.tolist()):
                for number, channel in enumerate(channels):
                    time_ns = stamp + number * 1000
                    writer.add_message(channel, time_ns, messages[number][at], time_ns)
        writer.finish()


def motion_messages(stamps: np.ndarray, number: int) -> list[bytes]:
    """Return serialised joint states of a moving arm with noise."""
    t = (stamps - START_NS)[:, np.newaxis] * 1e-9
    rates = np.linspace(0.3, 2.0, len(JOINTS)) * (1 + number)
    noise = np.random.default_rng(int(stamps[0] % 2**32)).normal(size=(3, len(t), len(JOINTS)))
    q = np.sin(rates * t) + 1e-4 * noise[0]
    dq = rates * np.cos(rates * t) + 1e-3 * noise[1]
    tau = 20 * np.sin(rates * t + 0.3) + 0.2 * noise[2]
    batches = joint_state_cdr(JOINTS, stamps, q, dq, tau, frame_id=('base', '', 'world')[number])
    return [message for batch in batches for message in batch.tolist()]


def read_ours(path: Path) -> Arrays:
    """Read the joint states of a topic with this package."""
    recording = read_recording(path, joints=JOINTS, topic=TOPIC)
    assert recording.dq is not None and recording.tau is not None
    return recording.t, recording.q, recording.dq, recording.tau


def read_rosbags(path: Path) -> Arrays:
    """Read the joint states of a topic with the reader and decoder of rosbags."""
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        connections = [c for c in reader.connections if c.topic == TOPIC]
        return stacked(
            reader.deserialize(raw, connection.msgtype)
            for connection, _, raw in reader.messages(connections)
        )


def read_mcap_ros2(path: Path) -> Arrays:
    """Read the joint states of a topic with mcap and mcap-ros2-support."""
    with path.open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        decoded = reader.iter_decoded_messages(topics=[TOPIC], log_time_order=False)
        return stacked(message for _, _, _, message in decoded)


def stacked(messages: Iterable[Any]) -> Arrays:
    """Return the arrays of decoded messages, copied one by one to keep no message."""
    stamps, position, velocity, effort = [], [], [], []
    for message in messages:
        stamp = message.header.stamp
        stamps.append(stamp.sec * 1_000_000_000 + stamp.nanosec)
        position.append(message.position)
        velocity.append(message.velocity)
        effort.append(message.effort)
    t = (np.array(stamps) - stamps[0]) * 1e-9
    return t, np.array(position), np.array(velocity), np.array(effort)


READERS: dict[str, Callable[[Path], Arrays]] = {
    'armid_ros': read_ours,
    'rosbags': read_rosbags,
    'mcap-ros2-support': read_mcap_ros2,
}


def measure(
    read: Callable[[Path], Arrays], path: Path, repeats: int
) -> tuple[float, float, Arrays]:
    """Return the median wall and processor time of several runs [s], and the arrays read."""
    seconds, used = [], []
    for _ in range(repeats):
        begin, used_before = time.perf_counter(), time.process_time()
        arrays = read(path)
        seconds.append(time.perf_counter() - begin)
        used.append(time.process_time() - used_before)
    return float(np.median(seconds)), float(np.median(used)), arrays


def compare(path: Path, count: int, wanted: float, title: str) -> bool:
    """Print the times of all readers for a file; return whether the wanted ratio is reached."""
    seconds, used, arrays = {}, {}, {}
    for name, read in READERS.items():
        # other programs may disturb a short run; a long one averages over them
        repeats = 5 if read is read_ours else 1
        seconds[name], used[name], arrays[name] = measure(read, path, repeats)
        if name != 'armid_ros':
            for ours, theirs in zip(arrays['armid_ros'], arrays[name], strict=True):
                np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9)
            del arrays[name]
    fastest = min(value for name, value in seconds.items() if name != 'armid_ros')
    print(f'\n{title}, {path.stat().st_size / 1e6:.0f} MB')
    print(f'  {"reader":22} {"s":>8} {"processor s":>12} {"k msg/s":>9} {"of armid_ros":>13}')
    for name, value in seconds.items():
        share = seconds['armid_ros'] / value
        rate = count / value / 1e3
        print(f'  {name:22} {value:8.2f} {used[name]:12.2f} {rate:9.0f} {share:13.3f}')
    ratio = fastest / seconds['armid_ros']
    print(f'  {ratio:.1f} times the faster of the two others (wanted {wanted:g})')
    return ratio >= wanted


def main() -> None:
    """Write the files, read them with all readers, and print the times."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--messages', type=int, default=1_000_000, help='on the topic read')
    count = parser.parse_args().messages
    print(f'{count} messages of {len(JOINTS)} joints; Python {platform.python_version()}')
    reached = []
    with tempfile.TemporaryDirectory(prefix='armid-benchmark-') as folder:
        for topics in ([TOPIC], [TOPIC, *OTHER_TOPICS]):
            for compression, wanted in WANTED.items():
                path = Path(folder, 'bag.mcap')
                write_file(path, count, compression, topics)
                title = f'{len(topics)} topic{"s" * (len(topics) > 1)}, {compression.name.lower()}'
                reached.append(compare(path, count, wanted, title))
                path.unlink()
    print('\nall reached' if all(reached) else '\nNOT all reached')


if __name__ == '__main__':
    main()
