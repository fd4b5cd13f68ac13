# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What is lost over half an hour at 1 kHz, and what kills at random moments leave.

    python -m benchmarks.endurance [--kills 100] [--commands 200] [--minutes 30] [--seed 0]

A part of 0 is left out. Kills: a recorder of 3,000 messages/s is killed with SIGKILL; what was
published and is not in its bag is lost. Commands: `armid` is killed with SIGKILL, and every file
that it leaves in its output has to be whole. Minutes: a player publishes a bag of 7 joints at
1 kHz and a recorder records it; both as processes. Losses are to be measured on an otherwise idle
machine; the load is printed.

"""

from __future__ import annotations

import argparse
from collections import Counter
import json
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import tempfile
import time

from armid_ros.errors import ArmidError
from armid_ros.files import load_yaml
from armid_ros.nodes.running.domains import private_context
from armid_ros.nodes.running.process import make_executor
from armid_ros.recording import read_recording, Recording, write_recording
import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import JointState

from benchmarks.nodes import process

JOINTS = tuple(f'joint_{k}' for k in range(7))
RATE, TOPICS = 1000, 3
#: What may be lost by a kill [s], and by how much memory may differ after the first minute.
MOST_LOST, FLAT = 0.2, 0.05
#: How long memory is left to settle, and how often it is looked at [s].
WARM_UP, LOOK = 60.0, 5.0
#: Files whose names begin so are not results yet.
UNFINISHED = '.'


def verdict(reached: bool) -> str:
    """Say whether a bound holds."""
    return 'reached' if reached else 'NOT reached'


# --- kills of the recorder ------------------------------------------------------------------


def killed_recorder(bag: Path, seconds: float) -> tuple[float, int]:
    """Kill a recorder after some seconds; return what it lost [s] and how many it kept."""
    with private_context() as context:
        executor = make_executor('events', context)
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
    """Kill recorders at random moments; print what was lost."""
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


# --- kills of armid -------------------------------------------------------------------------


def prepared(folder: Path) -> dict[str, list[str]]:
    """Return commands, each with {out} for what it writes."""
    run, other = folder / 'run', folder / 'other'
    robot = ['--robot', 'humanoid_arm']
    for bag, seed in ((run, '0'), (other, '1')):
        armid('simulate', *robot, '--rate', '250', '--seed', seed, '--out', str(bag))
    armid('identify', str(run), *robot, '--out', str(folder / 'result'))
    crashed = folder / 'crashed.mcap'
    content = next(run.glob('*.mcap')).read_bytes()
    crashed.write_bytes(content[: 2 * len(content) // 3])
    return {
        'identify': ['identify', str(run), *robot, '--validate', str(other), '--out', '{out}'],
        'simulate': ['simulate', *robot, '--rate', '250', '--out', '{out}'],
        'recover': ['recover', str(crashed), '--out', '{out}'],
        'excite': ['excite', *robot, '--kind', 'multisine', '--duration', '8', '--out', '{out}'],
        'inspect': ['inspect', str(run), *robot, '--out', '{out}'],
        'compare': ['compare', str(folder / 'result'), str(folder / 'result'), '--out', '{out}'],
    }


def armid(*arguments: str) -> None:
    """Run a command to its end."""
    command = [sys.executable, '-m', 'armid_ros.cli', *arguments]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def how_long(command: list[str], out: Path) -> tuple[float, float]:
    """Return when a command begins to write, and when it ends [s]."""
    begin = time.perf_counter()
    running = start(command, out)
    first = None
    while running.poll() is None:
        if first is None and any(out.parent.iterdir()):
            first = time.perf_counter() - begin
        time.sleep(0.002)
    if running.returncode:
        raise SystemExit(f'{" ".join(command)}: ended with {running.returncode}')
    end = time.perf_counter() - begin
    return (end if first is None else first), end


def start(command: list[str], out: Path) -> subprocess.Popen[bytes]:
    """Start a command that writes somewhere."""
    line = [part.format(out=out) for part in command]
    return subprocess.Popen(
        [sys.executable, '-m', 'armid_ros.cli', *line],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def broken(out: Path) -> list[str]:
    """Return what is not whole in an output."""
    if not out.exists():
        return []
    found = []
    for path in sorted(p for p in out.rglob('*') if p.is_file()):
        if any(part.startswith(UNFINISHED) for part in path.relative_to(out).parts):
            continue
        try:
            whole = is_whole(path)
        except (ArmidError, ValueError, OSError) as error:
            whole, path = False, Path(f'{path}: {error}')
        if not whole:
            found.append(str(path))
    return found


def is_whole(path: Path) -> bool:
    """Return whether a file is as its writer left it at its end."""
    if path.suffix == '.mcap':
        described = (path.parent / 'metadata.yaml').is_file()
        return described and path.read_bytes()[-8:] == b'\x89MCAP0\r\n'
    text = path.read_text()
    if path.suffix == '.json':
        return bool(json.loads(text))
    if path.suffix == '.yaml':
        return bool(load_yaml(text)) and text.endswith('\n')
    if path.suffix == '.html':
        return text.rstrip().endswith('</html>')
    return text.endswith('\n')


def commands(folder: Path, count: int, rng: np.random.Generator) -> bool:
    """Kill commands at random moments; print what they left."""
    left: dict[str, Counter[str]] = {}
    damage = []
    ready = prepared(folder)
    spans = {}
    for name, command in ready.items():
        (folder / f'whole_{name}').mkdir()
        spans[name] = how_long(command, folder / f'whole_{name}' / 'out')
    for number in range(count):
        name = list(ready)[number % len(ready)]
        begins, ends = spans[name]
        # one in four at any moment, the others while something is written
        low = 0.0 if rng.random() < 0.25 else max(0.0, begins - 0.1)
        moment = float(rng.uniform(low, 1.05 * ends))
        where = folder / f'command_{number}'
        where.mkdir()
        running = start(ready[name], where / 'out')
        try:
            running.wait(timeout=moment)
        except subprocess.TimeoutExpired:
            running.kill()
            running.wait()
        bad = broken(where / 'out')
        damage += [f'{name} killed after {moment:.2f} s: {path}' for path in bad]
        state = 'absent' if not (where / 'out').exists() else 'some or all files'
        state = 'broken' if bad else state
        left.setdefault(name, Counter())[state] += 1
        left[name]['ended before'] += running.returncode == 0
    print(f'\n{count} kills of armid, load {load()}')
    columns = ('absent', 'some or all files', 'broken', 'ended before')
    print(f'  {"command":10} {"writes":>14}' + ''.join(f'{name:>19}' for name in columns))
    for name, counts in left.items():
        span = '{:.1f} to {:.1f} s'.format(*spans[name])
        print(f'  {name:10} {span:>14}' + ''.join(f'{counts[column]:19}' for column in columns))
    for line in damage:
        print(f'  {line}')
    print(f'  every output whole or absent: {verdict(not damage)}')
    return not damage


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
    """Return the memory of a process that is its own, without files that it maps [MB]."""
    text = Path(f'/proc/{pid}/status').read_text()
    found = re.search(r'RssAnon:\s+(\d+) kB', text)
    return int(found[1]) / 1024.0 if found else np.nan


def load() -> str:
    """Return the load of the machine over the last minute, and its number of cores."""
    return f'{os.getloadavg()[0]:.1f} on {os.cpu_count()} cores'


def half_an_hour(folder: Path, minutes: float) -> bool:
    """Play and record; print what was lost and how much memory was taken."""
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
    """Measure and print; 1 if a bound does not hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--kills', type=int, default=100, help='of a recorder')
    parser.add_argument('--commands', type=int, default=200, help='kills of armid')
    parser.add_argument('--minutes', type=float, default=30.0, help='of playing and recording')
    parser.add_argument('--seed', type=int, default=0)
    arguments = parser.parse_args()
    reached = []
    with tempfile.TemporaryDirectory(prefix='armid-endurance-') as name:
        folder, rng = Path(name), np.random.default_rng(arguments.seed)
        for part, size in ((kills, arguments.kills), (commands, arguments.commands)):
            if size:
                reached.append(part(folder, size, rng))
                sys.stdout.flush()
        if arguments.minutes:
            reached.append(half_an_hour(folder, arguments.minutes))
    return 0 if all(reached) else 1


if __name__ == '__main__':
    sys.exit(main())
