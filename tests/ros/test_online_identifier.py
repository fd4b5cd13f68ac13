# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The online identifier learns what its core learns, whatever else is on the topics."""

from armid_msgs.msg import ParameterEstimate
from armid_ros.arm import ArmModel
from armid_ros.arm.model_file import load_model, model_text
from armid_ros.effects import parse_effect
from armid_ros.errors import OutputError
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.motion import Motion
from armid_ros.nodes.online_identifier import OnlineIdentifierNode
from armid_ros.nodes.qos import LATCHED
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus
import numpy as np
import pytest
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import String
import yaml

from docsite.schemas import faults
from tests.ros.controller import joint_state

PENDULUM = """<robot name="pendulum">
<link name="base"/>
<link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
<inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><origin xyz="0.15 0 0"/><mass value="1"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="9" effort="50"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
<origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" velocity="9" effort="30"/></joint>
</robot>"""
EFFECT = 'viscous_friction:viscous_coefficient=0.3'
RATE = 200.0


@pytest.fixture(scope='module')
def arm():
    return ArmModel.of(PENDULUM, effects=EFFECT)


def two_sines(arm, t, factor):
    """Return a motion of two sines, the second one of a frequency so many times the first."""
    w, phase = np.array([3.1, 4.3]), np.array([0.0, 1.0])
    states = (
        sum(
            a * (f * w) ** order * np.sin(f * w * t[:, None] + phase + order * np.pi / 2.0)
            for a, f in ((1.0, 1.0), (0.4, factor))
        )
        for order in range(3)
    )
    motion = Motion(arm.robot.joints, t, *states)
    return motion.with_torque(arm.torque(motion))


@pytest.fixture(scope='module')
def samples(arm):
    """Return an exact motion of 4 s: t, q, dq, tau."""
    motion = two_sines(arm, np.arange(0.0, 4.0, 1.0 / RATE), 2.3)
    return motion.t, motion.q, motion.dq, motion.tau


def message(joints, t, *values):
    return joint_state(1000.0 + t, joints, *values)


def messages(arm, samples):
    return [message(arm.robot.joints, *sample) for sample in zip(*samples, strict=True)]


def identifying(bench, **parameters):
    watched = parameters.pop('compare_stamps', False)
    node = bench.add(OnlineIdentifierNode, effects=['viscous_friction'], **parameters)
    node.freshness.now = lambda: 0.0  # joint states never stop, however busy the machine is
    if not watched:
        node.stamps.take = lambda stamp: None  # they are of the year 1970
    description = bench.probe.create_publisher(String, 'robot_description', LATCHED)
    description.publish(String(data=PENDULUM))
    bench.spin_until(lambda: node.identifier is not None, 'the robot')
    return node


def publish(bench, node, publisher, batch):
    """Publish in pieces that no queue overflows of."""
    for first in range(0, len(batch), 500):
        piece = batch[first : first + 500]
        goal = node.received + len(piece)
        for one in piece:
            publisher.publish(one)
        bench.spin_until(lambda goal=goal: node.received >= goal, 'the joint states')


def taught(bench, batch):
    """Return a node that has taken joint states."""
    node = identifying(bench)
    publish(bench, node, bench.matched_publisher(JointState, 'joint_states'), batch)
    return node


def assert_learned(node, expected, rtol=1e-6, atol=1e-8):
    found = node.identifier.estimate().values
    np.testing.assert_allclose(found, expected.estimate().values, rtol=rtol, atol=atol)


@pytest.fixture(scope='module')
def expected(arm, samples):
    """Return what the core learns of the same samples."""
    structure = ArmModel(arm.robot).with_effect(arm.effects[0])
    core = OnlineIdentifier(structure, rng=np.random.default_rng(0))
    for t, q, dq, tau in zip(*samples, strict=True):
        seconds, nanoseconds = divmod(round(t * 1e9), 10**9)
        core.update(seconds + 1e-9 * nanoseconds, q, dq, tau)
    return core


def test_the_estimate_is_that_of_the_core_and_the_truth(bench, arm, samples, expected):
    estimates = bench.listen(ParameterEstimate, 'online_identifier/estimate', LATCHED)
    predictions = bench.listen(JointState, 'online_identifier/predicted_joint_states')
    residuals = bench.listen(JointState, 'online_identifier/residual')
    node = taught(bench, messages(arm, samples))
    node.publish_estimate()
    bench.spin_until(lambda: estimates and estimates[-1].samples == expected.samples)
    last = estimates[-1]
    np.testing.assert_allclose(last.value, expected.estimate().values, rtol=1e-6, atol=1e-8)
    names = expected.base.parameters
    assert last.name == [p.name for p in names] and last.unit == [p.unit for p in names]
    truth = node.identifier.base.values(arm.theta)
    np.testing.assert_allclose(last.value, truth, rtol=2e-2, atol=2e-3)
    assert last.condition_number == pytest.approx(expected.condition_number, rel=1e-3)
    assert all(s >= 0.0 for s in last.std_dev)
    bench.spin_until(lambda: len(predictions) == len(residuals) > 700)
    assert tuple(residuals[-1].name) == arm.robot.joints
    assert residuals[-1].header == predictions[-1].header
    late = np.array([r.effort for r in residuals[-500:]])
    assert np.sqrt(np.mean(late**2)) < 0.02 * np.sqrt(np.mean(samples[3] ** 2))


def in_another_order(t, q, dq, tau):
    """Return joint states of which another joint is the first, without numbers."""
    extra = np.full((len(t), 1), np.nan)
    reordered = (np.hstack([extra, x[:, ::-1]]) for x in (q, dq, tau))
    rows = zip(t, *reordered, strict=True)
    return [message(('gripper', 'elbow', 'shoulder'), *row) for row in rows]


def without_velocity(t, q, dq, tau, lacking=slice(None)):
    """Return joint states as of a broadcaster to which no state interface gives a velocity."""
    dq = dq.copy()
    dq[:, lacking] = np.nan
    return [message(('shoulder', 'elbow'), *row) for row in zip(t, q, dq, tau, strict=True)]


def without_one_velocity(*samples):
    return without_velocity(*samples, lacking=[1])


@pytest.mark.parametrize('made', [in_another_order, without_velocity, without_one_velocity])
def test_other_forms_of_the_same_joint_states_teach_the_same(bench, samples, expected, made):
    node = taught(bench, made(*samples))
    assert_learned(node, expected)
    assert not node.complaints.latest


@pytest.mark.parametrize(
    ('clock', 'said'), [(1004.0, ''), (4600.0, 'behind'), (400.0, 'ahead of')]
)
def test_stamps_of_another_clock_are_said(bench, arm, samples, clock, said):
    node = identifying(bench, compare_stamps=True, use_sim_time=True)
    bench.tick(round(clock * 1e9))
    publisher = bench.matched_publisher(JointState, 'joint_states')
    publish(bench, node, publisher, messages(arm, [x[:700] for x in samples]))
    state = statuses(bench, node)['state']
    assert (f's {said} /clock' in state.message) is bool(said)
    assert (state.level == DiagnosticStatus.WARN) is bool(said), state.message
    bad = messages(arm, [x[700:701] for x in samples])
    bad[0].effort = []
    publish(bench, node, publisher, bad)  # what is wrong with one message is said first
    assert 'torque' in statuses(bench, node)['state'].message


def spoil(good, what):
    bad = JointState(
        header=good.header,
        name=list(good.name),
        position=list(good.position),
        velocity=list(good.velocity),
        effort=list(good.effort),
    )
    if what == 'unknown joints':
        bad.name = ['left', 'right']
    elif what == 'wrong length':
        bad.position = [0.0]
    elif what == 'no effort':
        bad.effort = []
    elif what == 'nan':
        bad.effort[1] = float('nan')
    elif what == 'infinite':
        bad.position[0] = float('inf')
    elif what == 'twice':
        bad.name = ['shoulder', 'shoulder', 'elbow']
        bad.position = bad.velocity = bad.effort = [0.0, 0.0, 0.0]
    return bad


SPOILED = {
    'unknown joints': 'left, right',
    'wrong length': '1 values of position',
    'no effort': 'measured torque',
    'nan': "effort of 'elbow'",
    'infinite': "position of 'shoulder'",
    'twice': 'shoulder twice',
}


def test_rubbish_is_said_once_and_costs_nothing(bench, arm, samples, expected):
    rosout, diagnostics = bench.rosout(), bench.diagnostics()
    mixed, kinds = [], list(SPOILED)
    for k, good in enumerate(messages(arm, samples)):
        if k % 50 == 25:
            mixed.append(spoil(good, kinds[k // 50 % len(kinds)]))
        mixed.append(good)
    node = taught(bench, mixed)
    assert_learned(node, expected)
    bench.diagnose(node, diagnostics)
    for words in SPOILED.values():
        bench.spin_until(lambda words=words: any(words in m.msg for m in rosout), words)
        assert sum(words in m.msg for m in rosout) == 1
    assert any(words in d.status[0].message for d in diagnostics for words in SPOILED.values())
    values = {v.key: v.value for v in diagnostics[-1].status[0].values}
    rejected = [int(value) for key, value in values.items() if key.startswith('rejected ')]
    assert sum(rejected) == len(mixed) - len(samples[0])


def test_a_description_that_is_none_is_refused_and_a_good_one_still_taken(bench):
    rosout = bench.rosout()
    node = bench.add(OnlineIdentifierNode)
    for service in ('reset', 'save'):
        answer = bench.call(f'online_identifier/{service}')
        assert not answer.success and 'robot_description' in answer.message
    publisher = bench.matched_publisher(String, 'robot_description', LATCHED)
    wrong = ['hello', '<sdf/>', '<robot name="empty"/>', '<robot']
    wrong.append(PENDULUM.replace('mass value="2"', 'mass value="nan"'))
    for text in wrong:
        publisher.publish(String(data=text))
        bench.settle()
        assert node.identifier is None
    assert node.complaints.counts['robot_description'] == len(wrong)
    assert node.complaints.defects == 0
    publisher.publish(String(data=PENDULUM))
    bench.spin_until(lambda: node.identifier is not None)
    assert node.hardware == 'pendulum'
    bench.spin_until(lambda: sum('robot description' in m.msg for m in rosout) >= 4)


def test_it_changes_its_qos_when_a_publisher_offers_less_and_stamps_what_has_no_stamp(
    bench, arm, samples
):
    node = identifying(bench)
    bench.matched_publisher(JointState, 'joint_states')
    weak = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
    second = bench.matched_publisher(JointState, 'joint_states', weak)
    publish(bench, node, second, messages(arm, samples)[:100])
    unstamped = messages(arm, samples)[100]
    unstamped.header.stamp = Time()
    publish(bench, node, second, [unstamped])
    assert node.complaints.counts['stamp'] == 1


@pytest.mark.parametrize(
    ('effects', 'expected'),
    [
        ((), ['viscous_friction']),
        (('viscous_friction@elbow:viscous_coefficient=1',), ['viscous_friction']),
        (('viscous_friction:viscous_coefficient=1',), ['viscous_friction']),
        (('torque_offset',), ['viscous_friction', 'torque_offset']),
    ],
)
def test_a_model_leaves_the_effects_of_the_parameters(bench, arm, effects, expected):
    node = identifying(bench)
    before = node.identifier
    publisher = bench.matched_publisher(String, 'model', LATCHED)
    publisher.publish(
        String(data=model_text(ArmModel.of(arm.robot, effects=list(effects)), 'pendulum'))
    )
    bench.settle()
    found = node.identifier.arm.effects
    assert [effect.name for effect in found] == expected
    assert all(effect.joints == arm.robot.joints for effect in found)
    assert (node.identifier is before) is (expected == ['viscous_friction'])
    publisher.publish(String(data=model_text(ArmModel(arm.robot), 'pendulum')))
    bench.settle()
    assert node.identifier.arm.effects == before.arm.effects


@pytest.mark.parametrize('second', [True, False])
def test_who_contradict_each_other_are_named(bench, arm, samples, second):
    diagnostics = bench.diagnostics()
    node = identifying(bench)
    publisher = bench.matched_publisher(JointState, 'joint_states')
    if second:
        bench.add(Node, node_name='other').create_publisher(JointState, 'joint_states', 10)
        bench.spin_until(lambda: node.joint_states.publishers == 2, 'the second publisher')
    first = messages(arm, samples)[:200]
    mixed = [one for pair in zip(first, first, strict=True) for one in pair]
    publish(bench, node, publisher, mixed)
    bench.diagnose(node, diagnostics)
    said = [d.status[0].message for d in diagnostics if 'whose stamp' in d.status[0].message]
    assert said
    assert any('/other, /probe' in message for message in said) is second


@pytest.mark.parametrize('how', ['call', 'end', 'end, not asked for'])
def test_a_call_and_the_end_of_the_node_save_where_that_is_asked_for(
    bench, arm, samples, tmp_path, monkeypatch, how
):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / 'learned'
    node = identifying(bench, **({} if 'not' in how else {'save_to': str(folder)}))
    publisher = bench.matched_publisher(JointState, 'joint_states')
    publish(bench, node, publisher, messages(arm, samples))
    if how == 'call':
        saved = bench.call('online_identifier/save')
        assert saved.success, saved.message
    else:
        node.close()
    assert folder.exists() is ('not' not in how)
    if 'not' in how:
        return
    model = load_model(folder / 'model.yaml')
    base = node.identifier.base
    np.testing.assert_allclose(
        base.values(model.theta), node.identifier.estimate().values, rtol=1e-6, atol=1e-9
    )
    document = yaml.safe_load((folder / 'estimate.yaml').read_text())
    assert faults('estimate', document) == []
    assert document['samples'] == node.identifier.samples
    assert bench.call('online_identifier/reset').success
    assert node.identifier.samples == 0


@pytest.mark.parametrize('own', [True, False])
def test_what_is_in_the_folder_is_not_overwritten_with_nothing(bench, tmp_path, own):
    before = 'schema: armid/model/1\nof: yesterday\n' if own else 'mine: true'
    (tmp_path / 'model.yaml').write_text(before)
    if own:
        node = identifying(bench, save_to=str(tmp_path))
        assert not bench.call('online_identifier/save').success
        node.close()
    else:  # refused at once
        with pytest.raises(OutputError, match=r'model\.yaml'):
            identifying(bench, save_to=str(tmp_path))
    assert [p.name for p in tmp_path.iterdir()] == ['model.yaml']
    assert (tmp_path / 'model.yaml').read_text() == before


def test_joint_states_that_stop_are_stale_within_a_second(bench, arm, samples):
    now = [0.0]
    diagnostics = bench.diagnostics()
    node = identifying(bench)
    node.freshness.now = lambda: now[0]
    publisher = bench.matched_publisher(JointState, 'joint_states')
    publish(bench, node, publisher, messages(arm, samples)[:400])

    def levels_after(seconds):
        now[0] += seconds
        node.poll()
        bench.settle()
        levels = [d.status[0].level for d in diagnostics]
        diagnostics.clear()
        return levels

    assert DiagnosticStatus.STALE not in levels_after(0.4)
    now[0] += 0.2
    node.poll()
    bench.settle()
    assert any('0.6 s' in d.status[0].message for d in diagnostics)
    assert DiagnosticStatus.STALE in levels_after(0.0)  # at once, not at the next second
    publish(bench, node, publisher, messages(arm, samples)[400:420])
    assert DiagnosticStatus.OK in levels_after(0.0)  # the node may have looked by itself


def test_degrees_are_noticed(bench, arm, samples):
    t, q, dq, tau = samples
    node = taught(bench, messages(arm, (t, np.degrees(q), np.degrees(dq), tau)))
    state = statuses(bench, node)['state']
    assert state.level == DiagnosticStatus.ERROR
    assert 'degrees' in state.message and ' rad' in state.message
    assert bench.call('online_identifier/reset').success
    assert statuses(bench, node)['state'].level == DiagnosticStatus.OK


def test_a_spike_is_said_with_the_joint_and_costs_nothing(bench, arm, samples, expected):
    t, q, dq, tau = samples
    spoiled = tau.copy()
    spoiled[600, 1] += 1000.0
    node = taught(bench, messages(arm, (t, q, dq, spoiled)))
    state = statuses(bench, node)['state']
    assert node.complaints.counts['spike'] == 1
    assert 'effort' in node.complaints.latest and 'elbow' in node.complaints.latest
    assert [v.value for v in state.values if v.key.startswith('left')] == ['1']
    assert_learned(node, expected, rtol=1e-3, atol=1e-4)


def moving(arm, seconds, change=None, at=0.0):
    """Return joint states of a motion with a little noise, and friction that rises."""
    rng = np.random.default_rng(0)
    motion = two_sines(arm, np.arange(0.0, seconds, 1.0 / RATE), 0.37)
    t, tau = motion.t[:, np.newaxis], motion.tau
    if change is not None:
        other = arm.with_effect(*parse_effect(change, arm.robot))
        tau = np.where(t >= at, other.torque(motion), tau)
    tau = tau + 0.05 * rng.normal(size=tau.shape)
    return messages(arm, (motion.t, motion.q, motion.dq, tau))


def statuses(bench, node):
    diagnostics = bench.diagnostics()
    bench.diagnose(node, diagnostics)
    return {s.name.partition(': ')[2]: s for s in diagnostics[-1].status}


def test_a_change_is_published_and_said(bench, arm):
    sizes = bench.listen(ParameterEstimate, 'online_identifier/change', LATCHED)
    node = identifying(bench)
    assert statuses(bench, node)['changes'].level == DiagnosticStatus.OK
    change = 'viscous_friction@elbow:viscous_coefficient=0.2'
    batch = moving(arm, 34.0, change=change, at=30.0)
    publish(bench, node, bench.matched_publisher(JointState, 'joint_states'), batch)
    bench.spin_until(lambda: sizes, 'the change')
    (found,) = sizes
    assert (found.name, found.joint) == (['viscous_coefficient'], ['elbow'])
    assert abs(found.value[0] - 0.2) < 4.0 * found.std_dev[0] < 0.2
    assert abs(found.header.stamp.sec - 1030) <= 1
    found = statuses(bench, node)
    status = found['changes']
    assert status.level == status.WARN
    assert 'viscous' in status.message and 'elbow' in status.message
    values = {v.key: float(v.value) for v in found['parameters'].values}
    name = 'shoulder viscous_coefficient [N m s/rad]'
    assert 0.28 < values[f'{name} lower'] < values[name] < values[f'{name} upper'] < 0.32
    assert found['parameters'].hardware_id == 'pendulum'
