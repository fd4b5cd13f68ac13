# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What can change without harm is set on running nodes; a dump of a node can be loaded again."""

from unittest.mock import Mock

from armid_ros.arm import ArmModel
from armid_ros.identification.online.identifier import OnlineIdentifier, OnlineSettings
from armid_ros.nodes.bag_player import BagPlayerNode
from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.live_diagnosis import LiveDiagnosisNode
from armid_ros.nodes.online_identifier import OnlineIdentifierNode
from armid_ros.nodes.recorder import RecorderNode
from armid_ros.nodes.simulated_arm import SimulatedArmNode
from armid_ros.papers.exo.nodes.interaction_identifier import InteractionIdentifierNode
from armid_ros.papers.exo.nodes.simulated_pair import SimulatedPairNode
from armid_ros.recording import Recording, write_recording
import numpy as np
import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState

NODES = (
    BagPlayerNode,
    InteractionIdentifierNode,
    LiveDiagnosisNode,
    OnlineIdentifierNode,
    RecorderNode,
    SimulatedArmNode,
    SimulatedPairNode,
)


def make(bench, kind: type[ArmidNode], tmp_path) -> ArmidNode:
    """Make a node with as few parameters as it needs."""
    if kind is BagPlayerNode:
        t = np.arange(20) * 0.01
        one = np.ones((20, 1)) * t[:, np.newaxis]
        write_recording(tmp_path / 'bag', Recording(joints=('a',), t=t, q=one, dq=one, tau=one))
        return bench.add(kind, bag=str(tmp_path / 'bag'))
    if kind is RecorderNode:
        return bench.add(kind, record=False)
    if kind in (OnlineIdentifierNode, LiveDiagnosisNode):
        return bench.add(kind, robot='humanoid_arm')
    return bench.add(kind)


def dumped(node: Node) -> list[Parameter]:
    """Return all parameters of a node, as `ros2 param dump` writes them."""
    names = sorted(node.list_parameters([], 0).names)
    return [node.get_parameter(name) for name in names]


@pytest.mark.parametrize('kind', NODES)
def test_a_dump_can_be_loaded_again_and_every_live_number_set_at_both_ends_of_its_range(
    bench, tmp_path, kind
):
    """The range is what a slider of rqt_reconfigure shows."""
    node = make(bench, kind, tmp_path)
    dump = dumped(node)
    assert all(result.successful for result in node.set_parameters(dump))
    assert [p.value for p in dumped(node)] == [p.value for p in dump]
    for entry in node.parameters():
        if isinstance(entry.default, bool) or not isinstance(entry.default, int | float):
            continue
        assert entry.limits is not None, entry.name
        if entry.read_only:
            continue
        before = node.value(entry.name)
        for value in (*entry.limits, before):
            wanted = Parameter(entry.name, value=type(entry.default)(value))
            (result,) = node.set_parameters([wanted])
            assert result.successful or result.reason, entry.name
        assert node.value(entry.name) == before, entry.name


def test_a_rate_is_followed_from_the_moment_it_is_set(bench):
    """A timer that is told another period waits for the end of the one it has."""
    node = bench.add(OnlineIdentifierNode, robot='humanoid_arm', estimate_rate=0.1)
    node._timer.callback = calls = Mock()
    bench.settle()
    assert node._timer.time_until_next_call() > 1e9
    node.set_parameters([Parameter('estimate_rate', value=1000.0)])
    assert node._timer.time_until_next_call() <= 1e6
    bench.spin_until(lambda: calls.call_count > 3, 'calls')


def test_the_identifier_goes_on_with_other_forgetting_and_thresholds(bench):
    arm = ArmModel.of('humanoid_arm', effects='viscous_friction')
    core = OnlineIdentifier(arm, OnlineSettings(max_gap=7), rng=np.random.default_rng(0))
    node = bench.add(OnlineIdentifierNode, core)
    node.set_parameters([Parameter('estimate_rate', value=5.0)])
    assert core.settings.max_gap == 7
    for name, value in (('forgetting', 0.999), ('max_gap', 20), ('false_alarm_time', 0.0)):
        (result,) = node.set_parameters([Parameter(name, value=value)])
        assert result.successful, result.reason
    assert (core.settings.forgetting, core.settings.max_gap) == (0.999, 20)
    assert core.settings.false_alarm_time is None
    for name, value in (('forgetting', 0.5), ('cutoff', 7.0)):  # the second is read-only
        (result,) = node.set_parameters([Parameter(name, value=value)])
        assert not result.successful and result.reason


def test_noise_and_rate_of_the_simulated_arm_change_while_it_runs(bench):
    node = bench.add(SimulatedArmNode, rate=100.0, real_time_factor=0.0, seed=1)
    states = bench.listen(JointState, 'joint_states')
    first = node.step()
    assert node.step() - first == 10_000_000
    bench.spin_until(lambda: len(states) >= 2, 'joint states')
    quiet = list(states[-1].effort)
    node.set_parameters([Parameter('rate', value=500), Parameter('torque_noise', value=[1])])
    second = node.stamp_ns
    assert node.step() - second == 2_000_000
    bench.spin_until(lambda: len(states) >= 3, 'joint states')
    assert np.max(np.abs(np.subtract(states[-1].effort, quiet))) > 0.1
    (result,) = node.set_parameters([Parameter('torque_noise', value=[1.0, 2.0])])
    assert not result.successful and '2 values' in result.reason
    (result,) = node.set_parameters([Parameter('rate', value=333.0)])
    assert not result.successful


def test_the_recorder_takes_up_and_lets_go_of_topics(bench, tmp_path):
    for topic in ('one', 'two'):
        bench.probe.create_publisher(JointState, topic, 10)
    node = bench.add(RecorderNode, bag=str(tmp_path / 'bag'), topics=['one'])
    bench.spin_until(lambda: not node.missing, 'topic one')
    node.set_parameters([Parameter('topics', value=['two', 'three'])])
    bench.spin_until(lambda: (node.poll(), node.missing == ('/three',))[1], 'topic two')
    _, values = node.condition()
    assert values['topics'] == 1
    node.close()
