# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""In lock step nothing is lost and the outcome is the same every time."""

from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError
from armid_ros.excitation import Excitation, Limits, random_feasible
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.nodes.bag_player import BagPlayerNode
from armid_ros.nodes.lockstep import EPOCH_NS, MESSAGE_TIMEOUT, run_lockstep, Stage
from armid_ros.nodes.online_identifier import OnlineIdentifierNode
from armid_ros.recording import read_recording, topics
from armid_ros.robots import load_robot
from armid_ros.simulation import Sensors, SimulatedArm
import numpy as np
import pytest
from rclpy.time import Time
from rosgraph_msgs.msg import Clock

RATE = 200.0
AT_REST = 0.27  # what the publisher sees of the arm before it starts
APPROACH = 3.0
EFFECTS = ('viscous_friction:viscous_coefficient=0.5', 'torque_offset:torque_offset=0.1')


@pytest.fixture(scope='module')
def robot():
    return load_robot('humanoid_arm', gravity='moon')


@pytest.fixture(scope='module')
def truth(robot):
    return ArmModel.of(robot, effects=EFFECTS)


@pytest.fixture(scope='module')
def excitation(truth, robot):
    rng = np.random.default_rng(1)
    trajectory = random_feasible(truth, Limits.of(robot, speed='medium'), 3.0, 3, rng)
    return Excitation(trajectory, n_periods=1, run_in=1.0)


def identifier(robot):
    arm = ArmModel.of(robot, effects=[effect.partition(':')[0] for effect in EFFECTS])
    return OnlineIdentifier(arm, rng=np.random.default_rng(0))


def run(truth, excitation, bag, learner=None, **options):
    rng = np.random.default_rng(2)
    arm = SimulatedArm(truth, rng=rng, sensors=Sensors(torque_noise=0.05))
    return run_lockstep(arm, excitation, bag, learner, rate=RATE, **options)


@pytest.fixture(scope='module')
def first_run(truth, robot, excitation, tmp_path_factory):
    """Return the bag, the result, and what was learned."""
    bag, told, learner = tmp_path_factory.mktemp('lockstep') / 'bag', [], identifier(robot)
    result = run(
        truth, excitation, bag, learner, on_progress=lambda now: told.append(round(now.t))
    )
    assert told == list(range(1, len(told) + 1))
    return bag, result, learner


def test_every_sample_is_recorded_on_time(first_run, robot, excitation):
    bag, result, _ = first_run
    recording = read_recording(bag, joints=robot.joints)
    assert recording.report.clean
    assert recording.start_ns == EPOCH_NS + round(1e9 / RATE)
    np.testing.assert_allclose(np.diff(recording.t), 1.0 / RATE, atol=1e-9)
    assert recording.t[-1] + 1.0 / RATE == pytest.approx(result.t)
    assert result.t == pytest.approx(AT_REST + APPROACH + excitation.duration + 0.5, abs=0.02)
    found = {topic.name: topic.count for topic in topics(bag)}
    assert found['/robot_description'] == found['/joint_trajectory'] == 1
    assert found['/joint_states'] == len(recording) and found['/online_identifier/estimate'] > 10


def test_a_replay_learns_the_same(first_run, robot):
    """The bag is played in lock step with /clock, in steps of 2 ms."""
    bag, result, learner = first_run
    again, step, now = identifier(robot), 2_000_000, EPOCH_NS
    with Stage() as stage:
        player = stage.add(
            BagPlayerNode,
            bag=str(bag),
            topics=['joint_states'],
            subscriber_timeout=MESSAGE_TIMEOUT,
        )
        node = stage.add(OnlineIdentifierNode, again)
        clock = player.create_publisher(Clock, '/clock', 10)
        stage.spin_until(
            lambda: clock.get_subscription_count() >= 2 and node.joint_states.publishers,
            'joint_states',
        )
        while now < EPOCH_NS + round(result.t * 1e9) and not player.finished:
            now += step
            clock.publish(Clock(clock=Time(nanoseconds=now).to_msg()))
            due = (now - EPOCH_NS - step - 1) * 1e-9
            stage.spin_until(
                lambda due=due: not player.waiting and player.position >= due, '/clock'
            )
            count = player.published['/joint_states']
            stage.spin_until(lambda count=count: node.received >= count, 'joint_states')
    assert again.samples == learner.samples
    np.testing.assert_allclose(again.estimate().values, learner.estimate().values, rtol=1e-9)


def test_another_run_gives_the_same_samples_whether_somebody_learns_or_not(
    first_run, truth, robot, excitation, tmp_path
):
    run(truth, excitation, tmp_path / 'bag')
    first, second = (
        read_recording(bag, joints=robot.joints) for bag in (first_run[0], tmp_path / 'bag')
    )
    for name in ('t', 'q', 'tau'):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_an_excitation_beyond_the_limits_ends_the_run_with_its_reason(
    truth, robot, excitation, tmp_path
):
    with pytest.raises(ArmidError, match='velocity'):
        run(truth, Excitation(excitation.trajectory.stretched(0.5), 1), tmp_path / 'bag')
    assert len(read_recording(tmp_path / 'bag', joints=robot.joints)) > 0
