# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Speed of the nodes: losses at 1 kHz, update times, lock step.

``python -m benchmarks.nodes [--seconds 60]``; the identifier runs in this process, the arm and the
recorder in others. Losses are valid on an otherwise idle machine.

"""

import argparse
from collections import deque
from contextlib import contextmanager
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time

from armid_ros.arm import ArmModel
from armid_ros.excitation import Excitation, Limits, random_feasible, save_excitation
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.nodes.lockstep import run_lockstep
from armid_ros.nodes.online_identifier import OnlineIdentifierNode
from armid_ros.nodes.running.domains import private_context
from armid_ros.nodes.running.process import steady
from armid_ros.recording import read_recording
from armid_ros.robots import load_robot
from armid_ros.simulation import SimulatedArm
import numpy as np
from rclpy.experimental import EventsExecutor

from benchmarks.real_recordings import example_robot

#: Description with seven joints and a gripper.
PANDA = str(example_robot('panda_description/urdf/panda.urdf'))
EFFECTS = ('viscous_friction', 'coulomb_friction', 'torque_offset')
MS = 10**6


def short_run(robot, period, n_periods):
    """Return a random motion within the limits of the arm."""
    rng = np.random.default_rng(0)
    limits = Limits.of(robot, speed='medium')
    trajectory = random_feasible(ArmModel(robot), limits, period, 5, rng)
    return Excitation(trajectory, n_periods, 2.0)


@contextmanager
def process(context, node, *parameters):
    """Context manager that runs a node as a separate process."""
    environment = {
        **os.environ,
        'ROS_DOMAIN_ID': str(context.get_domain_id()),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
    }
    command = [sys.executable, '-c', f'from armid_ros.cli.node import main; main({node!r})']
    command += ['--ros-args', *(part for p in parameters for part in ('-p', p))]
    running = subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL)
    try:
        yield running
    finally:
        running.send_signal(signal.SIGINT)
        running.wait()


def resident(running):
    """Return the resident memory of a process [MB]."""
    lines = Path(f'/proc/{running.pid}/status').read_text().splitlines()
    return next(int(line.split()[1]) / 1024.0 for line in lines if line.startswith('VmRSS'))


def at_one_kilohertz(seconds, folder):
    """Run all nodes at 1 kHz, and print lost samples, memory and update times."""
    robot = load_robot(PANDA)
    save_excitation(short_run(robot, 8.0, max(1, int(seconds / 8.0))), folder / 'run.yaml')
    with private_context() as context, steady():
        executor = EventsExecutor(context=context)
        identifier = OnlineIdentifier(
            ArmModel.of(robot, effects=EFFECTS), rng=np.random.default_rng(0)
        )
        node = OnlineIdentifierNode(identifier, context=context, use_global_arguments=False)
        node.update_times = deque()
        executor.add_node(node)
        recorder = process(
            context, 'recorder', f'bag:={folder / "bag"}', 'topics:=[joint_states]',
            'executor:=events',
        )  # fmt: skip
        excitation = process(
            context,
            'excitation_publisher',
            f'robot:={PANDA}',
            f'file:={folder / "run.yaml"}',
            'floor:=none',
            'executor:=events',
        )
        arm = process(context, 'simulated_arm', f'robot:={PANDA}', 'executor:=events')
        live = process(context, 'live_diagnosis', f'robot:={PANDA}', 'executor:=events')
        with recorder as recording_it, excitation as moving, live as diagnosing:
            ours = {'recorder': recording_it, 'publisher': moving, 'live diagnosis': diagnosing}
            memory = []
            with arm as simulating:
                while not node.received:
                    executor.spin_once(timeout_sec=0.1)
                first, begun = node.last_stamp_ns, time.monotonic()
                early = node.received - 1  # states before that one
                for share in (0.1, 0.5, 1.0):  # of the run; caches are full after the first part
                    while time.monotonic() < begun + share * seconds:
                        executor.spin_once(timeout_sec=0.1)
                    memory.append(
                        {n: resident(p) for n, p in (ours | {'arm': simulating}).items()}
                    )
                    stopped = [name for name, one in ours.items() if one.poll() is not None]
                    assert not stopped, f'ended early: {stopped}'
            for _ in range(1000):
                executor.spin_once(timeout_sec=0.001)
        due = round((node.last_stamp_ns - first) / MS) + 1
        missing = due - (node.received - early)
        executor.remove_node(node)
        executor.shutdown()
    recording = read_recording(folder / 'bag', joints=robot.joints)
    span = round(recording.t[-1] * 1000) + 1
    times = 1e6 * np.array(node.update_times)
    restarts = sum(identifier.restarts.values())
    print(f'1 kHz, {robot.n_joints} joints, {len(identifier.base.parameters)} parameters')
    absent = span - len(recording)
    unsent = min(missing, absent)  # a state that both processes lack was not published
    print(f'  not published by the arm    {unsent} of {span}: it skips ahead where it comes late')
    print(f'  lost by the identifier      {missing - unsent} of {node.received} (wanted: 0)')
    print(f'  lost by the recorder        {absent - unsent} of {len(recording)} (wanted: 0)')
    print(f'  restarts of the filters     {restarts} (wanted: 0)')
    for name in memory[0]:
        sizes = ', '.join(f'{one[name]:.0f}' for one in memory)
        print(f'  memory of {name:17} {sizes} MB after a tenth, a half and all of it')
    p50, p99, p999 = np.percentile(times, (50, 99, 99.9))
    print(
        f'  processor time of an update p50 {p50:.0f} us, p99 {p99:.0f} us (wanted: 250), '
        f'p99.9 {p999:.0f} us (wanted: 1000), longest {times.max():.0f} us, load '
        f'{os.getloadavg()[0]:.1f} on {os.cpu_count()} cores'
    )


def in_lock_step(rate, wanted, folder):
    """
    Print the speed of all nodes in lock step, relative to real time.

    The speed is measured by the clock, which includes delays by other processes, and by
    processor time, as on an idle machine.

    """
    robot = load_robot('humanoid_arm', gravity='moon')
    arm, run = ArmModel.of(robot, effects=EFFECTS), short_run(robot, 10.0, 1)
    rng, used = np.random.default_rng(0), []
    end = run_lockstep(
        SimulatedArm(arm, rng=rng, start=run.at([0.0]).q[0]),
        run,
        folder / f'bag_{rate:.0f}',
        OnlineIdentifier(arm, rng=rng),
        rate=rate,
        on_progress=lambda _: used.append(time.process_time()),
    )
    by_processor = 1.0 / np.diff(used)
    print(
        f'lock step, joint_states at {rate:5.0f} Hz   {end.real_time_factor:.1f} x real time; '
        f'by processor time {np.median(by_processor):.1f}, in the best second '
        f'{by_processor.max():.1f} (wanted: {wanted})'
    )


def main():
    """Print the measurements of the nodes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=60.0, help='at 1 kHz')
    seconds = parser.parse_args().seconds
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        at_one_kilohertz(seconds, folder)
        for rate, wanted in ((200.0, 8), (500.0, 6), (1000.0, 5)):
            in_lock_step(rate, wanted, folder)


if __name__ == '__main__':
    main()
