# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is named on recordings of real machines, and what is not invented."""

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import diagnose, DiagnosisSettings
from armid_ros.diagnosis.data.baseline import excited, refitted
from armid_ros.diagnosis.data.evidence import Evidence, noise_floor
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.prepare import choose_filters
from armid_ros.diagnosis.search.cause import SelectedEffect
from armid_ros.diagnosis.search.posterior import JointFit
from armid_ros.effects import CATALOGUE, make_effect
from armid_ros.papers.elastic.identification.transmission import fit_transmission
from armid_ros.recording import read_recording
from armid_ros.robots import load_robot
import numpy as np
import pytest

from benchmarks.real_diagnosis import answered, known_arm, Machines, Question
from benchmarks.real_recordings import emps, tx40, ur10
from benchmarks.two_encoders import kr300, named

pytestmark = pytest.mark.real_data


def look(machine, effects=()):
    robot = load_robot(str(machine.robot))
    arm = ArmModel(robot)
    for name in effects:
        arm = arm.with_effect(make_effect(name, robot))
    recordings = [read_recording(bag, joints=robot.joints) for bag in machine.bags[:1]]
    return diagnose(arm, recordings, rng=np.random.default_rng(0))


def names(found):
    return [finding.name for finding in found.findings]


@pytest.mark.xfail(strict=True, reason='an inertia is named beside friction')
def test_friction_of_a_positioning_system(real_data, tmp_path):
    found = look(emps(real_data, tmp_path))
    assert set(names(found)[:2]) == {'viscous_friction', 'coulomb_friction'}
    assert 'asymmetric_friction' in names(found)
    assert set(names(found)) <= {
        'viscous_friction',
        'coulomb_friction',
        'torque_offset',
        'asymmetric_friction',
    }
    left = sum(
        float(np.sum(((o.measured - o.after) * o.trajectory.informative) ** 2))
        for o in found.gap.overlays
    )
    whole = sum(
        float(np.sum((o.measured * o.trajectory.informative) ** 2)) for o in found.gap.overlays
    )
    assert np.sqrt(left / whole) < 0.032


def test_the_coupled_wrist_of_a_tx40(real_data, tmp_path):
    known = ('viscous_friction', 'coulomb_friction', 'torque_offset', 'rotor_inertia')
    found = look(tx40(real_data, tmp_path), known)
    wrist = next(f for f in found.findings if f.name == 'coupled_joint_friction')
    assert {'joint_5', 'joint_6'} <= set(wrist.joints)


@pytest.mark.parametrize(
    'name',
    [
        'viscous_friction',
        'coulomb_friction',
        pytest.param(
            'asymmetric_friction',
            marks=pytest.mark.xfail(
                strict=True, reason='an unknown offset, which is always fitted, has its torque'
            ),
        ),
    ],
)
def test_a_term_taken_out_of_the_model_of_a_positioning_system_is_named(real_data, tmp_path, name):
    machines = Machines(real_data, tmp_path)
    question = Question('emps', 'without', name)
    assert answered(question, machines.ask(question)) in ('first', 'named')


def test_friction_of_a_tx40_goes_with_the_load_in_both_halves_of_its_recording(
    real_data, tmp_path
):
    """What is named beside the wrist is there: the second half agrees with the first."""
    bare, recording = Machines(real_data, tmp_path).bare('tx40')
    arm = known_arm(bare, 'tx40', None)
    settings = DiagnosisSettings()
    used = choose_filters(arm, [recording], (), settings, np.random.default_rng(0))
    friction = CATALOGUE['load_dependent_friction'].on(arm.robot, ('joint_3',))
    middle = len(recording.t) // 2
    values, std = [], []
    for half in (slice(0, middle), slice(middle, None)):
        data = trajectories([recording.select(half)], used)
        base, _ = excited(arm, arm.base_parameters(np.random.default_rng(0)), data)
        rough = [noise_floor(part, arm).sigma for part in data]
        nearer = refitted(arm, base, data, rough)
        evidence = Evidence.over_noise(data, [noise_floor(one, nearer).sigma for one in data])
        problem = JointFit.over_noise(arm, evidence, np.random.default_rng(0))
        fitted = problem.fit([SelectedEffect(friction, (0,))], [np.zeros(1)])
        values.append(fitted.estimate.values[0])
        std.append(fitted.estimate.std[0])
    assert np.all(np.array(values) > 4.0 * np.array(std))
    assert abs(values[0] - values[1]) < 3.0 * np.hypot(*std)


@pytest.mark.parametrize(
    ('axis', 'names'),
    [
        (0, ('joint_elasticity', 'backlash')),
        (1, ('joint_elasticity', 'backlash')),
        (2, ('joint_elasticity',)),  # its load never changes flanks
    ],
)
def test_the_twist_of_a_kr300_is_named(real_data, axis, names):
    assert named(fit_transmission(kr300(real_data, axis), np.random.default_rng(0))) == names


def test_friction_of_a_ur10(real_data):
    found = look(ur10(real_data))
    assert {'viscous_friction', 'coulomb_friction'} <= set(names(found))


@pytest.mark.long
@pytest.mark.parametrize(
    ('name', 'joint'), [('rotor_inertia', 'elbow_joint'), ('joint_spring', 'wrist_2_joint')]
)
def test_a_torque_added_to_that_of_a_ur10_is_named(real_data, tmp_path, name, joint):
    machines = Machines(real_data, tmp_path)
    question = Question('ur10', 'with', name, joint, 3.0)
    assert answered(question, machines.ask(question)) in ('first', 'named')


def test_friction_taken_out_of_the_model_of_a_ur10_is_named_in_all_joints(real_data, tmp_path):
    found = Machines(real_data, tmp_path).ask(Question('ur10', 'without', 'viscous_friction'))
    assert found.findings[0].name == 'viscous_friction'
    assert len(found.findings[0].joints) == 6


@pytest.mark.long
def test_a_ripple_of_a_ur10_is_named_and_no_link(real_data, tmp_path):
    """Nothing repeats in this recording: its noise is assumed, and excuses no wrong body."""
    machines = Machines(real_data, tmp_path)
    question = Question('ur10', 'with', 'torque_ripple', 'wrist_2_joint', 3.0)
    found = machines.ask(question)
    assert answered(question, found) in ('first', 'named')
    assert 'link_inertia' not in names(found)
