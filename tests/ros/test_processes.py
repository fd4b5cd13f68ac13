# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The nodes as processes of their own, over DDS, ended as `ros2 launch` ends them."""

from contextlib import suppress
from itertools import count, islice
import os
import signal
import subprocess
import sys

from armid_msgs.msg import ParameterEstimate
from armid_ros.arm import ArmModel
from armid_ros.excitation import Excitation, Limits, random_feasible, save_excitation
from armid_ros.nodes.qos import LATCHED, STREAM
from armid_ros.recording import read_recording, topics
from armid_ros.robots import load_robot
import numpy as np
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory

from tests.ros.controller import Controller, joint_state, SECOND

PATIENCE = 120.0


def short_excitation():
    robot = load_robot('humanoid_arm')
    limits, rng = Limits.of(robot, speed='slow'), np.random.default_rng(4)
    return Excitation(random_feasible(ArmModel(robot), limits, 4.0, 2, rng), 1, 1.0)


def executable(node):  # as in scripts/
    return sys.executable, '-c', f'from armid_ros.cli.node import main; main({node!r})'


class Processes:
    """Nodes as processes on the domain of a bench."""

    def __init__(self, bench):
        self._environment = {
            **os.environ,
            'PYTHONFAULTHANDLER': '1',
            'ROS_DOMAIN_ID': str(bench.context.get_domain_id()),
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
            'PYTHONPATH': os.pathsep.join(p for p in sys.path if p),
        }
        self.running = []

    def start(self, node, *parameters):
        return self.run(node, '--ros-args', *(part for p in parameters for part in ('-p', p)))

    def run(self, node, *arguments):
        return self.run_command([*executable(node), *arguments])

    def run_command(self, command):
        # SIGHUP ends a process also where the tests run under nohup, which hands that on; Python
        # code between fork and exec may wait for ever for another thread's lock.
        process = subprocess.Popen(
            ['env', '--default-signal=HUP', *command],
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        self.running.append(process)
        return process

    def end(self, process, *signals):
        for number in signals:
            process.send_signal(number)
        try:
            _, errors = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGABRT)  # the handler of faults says where it is
            _, errors = process.communicate(timeout=PATIENCE)
            pytest.fail(f'does not end:\n{errors}')
        return errors


@pytest.fixture
def processes(bench):
    processes = Processes(bench)
    yield processes
    for process in processes.running:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # and what it started
        process.communicate()


def recorded(diagnostics):
    """Return how many messages the recorder has written, by its last diagnostics."""
    statuses = [s for d in diagnostics for s in d.status if s.name == 'recorder: state']
    values = {v.key: v.value for s in statuses for v in s.values}
    return int(values.get('messages', 0))


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGKILL])
def test_a_node_ends_in_order_with_the_process_that_started_it(bench, processes, tmp_path, number):
    """As the nodes of a launch that gets SIGTERM, which it does not pass on."""
    bag = tmp_path / 'bag'
    options = f'-p bag:={bag} -p topics:=[text] -p end_with_parent:=true'
    node = (*executable('recorder'), '--ros-args', *options.split())
    code = f'import subprocess; subprocess.run({node!r})'
    launch = processes.run_command([sys.executable, '-c', code])
    publisher = bench.matched_publisher(String, 'text', LATCHED)
    diagnostics = bench.diagnostics()
    publisher.publish(String(data='one'))
    bench.spin_until(lambda: recorded(diagnostics) == 1, 'the recording')
    launch.send_signal(number)
    bench.spin_until((bag / 'metadata.yaml').is_file, 'the end of the bag')
    assert [topic.count for topic in topics(bag)] == [1]
    launch.communicate(timeout=PATIENCE)  # until the node has let go of its output


def test_arm_identifier_recorder_and_player_work_together(bench, processes, tmp_path):
    bag = tmp_path / 'bag'
    estimates = bench.listen(ParameterEstimate, 'online_identifier/estimate', LATCHED)
    diagnostics = bench.diagnostics()
    recorder = processes.start('recorder', f'bag:={bag}', 'topics:=[joint_states]')
    learned = tmp_path / 'learned'
    identifier = processes.start('online_identifier', f'save_to:={learned}')
    save_excitation(short_excitation(), tmp_path / 'run.yaml')
    excitation = processes.start(
        'excitation_publisher', f'file:={tmp_path / "run.yaml"}', 'simulation:=true'
    )
    arm = processes.start('simulated_arm', 'rate:=200.0')

    bench.spin_until(lambda: estimates and estimates[-1].samples > 200, 'the estimates')
    bench.spin_until(lambda: recorded(diagnostics) > 600, 'the recording')
    for process in (arm, identifier, excitation):
        errors = processes.end(process, signal.SIGINT, signal.SIGINT)
        assert process.returncode == 0 and 'Traceback' not in errors, errors
    assert (learned / 'model.yaml').is_file()  # it was saved when the node was ended
    errors = processes.end(recorder, signal.SIGINT, signal.SIGTERM)
    assert recorder.returncode == 0 and 'Traceback' not in errors, errors
    joints = load_robot('humanoid_arm').joints
    recording = read_recording(bag, joints=joints)
    assert recording.report.clean and len(recording) > 200
    assert np.ptp(recording.q, axis=0).max() > 0.01  # the excitation was taken

    player = processes.start('bag_player', f'bag:={bag}', 'rate:=20.0', 'subscriber_timeout:=0.0')
    _, errors = player.communicate(timeout=PATIENCE)
    assert player.returncode == 0, errors


def test_a_publisher_that_is_ended_stops_the_arm(bench, processes, tmp_path):
    """What the arm hears last brings it to rest, long before the run would have ended."""
    save_excitation(short_excitation(), tmp_path / 'run.yaml')
    heard = bench.listen(JointTrajectory, 'joint_trajectory', STREAM)
    processes.start('simulated_arm', 'rate:=200.0')
    excitation = processes.start(
        'excitation_publisher',
        f'file:={tmp_path / "run.yaml"}',
        'simulation:=true',
        'start:=false',
        'approach:=60.0',
    )
    bench.spin_until(lambda: bench.call('excitation_publisher/start').success, 'the start')
    bench.spin_until(lambda: heard, 'the run')
    errors = processes.end(excitation, signal.SIGINT, signal.SIGTERM)
    assert excitation.returncode == 0 and 'Traceback' not in errors, errors
    bench.spin_until(lambda: len(heard) == 2, 'the way to rest')
    last = heard[1].points[-1]
    assert last.time_from_start.sec < 2 and np.allclose(last.velocities, 0.0)


def test_a_publisher_that_designs_is_ended_at_once(bench, processes):
    """The design would take a day; nothing is published, and nothing is said but what it does."""
    log = bench.rosout()
    heard = bench.listen(JointTrajectory, 'joint_trajectory', STREAM)
    excitation = processes.start(
        'excitation_publisher', 'design_time:=86400.0', 'duration:=3600.0', 'harmonics:=30'
    )
    bench.spin_until(lambda: any('making' in m.msg for m in log), 'the design')
    assert excitation.poll() is None
    errors = processes.end(excitation, signal.SIGTERM)
    assert excitation.returncode == 0 and 'Traceback' not in errors, errors
    assert not heard


def test_a_recorder_whose_terminal_is_closed_completes_its_bag(bench, processes, tmp_path):
    bag = tmp_path / 'bag'
    recorder = processes.start('recorder', f'bag:={bag}', 'topics:=[joint_states]')
    publisher = bench.matched_publisher(JointState, 'joint_states')
    stamps = count(SECOND, SECOND // 1000)

    def grown():
        for stamp in islice(stamps, 20):
            publisher.publish(joint_state(1e-9 * stamp, ['hinge'], [0.0], [0.0], [1.0]))
        return any(file.stat().st_size > 5_000 for file in bag.glob('*.mcap'))

    bench.spin_until(grown, 'the recording')
    errors = processes.end(recorder, signal.SIGHUP)
    assert recorder.returncode == 1
    assert 'SIGHUP' in errors.strip().splitlines()[-1]
    report = read_recording(bag, joints=['hinge']).report
    assert report.samples and not report.damage  # a busy computer leaves gaps


def test_a_process_that_cannot_leave_is_ended_and_says_where_it_hangs(tmp_path):
    """As where another process was killed while it held shared memory."""
    program = (
        'import threading\n'
        'from armid_ros.nodes.recorder import RecorderNode\n'
        'from armid_ros.nodes.running import process\n'
        'process.SHUTDOWN_TIMEOUT = 1.0\n'
        'RecorderNode.destroy_node = lambda self: threading.Event().wait()\n'
        'RecorderNode.finished = property(lambda self: True)\n'
        f"process.run(RecorderNode, ['--ros-args', '-p', 'bag:={tmp_path / 'bag'}'])\n"
    )
    command = [sys.executable, '-c', program]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert ended.returncode == 1
    assert 'in _shut_down' in ended.stderr
    assert (tmp_path / 'bag' / 'metadata.yaml').is_file()


@pytest.mark.parametrize(
    ('executor', 'signals'),
    [
        ('single', (signal.SIGINT, signal.SIGINT)),
        pytest.param('events', (signal.SIGTERM,), marks=pytest.mark.long),
    ],
)
def test_a_signal_brings_a_goal_to_rest_before_the_process_is_gone(
    bench, processes, tmp_path, executor, signals
):
    robot = load_robot('humanoid_arm')
    arm = Controller(bench, robot, (robot.lower + robot.upper) / 2.0, action=True)
    bench.listen(JointState, 'joint_states')  # goes on when the process does not
    save_excitation(short_excitation(), tmp_path / 'run.yaml')
    options = ('use_sim_time:=true', 'start:=false', 'interface:=action', f'executor:={executor}')
    process = processes.start('excitation_publisher', f'file:={tmp_path / "run.yaml"}', *options)
    arm.run(101.0)
    bench.spin_until(
        lambda: (
            arm.goals or bench.call('excitation_publisher/start').success or arm.run(arm.now + 0.1)
        ),
        'the start',
    )
    bench.spin_until(lambda: arm.goals, 'the goal')
    arm.run(arm.now + 2.0)
    assert not arm.ends
    for number in signals:
        process.send_signal(number)
    bench.spin_until(lambda: process.poll() is not None, 'the end of the process')
    assert process.returncode == 0
    assert 'Traceback' not in process.communicate()[1]
    assert len(arm.goals) == 2
    arm.run(arm.now + 1.0)
    assert arm.ends == ['abort', 'succeed']
    np.testing.assert_allclose(arm.state(arm.now).dq, 0.0, atol=1e-9)
    arm.leave()
