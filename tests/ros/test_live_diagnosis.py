# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An effect that appears in a moving arm is named, and a twin of the arm takes it over."""

import re

from armid_msgs.msg import Diagnosis
from armid_ros.arm import ArmModel
from armid_ros.arm.model_file import model_text, read_model
from armid_ros.motion import Motion
from armid_ros.nodes.live import LiveDiagnosis, LiveSettings
from armid_ros.nodes.live_diagnosis import LiveDiagnosisNode
from armid_ros.nodes.qos import LATCHED
from armid_ros.nodes.trajectory_controller import write_trajectory
from armid_ros.robots import load_robot
import numpy as np
import pytest
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory

from tests.live.conftest import InProcess, KNOWN, MORE_FRICTION, moving
from tests.ros.controller import joint_state
from tests.ros.test_simulated_arm import still_arm

ROBOT = load_robot('humanoid_arm')
RATE = 100.0


class Silent:
    """Answers nothing; keeps what it is asked."""

    def __init__(self):
        self.jobs, self.busy = [], False

    def ask(self, task, argument):
        self.jobs.append(task)
        self.busy = True

    def poll(self):
        return None

    def close(self):
        pass


def set_effects(arm, *effects):
    return arm.set_parameters([Parameter('effects', value=list(effects) or [''])])[0]


def simulated(bench, *effects):
    return still_arm(bench, rate=RATE, torque_noise=[0.05], effects=list(effects) or [''])


def move(bench, arm, duration):
    motion = moving(ROBOT, duration, np.random.default_rng(3))
    message = write_trajectory(
        Motion(ROBOT.joints, motion.t + 0.05, motion.q, motion.dq, motion.ddq)
    )
    bench.matched_publisher(JointTrajectory, 'joint_trajectory', LATCHED).publish(message)
    bench.settle()


def run(bench, arm, node, seconds):
    """Let time go on in lock step, and let every question be answered when it is asked."""
    for _ in range(round(seconds * RATE)):
        stamp = arm.step()
        bench.spin_until(lambda stamp=stamp: node.last_stamp_ns == stamp, 'joint_states')
        node.take_answer()


@pytest.fixture
def idle(bench):
    helper = Silent()
    live = LiveDiagnosis(ArmModel.of(ROBOT, effects=KNOWN), LiveSettings(learning=0.0))
    return bench.add(LiveDiagnosisNode, live, helper), helper


def test_friction_that_rises_is_named_and_taken_over(bench):
    arm = simulated(bench, *KNOWN)
    live = LiveDiagnosis(ArmModel.of(ROBOT, effects=KNOWN), LiveSettings(learning=8.0))
    node = bench.add(LiveDiagnosisNode, live, InProcess())
    diagnoses = bench.listen(Diagnosis, 'live_diagnosis/diagnosis', LATCHED)
    models = bench.listen(String, 'live_diagnosis/model', LATCHED)
    bench.spin_until(lambda: models and arm.readers, 'discovery')
    move(bench, arm, 60.0)
    run(bench, arm, node, 14.0)
    assert node.live.latest.verdict == 'consistent'
    assert set_effects(arm, *KNOWN, MORE_FRICTION).successful
    run(bench, arm, node, 24.0)
    bench.spin_until(lambda: diagnoses and diagnoses[-1].confirmed, '~/diagnosis')
    last = diagnoses[-1]
    assert (last.effect[0], last.effect_joints[0]) == ('viscous_friction', 'elbow_pitch')
    elbow = last.gap_joint.index('elbow_pitch')
    assert last.gap_after[elbow] < 0.5 * last.gap_before[elbow]
    bench.settle()
    twin = read_model(models[-1].data, ROBOT, 'model')
    assert twin.theta.tolist() == node.live.proposed.theta.tolist()
    assert 'elbow_pitch' in bench.call('live_diagnosis/accept').message
    assert node.live.accepted.theta.tolist() == twin.theta.tolist()


def test_a_simulated_arm_becomes_what_a_model_describes_and_refuses_the_rest(bench):
    twin = simulated(bench)
    description = ArmModel.of(ROBOT, effects='torque_offset:torque_offset=0.7')
    publisher = bench.matched_publisher(String, 'model', LATCHED)
    states = bench.listen(JointState, 'joint_states')
    twin.step()
    publisher.publish(String(data=model_text(description, 'humanoid_arm')))
    bench.settle()
    twin.step()
    bench.settle()
    change = np.subtract(states[-1].effort, states[-2].effort)
    np.testing.assert_allclose(change, 0.7, atol=0.35)
    publisher.publish(String(data='schema: other'))
    bench.settle()
    assert twin.complaints.latest.startswith('model: ')
    for effect in ('glue', 'viscous_friction@knee:viscous_coefficient=1'):
        result = set_effects(twin, effect)
        assert not result.successful and re.search('glue|knee', result.reason)
    assert twin.value('effects') == ()


def test_questions_wait_until_the_one_before_is_answered(bench, idle):
    node, helper = idle
    for t in np.arange(0.0, 40.0, 0.01):
        take(node, 100.0 + t, np.sin(t), 0.0)
    assert len(helper.jobs) == 1
    assert node.received == 4000


def take(node, t, q, tau):
    message = joint_state(t, ROBOT.joints, [q] * 6, (), [tau] * 6)
    node.take_joint_states(serialize_message(message))


@pytest.mark.parametrize('seconds', [0.0, 0.004, 5.0])
def test_joint_states_that_jump_back_are_said(bench, idle, seconds):
    node, _ = idle
    node.stamps.take = lambda stamp: None
    diagnostics = bench.diagnostics()
    for k in range(100):
        take(node, 100.0 + 0.01 * k, np.sin(0.1 * k), np.cos(0.1 * k))
    if seconds:
        take(node, 100.99 - seconds, 0.0, 0.0)
    bench.diagnose(node, diagnostics)
    said = ' '.join(d.status[0].message for d in diagnostics)
    assert ('jump back' in said) is (seconds == 5.0)
    assert ('whose stamp' in said) is (seconds == 0.004)


def test_positions_that_are_frozen_while_efforts_swing_are_said(bench, idle):
    node, _ = idle
    node.stamps.take = lambda stamp: None
    diagnostics = bench.diagnostics()
    noise = np.random.default_rng(0).normal(scale=0.05, size=3000)
    for k in range(1000):
        take(node, 100.0 + 0.01 * k, np.sin(0.01 * k), np.cos(0.01 * k) + noise[k])
    for k in range(1000, 2000):  # at rest: the effort is that of gravity, and noise
        take(node, 100.0 + 0.01 * k, 0.5, 1.0 + noise[k])
    bench.diagnose(node, diagnostics)
    assert not any('positions stay' in d.status[0].message for d in diagnostics)
    for k in range(2000, 3000):
        take(node, 100.0 + 0.01 * k, 0.5, np.cos(0.01 * k) + noise[k])
    bench.diagnose(node, diagnostics)
    assert any('positions stay' in d.status[0].message for d in diagnostics)


def test_what_is_asked_is_refused_before_a_diagnosis_and_done_after_it(bench, idle, tmp_path):
    node, helper = idle
    for service in ('save', 'next_run', 'accept', 'reject'):  # there is no diagnosis so far
        assert not bench.call(f'live_diagnosis/{service}').success
    node.live.latest = 'a diagnosis'
    (tmp_path / 'file').write_text('')
    node.set_parameters([Parameter('save_to', value=str(tmp_path / 'file' / 'saved'))])
    answer = bench.call('live_diagnosis/save')
    assert not answer.success and f'{tmp_path}/file/saved' in answer.message
    assert not helper.jobs
    node.set_parameters([Parameter('save_to', value=str(tmp_path / 'deep' / 'saved'))])
    assert bench.call('live_diagnosis/save').success
    assert bench.call('live_diagnosis/next_run').success
    assert helper.jobs == ['save', 'plan']


def test_settings_can_be_changed_and_those_that_do_not_fit_are_refused(bench, idle):
    node, _ = idle
    assert node.set_parameters([Parameter('window', value=30.0)])[0].successful
    assert node.live.settings.window == 30.0
    result = node.set_parameters([Parameter('shortest', value=40.0)])[0]
    assert not result.successful
    assert result.reason
    assert node.live.settings.shortest == 8.0


def test_a_description_without_inertia_is_refused(bench):
    bare = re.sub(r'<inertial>.*?</inertial>', '', ROBOT.urdf, flags=re.DOTALL)
    node = bench.add(LiveDiagnosisNode, None, Silent())
    bench.matched_publisher(String, 'robot_description', LATCHED).publish(String(data=bare))
    bench.spin_until(lambda: node.complaints.latest, 'a complaint')
    assert '<inertial>' in node.complaints.latest
    assert node.live is None
