# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The excitation publisher sends whole runs, and stops them on their own path."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.cli.excite import excite
from armid_ros.errors import ArmidError
from armid_ros.excitation import (
    Excitation,
    Limits,
    load_excitation,
    random_feasible,
    save_excitation,
)
from armid_ros.nodes.excitation_publisher import ExcitationPublisherNode, slowed
from armid_ros.nodes.qos import LATCHED
from armid_ros.nodes.trajectories import read_trajectory
from armid_ros.recording import read_joint_trajectory
from armid_ros.robots import load_robot
from click.testing import CliRunner
import numpy as np
import pytest
from trajectory_msgs.msg import JointTrajectory

SECOND = 10**9
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
def plans(tmp_path_factory):
    """Run armid excite for two speed classes, hurriedly, with drives as good as they may be."""
    out = tmp_path_factory.mktemp('plans')
    options = '--robot humanoid_arm --duration 8 --speed slow,fast --acceleration 30'
    hurry = '--starts 1 --iterations 2'
    result = CliRunner().invoke(excite, [*options.split(), *hurry.split(), '--out', str(out)])
    assert result.exit_code == 0, result.output
    return out


def waiting_publisher(bench, excitation, **parameters):
    """Make a publisher on simulated time, at 100 s, that begins when it is told."""
    options = {'start': False, 'use_sim_time': True, 'approach': APPROACH, **parameters}
    node = bench.add(ExcitationPublisherNode, excitation, **options)
    bench.tick(100 * SECOND)
    return node


def sent(bench, messages, count):
    bench.spin_until(lambda: len(messages) >= count, 'the trajectory')
    message = messages[count - 1]
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec, read_trajectory(message)


def test_start_sends_the_run_stamped_with_its_beginning(bench, excitation):
    messages = bench.listen(JointTrajectory, 'joint_trajectory', LATCHED)
    node = waiting_publisher(bench, excitation)
    assert bench.call('excitation_publisher/start').success
    stamp, reference = sent(bench, messages, 1)
    assert stamp == 100.0
    assert reference.t[0] == APPROACH and reference.duration == pytest.approx(node.duration)
    run = excitation.at(reference.t - APPROACH)
    np.testing.assert_allclose(reference.q, run.q, atol=1e-9)
    np.testing.assert_allclose(reference.dq, run.dq, atol=1e-9)
    np.testing.assert_allclose(reference.dq[[0, -1]], 0.0, atol=1e-9)
    again = bench.call('excitation_publisher/start')
    assert not again.success and 'under way' in again.message


def test_it_begins_by_itself_when_somebody_listens(bench, excitation):
    node = waiting_publisher(bench, excitation, start=True)
    bench.settle()
    assert node.elapsed is None
    messages = bench.listen(JointTrajectory, 'joint_trajectory', LATCHED)
    sent(bench, messages, 1)


def test_who_comes_late_gets_the_run_with_the_stamp_it_began_at(bench, excitation):
    waiting_publisher(bench, excitation).start()
    bench.tick(103 * SECOND)
    messages = bench.listen(JointTrajectory, 'joint_trajectory', LATCHED)
    stamp, _ = sent(bench, messages, 1)
    assert stamp == 100.0


def test_stop_brings_it_to_rest_on_the_path(bench, excitation, robot):
    messages = bench.listen(JointTrajectory, 'joint_trajectory', LATCHED)
    node = waiting_publisher(bench, excitation)
    node.start()
    sent(bench, messages, 1)
    bench.tick(104 * SECOND)
    assert bench.call('excitation_publisher/stop').success
    _, reference = sent(bench, messages, 2)
    phase = 104.0 - 100.0 - APPROACH
    ahead = excitation.at(phase + np.linspace(0.0, 1.0, 2001)).q
    for q in reference.q[::10]:
        assert np.abs(ahead - q).max(axis=1).min() < 2e-3
    np.testing.assert_allclose(reference.dq[-1], 0.0, atol=1e-9)
    reference.for_robot(robot).require_limits(robot, 0.001)
    assert node.elapsed is None
    refused = bench.call('excitation_publisher/stop')
    assert not refused.success and 'nothing' in refused.message


def test_stop_on_the_way_there_ends_at_the_first_point(bench, excitation):
    messages = bench.listen(JointTrajectory, 'joint_trajectory', LATCHED)
    node = waiting_publisher(bench, excitation)
    node.start()
    sent(bench, messages, 1)
    bench.tick(101 * SECOND)
    node.stop()
    _, reference = sent(bench, messages, 2)
    assert len(reference.t) == 1 and reference.t[0] == pytest.approx(APPROACH - 1.0)
    np.testing.assert_allclose(reference.q[0], excitation.at([0.0]).q[0])


def test_after_the_end_it_can_start_again(bench, excitation):
    node = waiting_publisher(bench, excitation)
    node.start()
    bench.tick(round((100.0 + node.duration + 0.1) * SECOND))
    assert bench.call('excitation_publisher/start').success


def test_slowing_down_is_the_derivative_of_where_it_is(excitation):
    motion = slowed(excitation, 2.0, 0.5, 1000.0)
    numeric = np.gradient(motion.q, motion.t, axis=0, edge_order=2)
    np.testing.assert_allclose(motion.dq, numeric, atol=1e-3)
    numeric = np.gradient(motion.dq, motion.t, axis=0, edge_order=2)
    np.testing.assert_allclose(motion.ddq, numeric, atol=0.05)


def test_a_file_is_loaded(bench, excitation, tmp_path):
    save_excitation(excitation, tmp_path / 'run.yaml')
    node = bench.add(ExcitationPublisherNode, file=str(tmp_path / 'run.yaml'), start=False)
    assert node.duration == pytest.approx(3.0 + excitation.duration)
    assert load_excitation(tmp_path / 'run.yaml').joints == excitation.joints


@pytest.mark.parametrize('speed', ['slow', 'fast'])
def test_what_armid_excite_writes_is_run_as_its_bag_has_it(bench, plans, robot, speed):
    planned = read_joint_trajectory(plans / speed / 'trajectory', joints=robot.joints)
    messages = bench.listen(JointTrajectory, 'joint_trajectory', LATCHED)
    file = str(plans / speed / 'excitation.yaml')
    waiting_publisher(bench, None, file=file, rate=50.0).start()
    _, reference = sent(bench, messages, 1)
    np.testing.assert_allclose(reference.t - APPROACH, planned.t, atol=1e-6)
    for name in ('q', 'dq', 'ddq'):
        np.testing.assert_allclose(getattr(reference, name), getattr(planned, name), atol=1e-9)


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        (lambda e: Excitation(e.trajectory.scaled(50.0), 1, 1.0), 'position'),
        (lambda e: Excitation(e.trajectory.stretched(0.4), 1, 1.0), 'velocity'),
    ],
)
def test_a_file_beyond_the_limits_is_refused(bench, excitation, tmp_path, change, words):
    save_excitation(change(excitation), tmp_path / 'run.yaml')
    with pytest.raises(ArmidError, match=words):
        bench.add(ExcitationPublisherNode, file=str(tmp_path / 'run.yaml'))


def test_an_excitation_of_another_robot_is_refused(bench, excitation, tmp_path):
    (tmp_path / 'run.yaml').write_text('schema: something/else\n')
    with pytest.raises(ArmidError, match=r'run\.yaml'):
        bench.add(ExcitationPublisherNode, file=str(tmp_path / 'run.yaml'))


def test_a_duration_without_room_for_the_periods_is_refused(bench):
    with pytest.raises(ArmidError, match='fewer periods'):
        bench.add(ExcitationPublisherNode, duration=5.0, n_periods=4)
