# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The excitation publisher begins where the arm is, watches it, and stops it."""

from __future__ import annotations

import json

from armid_ros.arm import ArmModel
from armid_ros.cli.excite import excite
from armid_ros.errors import ArmidError
from armid_ros.excitation import (
    Excitation,
    Limits,
    load_excitation,
    random_feasible,
    save_excitation,
    slowed,
    transfer_limits,
    TransferPlanner,
)
from armid_ros.nodes import arm_watch
from armid_ros.nodes.excitation_publisher import ExcitationPublisherNode
from armid_ros.nodes.qos import STREAM
from armid_ros.recording import read_waypoints
from armid_ros.recording.trajectory import waypoints_of
from armid_ros.robots import load_robot
from click.testing import CliRunner
import numpy as np
import pytest
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

from tests.ros.controller import joint_state, SECOND, seconds_of

APPROACH = 2.0


@pytest.fixture(scope='module')
def robot():
    return load_robot('humanoid_arm')


@pytest.fixture(scope='module')
def excitation(robot):
    limits = Limits.of(robot, speed='medium')
    rng = np.random.default_rng(3)
    return Excitation(random_feasible(ArmModel(robot), limits, 4.0, 3, rng), 1, 1.0)


@pytest.fixture(scope='module')
def plan(tmp_path_factory):
    """Run armid excite, hurriedly, with drives as good as they may be."""
    out = tmp_path_factory.mktemp('plan')
    options = '--robot humanoid_arm --duration 8 --acceleration 30 --starts 1 --iterations 2'
    result = CliRunner().invoke(excite, [*options.split(), '--speed', 'slow', '--out', str(out)])
    assert result.exit_code == 0, result.output
    return out


class StandIn:
    """Stands in for the drivers of an arm: publishes joint states, and hears trajectories."""

    def __init__(self, bench, joints, q, *, listens=True):
        self._bench = bench
        self.joints, self.q = tuple(joints), np.array(q, dtype=float)
        self._publisher = bench.probe.create_publisher(JointState, 'joint_states', 10)
        self.heard = []
        if listens:
            self.listen()

    def listen(self, quality=STREAM):
        """Hear trajectories from now on."""
        self.heard = self._bench.listen(JointTrajectory, 'joint_trajectory', quality)

    def report(self, seconds, q=None, joints=None):
        """Publish a joint state with a stamp, and let it be taken."""
        self._bench.spin_until(lambda: self._publisher.get_subscription_count(), 'joint_states')
        q = self.q if q is None else q
        self._publisher.publish(joint_state(seconds, joints or self.joints, q))
        self._bench.settle()

    def stand(self, until=100.0, q=None):
        """Let the clock go on, and report the arm at rest, up to a time."""
        for seconds in until + np.arange(-4, 1) * 0.1:
            self._bench.tick(round(seconds * SECOND))
            self.report(seconds, q)


@pytest.fixture
def arm(bench, robot):
    return StandIn(bench, robot.joints, (robot.lower + robot.upper) / 2.0)


def now_of(node):
    return node.get_clock().now().nanoseconds / SECOND


def free_planner(robot):
    """Plan without bodies: the excitations here are drawn without looking at any."""
    return TransferPlanner(ArmModel(robot), transfer_limits(robot, 1.0), None, 0.0)


def waiting_publisher(bench, excitation, **parameters):
    """Make a publisher on simulated time, at 100 s, that begins when it is told."""
    planner = free_planner(load_robot('humanoid_arm')) if excitation is not None else None
    options = {'start': False, 'use_sim_time': True, 'approach': APPROACH, 'state_timeout': 0.5}
    options.update(parameters)
    node = bench.add(ExcitationPublisherNode, excitation, planner, **options)
    bench.tick(99 * SECOND)
    return node


def running(bench, arm, excitation, **parameters):
    """Make a publisher that has sent a run at 100 s."""
    node = waiting_publisher(bench, excitation, **parameters)
    arm.stand()
    node.start()
    sent(bench, arm.heard, 1)
    return node


def follow(bench, arm, until, off=0.0, step=0.2):
    """Let the arm follow what it heard last from 100 s on, off by something at the end."""
    reference = waypoints_of(arm.heard[0])
    times = np.arange(100.0 + step, until + 1e-9, step)
    for time in times:
        bench.tick(round(time * SECOND))
        q = reference.sample(np.array([time - 100.0])).q[0]
        arm.report(time, q + (off if time == times[-1] else 0.0))


def sent(bench, messages, count):
    bench.spin_until(lambda: len(messages) >= count, 'the trajectory')
    message = messages[count - 1]
    return seconds_of(message.header.stamp), waypoints_of(message)


def test_start_sends_the_way_from_where_the_arm_is_and_the_run(bench, arm, excitation, robot):
    node = waiting_publisher(bench, excitation)
    arm.stand()
    assert bench.call('excitation_publisher/start').success
    stamp, reference = sent(bench, arm.heard, 1)
    assert stamp == 100.0 and reference.t[0] > 0.0
    curve = reference.for_robot(robot).after(arm.q, np.zeros(6), np.zeros(6))
    assert np.abs(curve.q[1] - curve.q[0]).max() < 0.01
    curve.require_limits(robot, 0.001)
    assert reference.duration == pytest.approx(node.duration, abs=1e-6)
    way = node.duration - excitation.duration
    assert way >= APPROACH
    late = reference.t >= way
    run = excitation.at(reference.t[late] - way)
    np.testing.assert_allclose(reference.q[late], run.q, atol=1e-6)
    np.testing.assert_allclose(reference.dq[-1], 0.0, atol=1e-9)
    again = bench.call('excitation_publisher/start')
    assert not again.success and again.message


@pytest.mark.parametrize(
    ('report', 'words'),
    [
        (lambda bench, arm: None, "'shoulder_pitch'"),
        (lambda bench, arm: arm.report(99.0, arm.q[:5], arm.joints[:5]), "'wrist_pitch'"),
        (lambda bench, arm: arm.report(99.0, [*arm.q[:5], np.nan]), "'wrist_pitch'"),
        (lambda bench, arm: arm.stand() or bench.tick(102 * SECOND), '2.00 s'),
    ],
    ids=['none', 'a joint missing', 'a joint not a number', 'an old one'],
)
def test_without_a_fresh_joint_state_it_does_not_start(bench, arm, excitation, report, words):
    waiting_publisher(bench, excitation)
    report(bench, arm)
    answer = bench.call('excitation_publisher/start')
    assert not answer.success and words in answer.message and not arm.heard


@pytest.mark.parametrize('service', ['start', 'rehearse'])
@pytest.mark.parametrize('published', [False, True], ids=['no clock', 'a clock that stands'])
def test_without_a_clock_it_does_not_start(bench, arm, excitation, service, published):
    logged = bench.rosout()
    planner = free_planner(load_robot('humanoid_arm'))
    node = bench.add(ExcitationPublisherNode, excitation, planner, start=False, use_sim_time=True)
    if not published:
        bench.stop_clock()
        bench.spin_until(lambda: not node.count_publishers('/clock'), 'the end of /clock')
        for _ in range(3):
            node.look_for_trouble()
        bench.spin_until(lambda: logged, 'the warning')
        bench.settle()
        assert sum('/clock' in entry.msg for entry in logged) == 1
    arm.report(100.0)
    answer = bench.call(f'excitation_publisher/{service}')
    assert not answer.success and not arm.heard and node.elapsed is None
    assert '/clock' in answer.message
    assert ('use_sim_time:=false' in answer.message) is not published


def test_with_nobody_to_take_the_trajectory_it_does_not_start(bench, robot, excitation):
    node = waiting_publisher(bench, excitation)
    arm = StandIn(bench, robot.joints, (robot.lower + robot.upper) / 2.0, listens=False)
    arm.stand()
    answer = bench.call('excitation_publisher/start')
    assert not answer.success and node.elapsed is None
    assert '/joint_trajectory' in answer.message
    arm.listen()
    bench.spin_until(lambda: node.readers, 'a subscriber')
    assert bench.call('excitation_publisher/start').success


def test_joint_states_of_two_publishers_make_one_pose(bench, arm, excitation):
    waiting_publisher(bench, excitation)
    for seconds in (99.7, 99.8, 99.9, 100.0, 100.1):
        bench.tick(round(seconds * SECOND))
        arm.report(seconds, arm.q[:2], arm.joints[:2])
        arm.report(seconds, arm.q[:1:-1], arm.joints[:1:-1])
    assert bench.call('excitation_publisher/start').success


def test_from_a_pose_that_is_not_free_it_does_not_start(bench, arm, plan):
    file = str(plan / 'excitation.yaml')
    waiting_publisher(bench, None, file=file, rate=50.0, floor='-0.3')
    arm.stand(100.0, [np.pi / 2, -np.pi / 2, 0, 0, 0, 0])
    answer = bench.call('excitation_publisher/start')
    assert not answer.success and 'floor' in answer.message and not arm.heard


@pytest.mark.parametrize(
    ('parameters', 'begins'),
    [
        ({}, False),
        ({'simulation': True}, True),
        ({'use_sim_time': True}, True),
        ({'simulation': True, 'start': False}, False),
    ],
)
def test_it_begins_by_itself_only_in_a_simulation(bench, excitation, robot, parameters, begins):
    node = bench.add(ExcitationPublisherNode, excitation, free_planner(robot), **parameters)
    assert node.value('start') is begins
    assert node.value('speed') == ('fast' if parameters else 'slow')


def test_on_hardware_nothing_is_sent_until_it_is_asked_for(
    bench, arm, excitation, robot, monkeypatch
):
    monkeypatch.setattr(arm_watch, '_REST', 0.0)
    node = bench.add(ExcitationPublisherNode, excitation, free_planner(robot), state_timeout=10.0)
    arm.report(now_of(node))
    for _ in range(3):
        node.look()
    bench.settle()
    assert not arm.heard
    for _ in range(5):
        arm.report(now_of(node))
    assert bench.call('excitation_publisher/start').success
    sent(bench, arm.heard, 1)


def test_a_controller_that_starts_later_is_not_set_in_motion(bench, arm, excitation):
    node = running(bench, arm, excitation)
    late = bench.listen(JointTrajectory, 'joint_trajectory', STREAM)
    bench.spin_until(lambda: node.readers == 2, 'the second subscriber')
    follow(bench, arm, 103.0)
    assert not late


def test_a_blocked_arm_is_stopped_on_its_path_and_then_held_where_it_stands(
    bench, arm, excitation, robot
):
    node, diagnostics = running(bench, arm, excitation), bench.diagnostics()
    follow(bench, arm, 104.0)
    path = waypoints_of(arm.heard[0])
    where = path.sample(np.array([4.0])).q[0]
    for time in np.arange(104.05, 106.0, 0.05):  # a blocked arm: it stays where it is
        bench.tick(round(time * SECOND))
        arm.report(time, where)
    assert len(arm.heard) == 3
    stamp, stop = sent(bench, arm.heard, 2)
    assert stamp == 0.0
    ahead = path.sample(4.0 + np.linspace(0.0, 2.0, 4001)).q
    assert max(np.abs(ahead - q).max(axis=1).min() for q in stop.q) < 2e-3
    stamp, hold = sent(bench, arm.heard, 3)
    assert stamp == 0.0
    np.testing.assert_allclose(hold.q, [where, where], atol=1e-9)
    np.testing.assert_allclose(hold.dq, 0.0, atol=1e-9)
    curve = hold.for_robot(robot).after(stop.q[-1], np.zeros(6), np.zeros(6))
    curve.require_limits(robot, 0.001)
    message = bench.diagnose(node, diagnostics).message
    assert any(joint in message for joint in robot.joints) and '0.2 rad' in message


def test_an_arm_that_follows_as_well_as_is_tolerated_goes_on(bench, arm, excitation):
    node = running(bench, arm, excitation, tracking_tolerance=0.4)
    follow(bench, arm, 104.0, off=0.3)
    assert node.elapsed == pytest.approx(4.0) and len(arm.heard) == 1


def test_that_a_run_is_complete_is_logged_once_and_in_the_status(bench, arm, excitation):
    diagnostics, said = bench.diagnostics(), []
    node = waiting_publisher(bench, excitation)
    node.get_logger().info = said.append
    assert bench.diagnose(node, diagnostics).message == 'ready'
    arm.stand()
    node.start()
    sent(bench, arm.heard, 1)
    length = node.duration
    follow(bench, arm, 103.0)
    assert bench.diagnose(node, diagnostics).message == 'running'
    bench.tick(round((100.0 + length + 0.1) * SECOND))
    for _ in range(3):
        node.look()
    assert bench.diagnose(node, diagnostics).message == 'complete'
    (words,) = [text for text in said if 'complete' in text]
    assert f'{length:.1f} s' in words


def test_slowing_down_is_the_derivative_of_where_it_is(excitation):
    motion = slowed(excitation, 2.0, 0.5, 1000.0)
    numeric = np.gradient(motion.q, motion.t, axis=0, edge_order=2)
    np.testing.assert_allclose(motion.dq, numeric, atol=1e-3)
    numeric = np.gradient(motion.dq, motion.t, axis=0, edge_order=2)
    np.testing.assert_allclose(motion.ddq, numeric, atol=0.05)


def test_what_armid_excite_writes_is_run_as_its_bag_has_it(bench, arm, plan, robot):
    planned = read_waypoints(plan / 'trajectory', joints=robot.joints)
    excitation = load_excitation(plan / 'excitation.yaml')
    file = str(plan / 'excitation.yaml')
    node = waiting_publisher(bench, None, file=file, rate=50.0)
    arm.stand()
    node.start()
    _, reference = sent(bench, arm.heard, 1)
    count = round(50.0 * excitation.sampled_duration(50.0)) + 1
    document = json.loads((plan / 'excitation.json').read_text())
    begin = round(50.0 * document['approach'])
    for name in ('q', 'dq', 'ddq'):
        np.testing.assert_allclose(
            getattr(reference, name)[-count:],
            getattr(planned, name)[begin : begin + count],
            atol=1e-6,
        )


@pytest.mark.parametrize(
    ('spoil', 'parameters', 'fact'),
    [
        (lambda run: Excitation(run.trajectory.scaled(50.0), 1, 1.0), {}, 'position'),
        (lambda run: Excitation(run.trajectory.stretched(0.4), 1, 1.0), {}, 'velocity'),
        (None, {}, r'run\.yaml'),
        (lambda run: run, {'floor': '0.3'}, r'run\.yaml: .*floor'),
    ],
    ids=['beyond positions', 'beyond velocities', 'no excitation', 'through the floor'],
)
def test_a_file_that_cannot_be_run_is_refused(
    bench, excitation, tmp_path, spoil, parameters, fact
):
    path = tmp_path / 'run.yaml'
    if spoil is None:
        path.write_text('schema: something/else\n')
    else:
        save_excitation(spoil(excitation), path)
    with pytest.raises(ArmidError, match=fact):
        bench.add(ExcitationPublisherNode, file=str(path), **parameters)


def test_a_duration_without_room_for_the_periods_is_refused(bench):
    with pytest.raises(ArmidError, match='periods'):
        bench.add(ExcitationPublisherNode, duration=5.0, n_periods=4)
