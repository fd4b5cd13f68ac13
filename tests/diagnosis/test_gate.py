# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a reader should know of the data is said before any physics."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import DiagnosisSettings
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.prepare import repaired
from armid_ros.errors import IdentificationError
from armid_ros.identification import identify
from armid_ros.identification.assess.data_faults import check_data
from armid_ros.identification.assess.sensor_faults import torque_faults
from armid_ros.identification.rows.regression import Stretch
from armid_ros.identification.rows.signals import conditioning, SignalSettings
import numpy as np
import pytest

from tests.diagnosis.conftest import Bench, diagnosed, URDF


def stretches(recordings, used):
    """Return recordings in rows."""
    return [
        Stretch(part.source, part.at_rows.with_torque(part.torque), part.informative)
        for part in trajectories(recordings, used)
    ]


@pytest.mark.parametrize('stated', ['damping="0.3"', 'friction="0.5"'])
def test_friction_that_a_description_states_and_a_model_lacks_is_said(stated):
    joint = '<joint name="elbow" type="revolute">'
    assert joint in URDF
    bench = Bench(urdf=URDF.replace(joint, f'{joint}<dynamics {stated}/>'))
    recordings = bench.recordings()
    used = conditioning(recordings, SignalSettings())

    def notes(arm):
        return check_data(arm, recordings, used, stretches(recordings, used))[1]

    (said,) = [note for note in notes(ArmModel(bench.robot)) if '<dynamics>' in note]
    assert 'elbow' in said
    assert 'shoulder' not in said
    assert not any('<dynamics>' in note for note in notes(bench.arm))


def faults(bench, recordings):
    used = conditioning(recordings, SignalSettings())
    return check_data(bench.arm, recordings, used, stretches(recordings, used))[0]


def scaled(recordings, factor):
    return [replace(one, tau=factor * one.tau) for one in recordings]


@pytest.mark.slow
@pytest.mark.parametrize(('factor', 'unit'), [(1e3, 'N mm'), (57.3, 'degrees')])
def test_a_factor_since_the_baseline_is_a_unit(bench, factor, unit):
    """Masses that the model has wrong are wrong on both days."""
    before, now = bench.recordings(), scaled(bench.recordings(seed=1), factor)
    for weight in (1.0, 1e-3, 3.0):
        arm = weighing(bench.arm, weight)
        (said,) = faults_since(arm, now, before)
        assert unit in said
        assert 'convert the torques' in said


@pytest.mark.parametrize('factor', [1.0, 1.1, 1.5])
def test_a_gain_of_all_joints_since_the_baseline_is_no_unit(bench, factor):
    before, now = bench.recordings(), scaled(bench.recordings(seed=1), factor)
    assert not faults_since(bench.arm, now, before)


@pytest.mark.parametrize(('quantity', 'first'), [('position and torque', 0), ('torque', 1)])
def test_exchanged_joints_are_no_unit_since_the_baseline(upright, quantity, first):
    """The factor that fits torques of exchanged joints best leaves most of them."""
    before, now = upright.recordings(), upright.recordings(seed=1)
    order = [0, 2, 1] if first else [1, 0, 2]
    for k, one in enumerate(now):
        moved = one.q[:, order] if 'position' in quantity else one.q
        now[k] = replace(one, q=moved, tau=one.tau[:, order])
    (said,) = faults_since(upright.arm, now, before)
    names = upright.robot.joints[first : first + 2]
    assert quantity in said and 'exchanged' in said
    assert {name in said for name in names} == {True}


@pytest.mark.parametrize('inverse', [False, True])
def test_currents_since_a_baseline_in_newton_metres_are_named_with_their_gains(upright, inverse):
    """Drivers change from one to the other with their version."""
    gains = np.array([13.3, 11.1, 10.6])
    days = scaled(upright.recordings(seed=1), 1.0 / gains), upright.recordings()
    now, before = days[::-1] if inverse else days
    arm = upright.arm
    if inverse:
        arm = ArmModel(arm.robot.with_inertias(arm.robot.rigid_parameters / 11.0), arm.effects)
    (said,) = faults_since(arm, now, before)
    stated = said.split('--current-gain ')[1].split(';')[0].split(',')
    known = [name in said.split('--current-gain')[0] for name in arm.robot.joints]
    expected = 1.0 / gains if inverse else gains
    assert 'currents?' in said and sum(known) >= 2
    np.testing.assert_allclose(np.array(stated)[known].astype(float), expected[known], rtol=0.1)


def test_masses_in_grams_are_no_unit_of_torques_that_are_as_before(bench):
    before, now = bench.recordings(), bench.recordings(seed=1)
    grams = weighing(bench.arm, 1e3)
    assert 'kN m' in faults_since(grams, now, [])[0]
    assert not any('kN m' in said for said in faults_since(grams, now, before))


def weighing(arm, factor):
    """Return a model whose links weigh so many times what they are."""
    robot = arm.robot.with_inertias(factor * arm.robot.rigid_parameters)
    return ArmModel(robot, arm.effects, arm.values)


def faults_since(arm, recordings, before):
    used = conditioning(recordings, SignalSettings())
    return check_data(arm, recordings, used, stretches(recordings, used), before)[0]


def test_of_a_recording_that_is_too_short_it_is_said_how_long_one_has_to_be(bench):
    recordings = bench.recordings()
    used = conditioning(recordings, SignalSettings())
    short = recordings[0].select(slice(0, 50))
    said = rf'{short.duration:.2f} s.*[0-9.]+ s'
    with pytest.raises(IdentificationError, match=said):
        stretches([short], used)


@pytest.mark.parametrize('joint', [0, 1])
def test_friction_that_drives_is_the_opposite_sign(joint):
    """Weights of the arm tell the sign of most joints; of a light wrist only friction does."""
    light = URDF.replace('<mass value="1.5"/>', '<mass value="0.001"/>').replace(
        '<mass value="3.0"/>', '<mass value="0.001"/>'
    )
    bench = Bench(urdf=light, viscous=(0.3, 0.2), coulomb=(1.5, 1.3))
    assert not faults(bench, bench.recordings())
    turned = np.where(np.arange(2) == joint, -1.0, 1.0)
    wrong = [replace(one, tau=one.tau * turned) for one in bench.recordings()]
    (said,) = faults(bench, wrong)
    assert bench.robot.joints[joint] in said and 'negate it' in said
    with pytest.raises(IdentificationError, match=f'{bench.robot.joints[joint]}.*[Nn]egate'):
        identify(bench.arm, wrong, rng=np.random.default_rng(0))


@pytest.mark.parametrize('part', [pytest.param('validate', marks=pytest.mark.long), 'baseline'])
def test_a_damaged_sample_is_mended_in_every_recording_and_said(bench, part):
    first, *others = bench.recordings(seed=5)
    tau = first.tau.copy()
    tau[300, 1] += 80.0
    report = replace(first.report, messages=len(first), samples=len(first), nan=4)
    more = {part: [replace(first, tau=tau, report=report), *others]}
    found = diagnosed(bench.arm, bench.recordings(), **more)
    assert found.verdict == 'consistent', found.summary
    assert any('elbow' in note for note in found.notes)
    assert any('4 dropped' in note for note in found.notes)


def test_a_model_of_another_arm_is_doubted(bench):
    """What such a model leaves of both days is alike, and so nothing has changed."""
    other = replace(bench.arm, robot=bench.robot.with_gravity([3.0, 0.0, -9.0]))
    found = diagnosed(other, bench.recordings(seed=3), baseline=bench.recordings(seed=4))
    assert 'this arm' in found.summary


def test_a_model_that_is_worse_than_none_is_refused(bench):
    heavy = bench.arm.with_theta(np.r_[3.0 * bench.robot.rigid_parameters, bench.arm.theta[20:]])
    days = [bench.recordings(seed=3), bench.recordings(seed=4)]
    found = diagnosed(heavy, days[1], baseline=days[0])
    assert found.verdict == 'bad_data'
    assert 'another arm' in found.summary


def test_torques_of_which_none_was_measured_are_one_fault(bench):
    one = bench.recordings()[0]
    silent = replace(one, tau=0.0 * one.tau)
    (fault,) = torque_faults(bench.arm, silent, [])
    assert 'every joint' in fault.what and 'constant' in fault.what


def test_a_joint_that_nobody_drives_is_not_dead(bench):
    """Weight and inertia of a free pendulum cancel; a drive at its limit may stay there."""
    recordings = bench.recordings()
    used = conditioning(recordings, SignalSettings())
    limited = [replace(one, tau=np.clip(one.tau, -0.4, 0.4)) for one in recordings]
    data = [part.at_rows for part in trajectories(limited, used)]
    assert not any(list(torque_faults(bench.arm, one, data)) for one in limited)
    free = [replace(one, tau=one.tau * [1.0, 0.0]) for one in recordings]
    light = bench.robot.rigid_parameters.copy()
    light[-10:] = 0.0
    passive = replace(bench.arm, robot=bench.robot.with_inertias(light))
    data = [part.at_rows for part in trajectories(free, used)]
    assert not any(list(torque_faults(passive, one, data)) for one in free)


def test_a_recording_in_two_roles_is_said(bench):
    recordings = bench.recordings()
    new, before = bench.recordings(seed=5)[:1], recordings[:1]
    *_, notes = repaired(recordings, new, before, DiagnosisSettings())
    (note,) = [note for note in notes if 'two roles' in note]
    assert recordings[0].source in note


def test_a_torque_beyond_the_limit_of_its_drive_is_said(bench):
    recordings = bench.recordings()
    used = conditioning(recordings, SignalSettings())
    strong = [replace(one, tau=5.0 * one.tau) for one in recordings]
    notes = check_data(bench.arm, strong, used, stretches(strong, used))[1]
    assert any('shoulder' in note and 'limit' in note and '50' in note for note in notes)
    notes = check_data(bench.arm, recordings, used, stretches(recordings, used))[1]
    assert not any('limit' in note for note in notes)
