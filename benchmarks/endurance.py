# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Losses of a recorder over half an hour at 1 kHz, and after kills at random moments.

    python -m benchmarks.endurance [--kills 100] [--minutes 30] [--seed 0]

A part with the number 0 is left out. Kills: a recorder of 3,000 messages/s is killed with SIGKILL;
published messages that are not in its bag are lost. Minutes: a player publishes a bag of 7 joints
at 1 kHz and a recorder records it, both as processes. Losses are valid on an otherwise idle
machine; the load is printed. For killed commands see tests/files/test_staging.py.

"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import re
import signal
import sys
import tempfile
import time

from armid_ros.errors import ArmidError
from armid_ros.nodes.running.domains import private_context
from armid_ros.recording import read_recording, Recording, write_recording
import numpy as np
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState

from benchmarks.nodes import process

JOINTS = tuple(f'joint_{k}' for k in range(7))
RATE, TOPICS = 1000, 3
#: Largest accepted loss by a kill [s], and largest relative change of memory after a minute.
MOST_LOST, FLAT = 0.2, 0.05
#: Time in which memory settles, and interval of its measurements [s].
WARM_UP, LOOK = 60.0, 5.0


def verdict(reached: bool) -> str:
    """Return in words whether a bound holds."""
    return 'reached' if reached else 'NOT reached'


# --- kills of the recorder ------------------------------------------------------------------


def killed_recorder(bag: Path, seconds: float) -> tuple[float, int]:
    """Kill a recorder after some seconds; return lost time [s] and number of kept messages."""
    with private_context() as context:
        executor = EventsExecutor(context=context)
        node = Node('source', context=context, use_global_arguments=False)
        executor.add_node(node)
        topics = [f'arm{k}/joint_states' for k in range(TOPICS)]
        publishers = [node.create_publisher(JointState, topic, 100) for topic in topics]
        message = JointState(name=list(JOINTS))
        message.position = message.velocity = message.effort = [0.1] * len(JOINTS)
        stamps: list[int] = []

        def publish() -> None:
            stamps.append(time.time_ns())
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamps[-1], 10**9)
            for publisher in publishers:
                publisher.publish(message)

        names = ','.join(publisher.topic_name for publisher in publishers)
        with process(
            context, 'recorder', f'bag:={bag}', f'topics:=[{names}]', 'executor:=events'
        ) as recorder:
            while not all(p.get_subscription_count() for p in publishers):
                executor.spin_once(timeout_sec=0.1)
            node.create_timer(1.0 / RATE, publish)
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                executor.spin_once(timeout_sec=0.1)
            recorder.kill()
            recorder.wait()
        executor.shutdown()
    lost, kept = 0.0, 0
    for publisher in publishers:
        recording = read_recording(bag, joints=JOINTS, topic=publisher.topic_name)
        last = recording.start_ns + round(float(recording.t[-1]) * 1e9)
        lost, kept = max(lost, (stamps[-1] - last) * 1e-9), kept + len(recording)
    return lost, kept


def kills(folder: Path, count: int, rng: np.random.Generator) -> bool:
    """Kill recorders at random moments and print the losses; return whether bounds hold."""
    losses, unread = [], []
    for number in range(count):
        seconds = float(rng.uniform(0.6, 3.0))
        try:
            losses.append(killed_recorder(folder / f'killed_{number}', seconds)[0])
        except ArmidError as error:
            unread.append(f'kill {number} after {seconds:.2f} s: {error}')
    print(f'\n{count} kills of a recorder at {RATE * TOPICS} messages/s, load {load()}')
    print(f'  {"read":>6} {"lost: median":>14} {"95 %":>8} {"most":>8}  [s]')
    median, most_95, most = np.percentile(losses, (50, 95, 100)) if losses else (np.nan,) * 3
    print(f'  {len(losses):6} {median:14.3f} {most_95:8.3f} {most:8.3f}')
    for line in unread:
        print(f'  not read: {line}')
    reached = not unread and bool(most <= MOST_LOST)
    print(f'  all read, at most {MOST_LOST} s lost: {verdict(reached)}')
    return reached


# --- half an hour ---------------------------------------------------------------------------


def endless_motion(path: Path, seconds: float) -> int:
    """Write a bag of 7 joints at 1 kHz; return its number of samples."""
    t = np.arange(round(seconds * RATE)) / RATE
    wave = np.outer(t, np.linspace(0.3, 2.0, len(JOINTS)))
    moving = Recording(
        joints=JOINTS, t=t, q=np.sin(wave), dq=np.cos(wave), tau=np.cos(wave), start_ns=10**18
    )
    write_recording(path, moving)
    return len(t)


def memory(pid: int) -> float:
    """Return the memory of a process without mapped files [MB]."""
    text = Path(f'/proc/{pid}/status').read_text()
    found = re.search(r'RssAnon:\s+(\d+) kB', text)
    return int(found[1]) / 1024.0 if found else np.nan


def load() -> str:
    """Return the load of the machine over the last minute, and its number of cores."""
    return f'{os.getloadavg()[0]:.1f} on {os.cpu_count()} cores'


def half_an_hour(folder: Path, minutes: float) -> bool:
    """Play and record; print losses and memory; return whether bounds hold."""
    count = endless_motion(folder / 'played', 60.0 * minutes)
    used: dict[str, list[tuple[float, float]]] = {'recorder': [], 'bag_player': []}
    loads, begin = [], time.monotonic()
    with private_context() as context:
        recorder = process(
            context, 'recorder', f'bag:={folder / "bag"}', 'topics:=[/joint_states]',
            'executor:=events',
        )  # fmt: skip
        with recorder as recording:
            player = process(
                context, 'bag_player', f'bag:={folder / "played"}', 'subscriber_timeout:=60.0'
            )
            with player as playing:
                while playing.poll() is None:
                    at = time.monotonic() - begin
                    if at > 60.0 * minutes + 120.0:
                        playing.send_signal(signal.SIGINT)
                    for name, one in (('recorder', recording), ('bag_player', playing)):
                        used[name].append((at, memory(one.pid)))
                    loads.append(os.getloadavg()[0])
                    time.sleep(LOOK)
    recorded = read_recording(folder / 'bag', joints=JOINTS)
    lost = count - len(recorded)
    print(f'\n{minutes:g} min at 1 kHz, load {np.mean(loads):.1f} on {os.cpu_count()} cores')
    print(f'  lost {lost} of {count} messages, the first {recorded.start_ns - 10**18} ns late')
    flat = True
    print(f'  {"memory [MB]":12} {"after 1 min":>12} {"at the end":>12} {"range":>8}')
    for name, looks in used.items():
        t, size = np.array(looks).T
        settled = size[(t >= min(WARM_UP, t[-1] / 2.0)) & np.isfinite(size)]
        spread = float(np.ptp(settled) / settled[0])
        flat = flat and spread <= FLAT
        print(f'  {name:12} {settled[0]:12.1f} {settled[-1]:12.1f} {100 * spread:6.1f} %')
    print(f'  nothing lost: {verdict(lost == 0)}; memory flat within 5 %: {verdict(flat)}')
    return flat and lost == 0


def main() -> int:
    """Measure and print; return 1 if a bound does not hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--kills', type=int, default=100, help='of a recorder')
    parser.add_argument('--minutes', type=float, default=30.0, help='of playing and recording')
    parser.add_argument('--seed', type=int, default=0)
    arguments = parser.parse_args()
    reached = []
    with tempfile.TemporaryDirectory(prefix='armid-endurance-') as name:
        folder, rng = Path(name), np.random.default_rng(arguments.seed)
        if arguments.kills:
            reached.append(kills(folder, arguments.kills, rng))
            sys.stdout.flush()
        if arguments.minutes:
            reached.append(half_an_hour(folder, arguments.minutes))
    return 0 if all(reached) else 1


if __name__ == '__main__':
    sys.exit(main())
