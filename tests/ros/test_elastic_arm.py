# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm with elastic joints, live: both sides on topics, recorded, identified from the bag."""

from __future__ import annotations

from armid_ros.nodes.qos import LATCHED
from armid_ros.nodes.recorder import RecorderNode
from armid_ros.papers.elastic.identification.files import read_runs
from armid_ros.papers.elastic.identification.three_steps import identify_two_inertia
from armid_ros.papers.elastic.plant.signals import EXCITATION_RMS, resonance_experiments
from armid_ros.robots import load_robot
from armid_ros.robots.two_link import two_link_set
from builtin_interfaces.msg import Duration
import numpy as np
import pytest
from sensor_msgs.msg import Imu, JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from tests.ros.test_simulated_arm import SECOND, still_arm

ROBOT = load_robot('two_link_elastic')
SIDES = ('joint_states', 'link/joint_states', 'reference/joint_states', 'link1/imu', 'link2/imu')


def trajectory(t, q, tau=None, *, at_rest=False, joints=ROBOT.joints):
    """Return waypoints as a message, with torque on top."""
    message = JointTrajectory(joint_names=list(joints))
    for k, nanoseconds in enumerate(np.rint(np.asarray(t) * 1e9).astype(int).tolist()):
        point = JointTrajectoryPoint(positions=np.asarray(q[k]).tolist())
        if at_rest:
            point.velocities = [0.0] * len(joints)
        point.effort = [] if tau is None else tau[k].tolist()
        point.time_from_start = Duration(sec=nanoseconds // SECOND, nanosec=nanoseconds % SECOND)
        message.points.append(point)
    return message


def send(bench, publisher, arm, message):
    publisher.publish(message)
    bench.spin_until(lambda: arm.moving or arm.complaints.counts, 'the trajectory')
    assert not arm.complaints.counts, arm.complaints.latest


def test_both_sides_are_published_with_one_stamp(bench):
    arm = still_arm(bench, robot='two_link_elastic', rate=100.0, start='0.3,-0.4')
    kinds = (JointState, JointState, JointState, Imu, Imu)
    heard = [bench.listen(kind, topic) for kind, topic in zip(kinds, SIDES, strict=True)]
    bench.settle()
    stamp = arm.step()
    bench.spin_until(lambda: all(heard), 'all topics')
    stamps = {m[0].header.stamp.sec * SECOND + m[0].header.stamp.nanosec for m in heard}
    assert stamps == {stamp}
    motor, link, reference, *imus = (messages[0] for messages in heard)
    for message in (motor, link, reference):
        np.testing.assert_allclose(message.position, [0.3, -0.4], atol=1e-12)
    assert [m.header.frame_id for m in imus] == list(ROBOT.links)
    up = imus[1].linear_acceleration
    np.testing.assert_allclose([up.x, up.y, up.z], [0.0, 0.0, 9.81], atol=1e-9)


@pytest.mark.long
def test_a_bag_recorded_live_tells_the_springs(bench, tmp_path):
    arm = still_arm(
        bench, robot='two_link_elastic', rate=1000.0, loop_gain=0.15, start='0,0',
        velocity_noise=[0.003], acceleration_noise=0.08,
    )  # fmt: skip
    recorder = bench.add(RecorderNode, bag=str(tmp_path / 'bag'), topics=list(SIDES))
    publisher = bench.matched_publisher(JointTrajectory, 'joint_trajectory', LATCHED)
    bench.spin_until(lambda: recorder.look() or not recorder.missing, 'the recorder')
    rng = np.random.default_rng(0)

    def run(message, steps):
        send(bench, publisher, arm, message)
        for _ in range(0, steps, 8):  # as many as a topic holds, and some to spare
            stamp = [arm.step() for _ in range(8)][-1]
            bench.spin_until(
                lambda stamp=stamp: all(
                    recorder.last_stamps.get(f'/{topic}') == stamp for topic in SIDES
                ),
                'the recorder',
            )

    for experiment in resonance_experiments(2, rms=EXCITATION_RMS, rng=rng, duration=2.0):
        way = 1e-3 * np.cumsum(experiment.velocity, axis=0)
        t = 1e-3 * np.arange(len(way))
        run(trajectory([0.5], [experiment.q], at_rest=True), 650)
        run(trajectory(t, experiment.q + way - way[0], experiment.torque), len(t) + 110)
    recorder.close()
    shipped = two_link_set('after')
    radius = shipped.assumptions['accelerometer_radius']
    runs = read_runs(tmp_path / 'bag', ROBOT, radius)
    assert len(runs) == 4
    found = identify_two_inertia(runs, shipped.parameters).parameters
    np.testing.assert_allclose(found.stiffness, shipped.parameters.stiffness, rtol=0.02)
    np.testing.assert_allclose(found.rotor, shipped.parameters.rotor, rtol=0.03)
    np.testing.assert_allclose(found.inertia, shipped.parameters.inertia, rtol=0.03)


def test_any_arm_hangs_its_links_on_springs_and_follows(bench):
    robot = load_robot('humanoid_arm')
    arm = still_arm(
        bench,
        rate=100.0,
        effects=[
            'rotor_inertia:rotor_inertia=0.02',
            'viscous_friction:viscous_coefficient=0.1',
            'joint_elasticity:compliance=0.0005',
        ],
    )
    motors = bench.listen(JointState, 'joint_states')
    links = bench.listen(JointState, 'link/joint_states')
    publisher = bench.matched_publisher(JointTrajectory, 'joint_trajectory', LATCHED)
    goal = (robot.lower + robot.upper) / 2.0 + 0.2
    send(bench, publisher, arm, trajectory([1.0], [goal], at_rest=True, joints=robot.joints))
    for _ in range(200):
        arm.step()
        bench.settle()
    np.testing.assert_allclose(links[-1].position, goal, atol=1e-4)
    twist = np.subtract(motors[-1].position, links[-1].position)
    np.testing.assert_allclose(twist, 0.0005 * np.array(motors[-1].effort), rtol=1e-3, atol=5e-7)
    assert np.abs(twist).max() > 5e-4


def test_springs_without_rotors_are_said_and_twist_under_load(bench):
    rosout = bench.rosout()
    arm = still_arm(bench, rate=100.0, effects=['joint_elasticity:compliance=0.0005'])
    states = bench.listen(JointState, 'joint_states')
    arm.step()
    bench.spin_until(lambda: states and any('add rotor_inertia' in m.msg for m in rosout))
    assert bench.probe.count_publishers('link/joint_states') == 0
