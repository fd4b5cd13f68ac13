# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Whatever happens around it, the identifier says so and works on.

A schedule is a few random events, each followed by joint states that are as they should be:
publishers end, begin anew with another quality of service, or are two; the identifier is killed,
restarted, or there are two of them; the clock is set back or forth; messages are damaged. After
each the identifier has to learn from what comes, and in the end to know the arm.

    ARMID_CHAOS=100 pytest tests/ros/test_chaos.py

"""

import os

from armid_ros.arm import ArmModel
from armid_ros.nodes.online_identifier import OnlineIdentifierNode
import numpy as np
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from tests.ros.test_online_identifier import EFFECT, message, PENDULUM, RATE, spoil, two_sines

pytestmark = pytest.mark.long

SCHEDULES = int(os.environ.get('ARMID_CHAOS', 4))
#: Deviations and SI units by which the estimate may be off in the end.
DEVIATIONS, BIAS = 5.0, 5e-3
NUMBER = 6
#: Samples that are learned after an event, and in the end.
CHUNK, LAST = 50, 1000
#: Joint states that are sent at once: what two senders say of one time must not be far apart.
PIECE = 5
NOISE = 0.02
QOS = tuple(
    QoSProfile(depth=1000, reliability=reliability, durability=durability)
    for reliability in (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT)
    for durability in (DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL)
)


class World:
    """An arm in motion, who publishes its joint states, and who identifies it."""

    def __init__(self, bench, rng, folder):
        self.bench, self.rng = bench, rng
        (folder / 'arm.urdf').write_text(PENDULUM)
        self.description = str(folder / 'arm.urdf')
        self.arm = ArmModel.of(PENDULUM, effects=EFFECT)
        self.k, self.offset, self.made = 0, 0.0, 0
        self.identifiers, self.publishers = [], []
        self.begin_identifier()
        self.begin_publisher()

    def begin_identifier(self):
        self.made += 1
        node = self.bench.add(
            OnlineIdentifierNode,
            namespace=f'identifier_{self.made}',
            effects=['viscous_friction'],
            robot=self.description,
            cli_args=['--ros-args', '-r', 'joint_states:=/joint_states'],
        )
        self.identifiers.append(node)

    def kill_identifier(self):
        """End it as SIGKILL does: nothing is closed."""
        node = self.identifiers.pop(0)
        self.bench.executor.remove_node(node)
        node.destroy_node()
        if not self.identifiers:
            self.begin_identifier()

    def begin_publisher(self):
        qos = QOS[self.rng.integers(len(QOS))]
        self.publishers.append(self.bench.probe.create_publisher(JointState, '/joint_states', qos))

    def end_publisher(self):
        self.bench.probe.destroy_publisher(self.publishers.pop(0))
        if not self.publishers:
            self.begin_publisher()

    def set_clock(self):
        self.offset += self.rng.choice([-500.0, -1.0, -0.02, 0.5, 3600.0])

    def damage(self):
        """Send joint states that are damaged, among good ones."""
        kinds = ('unknown joints', 'wrong length', 'no effort', 'nan', 'infinite', 'twice')
        batch = self.states(40)
        for k in self.rng.choice(40, 8, replace=False):
            batch[k] = spoil(batch[k], self.rng.choice(kinds))
        for k in self.rng.choice(40, 4, replace=False):
            batch[k].header.stamp.sec = int(self.rng.integers(-(2**31), 2**31))
        self.send(batch)

    def states(self, count):
        """Return the next joint states of the motion."""
        motion = two_sines(self.arm, (self.k + np.arange(count)) / RATE, 0.37)
        self.k += count
        tau = motion.tau + NOISE * self.rng.normal(size=motion.q.shape)
        rows = zip(motion.t + self.offset, motion.q, motion.dq, tau, strict=True)
        return [message(self.arm.robot.joints, *row) for row in rows]

    def send(self, batch):
        """Let every publisher send every message; who has just begun may miss some."""
        for state in batch:
            for publisher in self.publishers:
                publisher.publish(state)
        self.bench.settle()

    def works_on(self, count):
        """Send good joint states; every identifier learns from them, and says how it is."""
        before = [node.identifier.samples for node in self.identifiers]

        def enough():
            self.send(self.states(PIECE))
            return all(
                node.identifier.samples >= samples + count
                for node, samples in zip(self.identifiers, before, strict=True)
            )

        self.bench.spin_until(enough, 'enough to learn from')
        for node in self.identifiers:
            assert node.complaints.defects == 0, node.complaints.latest
            node.publish_diagnostics()
            node.publish_estimate()


EVENTS = (
    World.begin_identifier,
    World.kill_identifier,
    World.begin_publisher,
    World.end_publisher,
    World.set_clock,
    World.damage,
)


@pytest.mark.parametrize('seed', range(SCHEDULES))
def test_it_works_on_whatever_happens(bench, tmp_path, seed):
    rng = np.random.default_rng(seed)
    world = World(bench, rng, tmp_path)
    world.works_on(CHUNK)
    happened = []
    for event in rng.choice(len(EVENTS), NUMBER):
        happened.append(EVENTS[event].__name__)
        EVENTS[event](world)
        world.works_on(CHUNK)
    for _ in range(LAST // CHUNK):
        world.works_on(CHUNK)
    truth = world.identifiers[0].identifier.base.values(world.arm.theta)
    for node in world.identifiers:
        estimate = node.identifier.estimate()
        error = np.abs(estimate.values - truth)
        assert np.all(np.isfinite(error)), happened
        wide = DEVIATIONS * estimate.std + BIAS
        assert np.all(error < wide), (happened, error, estimate.std)
