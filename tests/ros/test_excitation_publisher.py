# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The excitation publisher begins where the arm is, watches it, and stops it."""

import json

from armid_ros.errors import ArmidError, TrajectoryError
from armid_ros.excitation import Excitation, load_excitation, plan_run, save_excitation
from armid_ros.excitation.supervision import slowed
from armid_ros.nodes import arm_watch, excitation_publisher
from armid_ros.nodes.excitation_publisher import ExcitationPublisherNode
from armid_ros.nodes.qos import STREAM
from armid_ros.recording import read_waypoints
from armid_ros.recording.trajectory import waypoints_of
import numpy as np
import pytest
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

from tests.cli.conftest import armid
from tests.ros.controller import Controller, joint_state, SECOND, seconds_of
from tests.ros.test_controller import begun, free_planner, HOME, publisher, ROBOT, waiting

JOINTS = ROBOT.joints
#: Times at which an arm is reported that stands until 100 s [s].
STANDS = 99.6 + 0.1 * np.arange(5)


@pytest.fixture(scope='module')
def plan(tmp_path_factory):
    """Run armid excite, hurriedly, with drives as good as they may be."""
    out = tmp_path_factory.mktemp('plan')
    options = '--robot humanoid_arm --duration 8 --acceleration 30 --starts 1 --iterations 2'
    armid('excite', *options.split(), '--speed', 'slow', '--out', out)
    return out


@pytest.fixture
def arm(bench):
    return Controller(bench, ROBOT, HOME)


def told(bench, *parts, at=(99.0,)):
    """Report positions of some joints, each part its names and positions, at some times."""
    drivers = bench.matched_publisher(JointState, 'joint_states')
    for seconds in at:
        bench.tick(round(seconds * SECOND))
        for names, q in parts:
            drivers.publish(joint_state(seconds, names, q))
        bench.settle()


def listening(bench):
    return bench.listen(JointTrajectory, 'joint_trajectory', STREAM)


def test_start_sends_the_way_from_where_the_arm_is_and_the_run(bench, arm, excitation):
    node = publisher(bench, arm, excitation)
    assert bench.call('excitation_publisher/start').success
    bench.spin_until(lambda: arm.accepted, 'the trajectory')
    reference = waypoints_of(arm.accepted[0])
    assert seconds_of(arm.accepted[0].header.stamp) == arm.now and reference.t[0] > 0.0
    curve = reference.for_robot(ROBOT).after(HOME, np.zeros(6), np.zeros(6))
    assert np.abs(curve.q[1] - curve.q[0]).max() < 0.01
    curve.require_limits(ROBOT, 0.001)
    assert reference.duration == pytest.approx(node.duration, abs=1e-6)
    way = node.duration - excitation.duration
    assert way >= 1.0
    late = reference.t >= way
    run = excitation.at(reference.t[late] - way)
    np.testing.assert_allclose(reference.q[late], run.q, atol=1e-6)
    np.testing.assert_allclose(reference.dq[-1], 0.0, atol=1e-9)
    again = bench.call('excitation_publisher/start')
    assert not again.success and again.message


@pytest.mark.parametrize(
    ('part', 'at', 'words'),
    [
        (None, (), "'shoulder_pitch'"),
        ((JOINTS[:5], HOME[:5]), [99.0], "'wrist_pitch'"),
        ((JOINTS, [*HOME[:5], np.nan]), [99.0], "'wrist_pitch'"),
        ((JOINTS, HOME), STANDS, '2.00 s'),
    ],
    ids=['none', 'a joint missing', 'a joint not a number', 'an old one'],
)
def test_without_a_fresh_joint_state_it_does_not_start(bench, excitation, part, at, words):
    waiting(bench, excitation)
    heard = listening(bench)
    told(bench, part, at=at)
    bench.tick((102 if words == '2.00 s' else 99) * SECOND)
    answer = bench.call('excitation_publisher/start')
    assert not answer.success and words in answer.message and not heard


@pytest.mark.parametrize('service', ['start', 'rehearse'])
@pytest.mark.parametrize('published', [False, True], ids=['no clock', 'a clock that stands'])
def test_without_a_clock_it_does_not_start(bench, excitation, service, published):
    logged, heard = bench.rosout(), listening(bench)
    node = bench.add(
        ExcitationPublisherNode, excitation, free_planner(), start=False, use_sim_time=True
    )
    if not published:
        bench.stop_clock()
        bench.spin_until(lambda: not node.count_publishers('/clock'), 'the end of /clock')
        for _ in range(3):
            node.log_trouble()
        bench.spin_until(lambda: logged, 'the warning')
        bench.settle()
        assert sum('/clock' in entry.msg for entry in logged) == 1
    drivers = bench.matched_publisher(JointState, 'joint_states')
    drivers.publish(joint_state(100.0, JOINTS, HOME))
    bench.settle()
    answer = bench.call(f'excitation_publisher/{service}')
    assert not answer.success and not heard and node.elapsed is None
    assert '/clock' in answer.message
    assert ('use_sim_time:=false' in answer.message) is not published


def test_with_nobody_to_take_the_trajectory_it_does_not_start(bench, excitation):
    node = waiting(bench, excitation)
    told(bench, (JOINTS, HOME), at=STANDS)
    answer = bench.call('excitation_publisher/start')
    assert not answer.success and node.elapsed is None
    assert '/joint_trajectory' in answer.message
    listening(bench)
    bench.spin_until(lambda: node.readers, 'a subscriber')
    assert bench.call('excitation_publisher/start').success


def test_joint_states_of_two_publishers_make_one_pose(bench, excitation):
    waiting(bench, excitation)
    listening(bench)
    told(bench, (JOINTS[:2], HOME[:2]), (JOINTS[:1:-1], HOME[:1:-1]), at=STANDS)
    assert bench.call('excitation_publisher/start').success


def test_two_publishers_of_a_joint_do_not_start_whatever_their_order(bench, excitation):
    """As a simulated arm beside the real one, at the same pose."""
    waiting(bench, excitation)
    listening(bench)
    first, second = (bench.matched_publisher(JointState, 'joint_states') for _ in range(2))
    for seconds in STANDS:
        bench.tick(round(seconds * SECOND))
        first.publish(joint_state(seconds, JOINTS, HOME))
        second.publish(joint_state(seconds, JOINTS[::-1], HOME[::-1]))
        bench.settle()
    answer = bench.call('excitation_publisher/start')
    assert not answer.success and 'publishers' in answer.message


def test_from_a_pose_that_is_not_free_it_does_not_start(bench, plan):
    waiting(bench, None, file=str(plan / 'excitation.yaml'), rate=50.0, floor='-0.3')
    heard = listening(bench)
    told(bench, (JOINTS, [np.pi / 2, -np.pi / 2, 0, 0, 0, 0]), at=STANDS)
    answer = bench.call('excitation_publisher/start')
    assert not answer.success and 'floor' in answer.message and not heard


@pytest.mark.parametrize('moved', [False, True])
def test_an_arm_that_moves_while_its_way_is_planned_is_not_started(
    bench, arm, excitation, monkeypatch, moved
):
    node = publisher(bench, arm, excitation)

    def planning(*args, **options):
        run = plan_run(*args, **options)
        arm.q = arm.q + 0.05 * moved  # by another client
        states = bench.listen(JointState, 'joint_states')
        arm.now += 0.1
        arm._publish()
        bench.executor.remove_node(node)
        bench.spin_until(lambda: states, 'a joint state')
        bench.executor.add_node(node)
        return run

    monkeypatch.setattr(excitation_publisher, 'plan_run', planning)
    if moved:
        with pytest.raises(TrajectoryError, match='not started'):
            node.start()
    else:
        node.start()
    assert (node.elapsed is None) == moved


@pytest.mark.parametrize(
    ('parameters', 'begins'),
    [
        ({}, False),
        ({'simulation': True}, True),
        ({'use_sim_time': True}, True),
        ({'simulation': True, 'start': False}, False),
    ],
)
def test_it_begins_by_itself_only_in_a_simulation(bench, excitation, parameters, begins):
    node = bench.add(ExcitationPublisherNode, excitation, free_planner(), **parameters)
    assert node.value('start') is begins
    assert node.value('speed') == ('fast' if parameters else 'slow')


def test_on_hardware_nothing_is_sent_until_it_is_asked_for(bench, excitation, monkeypatch):
    monkeypatch.setattr(arm_watch, '_REST', 0.0)
    heard = listening(bench)
    node = bench.add(ExcitationPublisherNode, excitation, free_planner(), state_timeout=10.0)
    drivers = bench.matched_publisher(JointState, 'joint_states')

    def report():
        now = node.get_clock().now().nanoseconds / SECOND
        drivers.publish(joint_state(now, JOINTS, HOME))
        bench.settle()

    report()
    for _ in range(3):
        node.poll()
    bench.settle()
    assert not heard
    for _ in range(5):
        report()
    assert bench.call('excitation_publisher/start').success
    bench.spin_until(lambda: heard, 'the trajectory')


def test_a_controller_that_starts_later_is_not_set_in_motion(bench, arm, excitation):
    node = begun(bench, arm, excitation)
    late = listening(bench)
    bench.spin_until(lambda: node.readers == 2, 'the second subscriber')
    arm.run(103.0)
    assert not late


@pytest.mark.parametrize('whole', [False, True])
def test_a_blocked_arm_is_stopped_on_its_path_and_held_where_it_stands(
    bench, arm, excitation, whole
):
    """An arm whose joints all stand is held at once, as after a restart of the controller."""
    diagnostics = bench.diagnostics()
    node = begun(bench, arm, excitation, tracking_tolerance=0.1)
    arm.run(102.2)
    path, where = waypoints_of(arm.accepted[0]), arm.q.copy()
    stuck = slice(None) if whole else [int(np.argmax(np.abs(arm.state(arm.now).dq)))]
    arm.faults.stuck = stuck
    arm.run(104.2, step=0.05)
    assert {seconds_of(m.header.stamp) for m in arm.accepted[1:]} == {0.0}
    *stops, hold = (waypoints_of(message) for message in arm.accepted[1:])
    assert len(stops) == (0 if whole else 1)
    ahead = path.sample(2.0 + np.linspace(0.0, 2.0, 4001)).q
    for stop in stops:
        assert max(np.abs(ahead - q).max(axis=1).min() for q in stop.q) < 2e-3
        curve = hold.for_robot(ROBOT).after(stop.q[-1], np.zeros(6), np.zeros(6))
        curve.require_limits(ROBOT, 0.001)
    np.testing.assert_allclose(hold.q[:, stuck], [where[stuck]] * 2, atol=1e-9)
    np.testing.assert_allclose(hold.dq, 0.0, atol=1e-9)
    message = bench.diagnose(node, diagnostics).message
    assert any(joint in message for joint in JOINTS) and '0.1 rad' in message


def test_an_arm_that_follows_as_well_as_is_tolerated_goes_on(bench, arm, excitation):
    node = begun(bench, arm, excitation, tracking_tolerance=0.4)
    arm.run(102.0)
    told(bench, (JOINTS, arm.state(102.2).q[0] + 0.3), at=[102.2])
    assert node.elapsed == pytest.approx(2.0) and len(arm.accepted) == 1


def test_slowing_down_is_the_derivative_of_where_it_is(excitation):
    motion = slowed(excitation, 2.0, 0.5, 1000.0)
    numeric = np.gradient(motion.q, motion.t, axis=0, edge_order=2)
    np.testing.assert_allclose(motion.dq, numeric, atol=1e-3)
    numeric = np.gradient(motion.dq, motion.t, axis=0, edge_order=2)
    np.testing.assert_allclose(motion.ddq, numeric, atol=0.05)


def test_what_armid_excite_writes_is_run_as_its_bag_has_it(bench, arm, plan):
    planned = read_waypoints(plan / 'trajectory', joints=JOINTS)
    run = load_excitation(plan / 'excitation.yaml')
    begun(bench, arm, None, file=str(plan / 'excitation.yaml'), rate=50.0)
    reference = waypoints_of(arm.accepted[0])
    count = round(50.0 * run.sampled_duration(50.0)) + 1
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
