# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The online identifier learns what its core learns, whatever else is on the topics."""

from __future__ import annotations

from armid_msgs.msg import ParameterEstimate
from armid_ros.arm import ArmModel
from armid_ros.arm.model_file import load_model, model_text
from armid_ros.effects import parse_effect
from armid_ros.errors import OutputError
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.motion import Motion
from armid_ros.nodes.online_identifier import OnlineIdentifierNode
from armid_ros.nodes.qos import LATCHED
from armid_ros.robots import load_robot
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
    arm = ArmModel(load_robot(PENDULUM))
    return arm.with_effect(*parse_effect(EFFECT, arm.robot))


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


def test_joints_are_matched_by_name_and_others_left_out(bench, arm, samples, expected):
    t, q, dq, tau = samples
    extra = np.full((len(t), 1), np.nan)
    shuffled = [
        message(('gripper', 'elbow', 'shoulder'), *sample)
        for sample in zip(t, *(np.hstack([extra, x[:, ::-1]]) for x in (q, dq, tau)), strict=True)
    ]
    node = taught(bench, shuffled)
    assert_learned(node, expected)


@pytest.mark.parametrize('columns', [slice(None), [1]], ids=['all', 'one'])
def test_velocities_that_are_not_numbers_are_absent(bench, arm, samples, expected, columns):
    """The joint state broadcaster fills what has no state interface with NaN."""
    t, q, dq, tau = samples
    dq = dq.copy()
    dq[:, columns] = np.nan
    node = taught(bench, messages(arm, (t, q, dq, tau)))
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
    'wrong length': '1 of position',
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


SPOILED_ELEMENTS = (
    ('axis xyz="0 1 0"', 'axis xyz="nan 0 1"'),
    ('axis xyz="0 1 0"', 'axis xyz="inf 0 1"'),
    ('axis xyz="0 1 0"', 'axis xyz="0 0 0"'),
    ('origin xyz="0.2 0 0"', 'origin xyz="inf 0 0"'),
    ('origin xyz="0.2 0 0"', 'origin xyz="0 0"'),
    ('mass value="2"', 'mass value="nan"'),
)


def test_a_description_that_is_none_is_refused_and_a_good_one_still_taken(bench):
    rosout = bench.rosout()
    node = bench.add(OnlineIdentifierNode)
    publisher = bench.matched_publisher(String, 'robot_description', LATCHED)
    spoiled = [PENDULUM.replace(*change, 1) for change in SPOILED_ELEMENTS]
    wrong = ['hello', '<sdf/>', '<robot name="empty"/>', '<robot', *spoiled]
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


@pytest.mark.parametrize('reliability', list(ReliabilityPolicy)[1:3])
def test_it_takes_the_qos_of_the_publisher(bench, arm, samples, reliability):
    node = identifying(bench)
    qos = QoSProfile(depth=1000, reliability=reliability)
    publisher = bench.matched_publisher(JointState, 'joint_states', qos)
    publish(bench, node, publisher, messages(arm, samples)[:100])
    assert node.joint_states.subscription.qos_profile.reliability == reliability


def test_it_changes_its_qos_when_a_publisher_offers_less(bench, arm, samples):
    node = identifying(bench)
    bench.matched_publisher(JointState, 'joint_states')
    weak = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
    second = bench.matched_publisher(JointState, 'joint_states', weak)
    publish(bench, node, second, messages(arm, samples)[:100])


def test_predictions_and_residuals_add_up_to_the_torque(bench, arm, samples):
    predictions = bench.listen(JointState, 'online_identifier/predicted_joint_states')
    residuals = bench.listen(JointState, 'online_identifier/residual')
    taught(bench, messages(arm, samples))
    bench.spin_until(lambda: len(predictions) == len(residuals) > 700)
    assert tuple(residuals[-1].name) == arm.robot.joints
    assert residuals[-1].header == predictions[-1].header
    late = np.array([r.effort for r in residuals[-500:]])
    assert np.sqrt(np.mean(late**2)) < 0.02 * np.sqrt(np.mean(samples[3] ** 2))


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


@pytest.mark.long
def test_a_jump_back_in_time_is_said_and_survived(bench, arm, samples, expected):
    diagnostics = bench.diagnostics()
    batch = messages(arm, samples)
    node = taught(bench, batch + batch)
    bench.diagnose(node, diagnostics)
    assert any('jump' in d.status[0].message for d in diagnostics)
    assert_learned(node, expected, rtol=5e-2, atol=5e-3)


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
    said = {d.status[0].message for d in diagnostics}
    late = 'joint states whose stamp is not after that of the one before are left out'
    named = '; 2 nodes publish /joint_states: /other, /probe; stop one'
    assert late + (named if second else '') in said


def test_messages_out_of_order_are_said_and_left_out(bench, arm, samples):
    diagnostics = bench.diagnostics()
    batch = messages(arm, samples)[:200]
    batch[100], batch[101] = batch[101], batch[100]
    batch[150], batch[151] = batch[151], batch[150]
    node = taught(bench, batch)
    bench.diagnose(node, diagnostics)
    assert any('stamp' in d.status[0].message for d in diagnostics)
    assert node.identifier.rejected['out_of_order'] == 2


def test_messages_without_a_stamp_are_taken_at_the_clock(bench, arm, samples):
    unstamped = messages(arm, samples)[0]
    unstamped.header.stamp = Time()
    node = taught(bench, [unstamped])
    assert node.complaints.counts['stamp'] == 1


def test_reset_and_save(bench, arm, samples, tmp_path):
    folder = tmp_path / 'learned'
    node = identifying(bench, save_to=str(folder))
    publisher = bench.matched_publisher(JointState, 'joint_states')
    publish(bench, node, publisher, messages(arm, samples))
    saved = bench.call('online_identifier/save')
    assert saved.success, saved.message
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


def test_saving_nothing_is_refused_and_overwrites_nothing(bench, tmp_path):
    yesterday = 'schema: armid/model/1\nof: yesterday\n'
    (tmp_path / 'model.yaml').write_text(yesterday)
    node = identifying(bench, save_to=str(tmp_path))
    answer = bench.call('online_identifier/save')
    assert not answer.success
    node.close()
    assert [p.name for p in tmp_path.iterdir()] == ['model.yaml']
    assert (tmp_path / 'model.yaml').read_text() == yesterday


def test_a_model_of_somebody_else_is_not_replaced_and_that_is_said_at_once(bench, tmp_path):
    (tmp_path / 'model.yaml').write_text('mine: true')
    with pytest.raises(OutputError, match=r'model\.yaml'):
        identifying(bench, save_to=str(tmp_path))
    assert (tmp_path / 'model.yaml').read_text() == 'mine: true'


@pytest.mark.parametrize('asked', [True, False])
def test_the_end_of_the_node_saves_where_that_is_asked_for(
    bench, arm, samples, tmp_path, monkeypatch, asked
):
    monkeypatch.chdir(tmp_path)
    node = identifying(bench, **({'save_to': 'learned'} if asked else {}))
    publisher = bench.matched_publisher(JointState, 'joint_states')
    publish(bench, node, publisher, messages(arm, samples)[:600])
    node.close()
    assert [p.name for p in tmp_path.iterdir()] == (['learned'] if asked else [])
    if asked:
        load_model(tmp_path / 'learned' / 'model.yaml')


def test_joint_states_that_stop_are_stale_within_a_second(bench, arm, samples):
    now = [0.0]
    diagnostics = bench.diagnostics()
    node = identifying(bench)
    node.freshness.now = lambda: now[0]
    publisher = bench.matched_publisher(JointState, 'joint_states')
    publish(bench, node, publisher, messages(arm, samples)[:400])

    def levels_after(seconds):
        now[0] += seconds
        node.look()
        bench.settle()
        levels = [d.status[0].level for d in diagnostics]
        diagnostics.clear()
        return levels

    assert DiagnosticStatus.STALE not in levels_after(0.4)
    now[0] += 0.2
    node.look()
    bench.settle()
    assert any('stopped 0.6 s ago' in d.status[0].message for d in diagnostics)
    assert DiagnosticStatus.STALE in levels_after(0.0)  # at once, not at the next second
    publish(bench, node, publisher, messages(arm, samples)[400:420])
    assert DiagnosticStatus.OK in levels_after(0.0)  # the node may have looked by itself


def test_effort_that_is_not_filled_in_is_an_error_and_teaches_nothing(bench, arm, samples):
    t, q, dq, tau = samples
    batch = messages(arm, (t, q, dq, 0.0 * tau))
    node = taught(bench, batch)
    state = statuses(bench, node)['state']
    assert state.level == DiagnosticStatus.ERROR
    assert 'effort' in state.message
    assert node.identifier.estimate().std.min() > 1e3


def test_degrees_are_noticed(bench, arm, samples):
    t, q, dq, tau = samples
    node = taught(bench, messages(arm, (t, np.degrees(q), np.degrees(dq), tau)))
    state = statuses(bench, node)['state']
    assert state.level == DiagnosticStatus.ERROR
    assert 'degrees' in state.message and ' rad' in state.message
    assert bench.call('online_identifier/reset').success
    assert statuses(bench, node)['state'].level == DiagnosticStatus.OK


@pytest.mark.parametrize('late', [0.0, 0.002])
def test_two_senders_with_half_of_the_joints_each_are_one_arm(bench, arm, samples, late):
    """The second one has stamps of its own, between those of the first."""
    t, q, dq, tau = samples
    shifted = [[np.interp(t + late, t, x[:, 1])] for x in (q, dq, tau)]
    batch = []
    for k, stamp in enumerate(t):
        one = (x[k, :1] for x in (q, dq, tau))
        other = (np.array([x[0][k]]) for x in shifted)
        batch += [message(['shoulder'], stamp, *one), message(['elbow'], stamp + late, *other)]
    node = taught(bench, batch)
    truth = node.identifier.base.values(arm.theta)
    np.testing.assert_allclose(node.identifier.estimate().values, truth, rtol=3e-2, atol=5e-3)
    assert not node.complaints.counts


def test_a_spike_is_said_with_the_joint_and_costs_nothing(bench, arm, samples, expected):
    t, q, dq, tau = samples
    spoiled = tau.copy()
    spoiled[600, 1] += 1000.0
    node = taught(bench, messages(arm, (t, q, dq, spoiled)))
    state = statuses(bench, node)['state']
    assert node.complaints.counts['spike'] == 1
    assert "effort of 'elbow'" in node.complaints.latest
    assert [v.value for v in state.values if v.key.startswith('left')] == ['1']
    assert_learned(node, expected, rtol=1e-3, atol=1e-4)


def test_joint_states_that_never_came_are_counted_and_said(bench, arm, samples):
    batch = messages(arm, samples)
    node = taught(bench, batch[:300] + batch[301:500] + batch[503:])
    state = statuses(bench, node)['state']
    assert {v.key: v.value for v in state.values}['missing'] == '4'
    assert 'missing' in node.complaints.latest


def test_without_a_robot_the_services_say_so(bench):
    bench.add(OnlineIdentifierNode)
    for service in ('reset', 'save'):
        answer = bench.call(f'online_identifier/{service}')
        assert not answer.success and 'robot_description' in answer.message


def moving(arm, seconds, still=None, change=None, at=0.0):
    """Return joint states of a motion with a little noise: a joint still, friction rising."""
    rng = np.random.default_rng(0)
    motion = two_sines(arm, np.arange(0.0, seconds, 1.0 / RATE), 0.37)
    if still is not None:
        states = [x.copy() for x in (motion.q, motion.dq, motion.ddq)]
        for x, value in zip(states, (0.3, 0.0, 0.0), strict=True):
            x[:, still] = value
        motion = Motion(arm.robot.joints, motion.t, *states)
        motion = motion.with_torque(arm.torque(motion))
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


@pytest.mark.long
def test_parameters_come_with_their_intervals(bench, arm):
    node = taught(bench, moving(arm, 20.0))
    found = statuses(bench, node)['parameters']
    values = {v.key: float(v.value) for v in found.values}
    for joint in ('shoulder', 'elbow'):
        name = f'{joint} viscous_coefficient [N m s/rad]'
        assert values[f'{name} lower'] < values[name] < values[f'{name} upper']
        assert values[f'{name} lower'] - 0.02 < 0.3 < values[f'{name} upper'] + 0.02
    assert found.hardware_id == 'pendulum'


@pytest.mark.long
def test_too_little_motion_is_said_with_the_joint(bench, arm):
    node = identifying(bench)
    publisher = bench.matched_publisher(JointState, 'joint_states')
    batch = moving(arm, 14.0, still=1)
    for first in range(0, len(batch), round(RATE)):  # diagnostics once a second of the arm's time
        publish(bench, node, publisher, batch[first : first + round(RATE)])
        node.condition()
    state = statuses(bench, node)['state']
    assert state.level == state.WARN
    assert 'motion' in state.message and ': elbow' in state.message


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
    status = statuses(bench, node)['changes']
    assert status.level == status.WARN
    assert status.message.startswith('viscous friction at elbow ')
    assert 's ago' in status.message
