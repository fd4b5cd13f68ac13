# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The grade of an identification: what a person would stop at, and nothing else."""

from dataclasses import replace
import re

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification import grade, identify, Score
from armid_ros.identification.assess.grade import torque_noise
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.recording import read_recording, ReadReport
from armid_ros.robots import load_robot
import numpy as np
import pytest

from benchmarks import real_recordings

from ..conftest import FRICTION, multisine, recorded

RATE = 100.0


def record(arm, seed, duration=20.0, source='run'):
    motion = multisine(arm.robot.joints, duration, RATE, seed=seed, base_hz=0.12)
    return recorded(arm, motion, seed, torque_noise=0.02, source=source)


def graded(structure, recordings, held_out=()):
    result = identify(structure, recordings, rng=np.random.default_rng(0))
    validation = {recording.source: result.predict([recording]) for recording in held_out}
    return grade(result, structure, recordings, validation, held_out), result


def held_out_error(reason):
    """Return the torque error that a reason states [%]."""
    return float(re.search(r'([0-9.]+) %', reason).group(1))


@pytest.fixture(scope='module')
def run(arm):
    return record(arm, 1)


@pytest.fixture(scope='module')
def other(arm):
    return record(arm, 2, source='other')


@pytest.fixture(scope='module')
def sound(structure, run, other):
    return graded(structure, [run], [other])


def test_a_sound_recording_is_good_with_its_held_out_error(sound):
    found, _ = sound
    assert found.word == 'good'
    (reason,) = found.reasons
    assert 'on other' in reason and held_out_error(reason) < LIMITS.poor


@pytest.mark.parametrize(
    ('share', 'word'), [(0.0, 'good'), (0.3, 'poor'), (0.8, 'unusable'), (1.59, 'unusable')]
)
def test_the_word_follows_the_held_out_error(structure, run, other, sound, share, word):
    """Torques that no motion explains; noise alone is a tenth of the smallest torque."""
    _, result = sound
    fits = result.predict([other])
    rng = np.random.default_rng(0)
    off = [
        replace(fit, predicted=fit.predicted + share * rng.permutation(fit.motion.tau))
        for fit in fits
    ]
    found = grade(result, structure, [run], {'other': off}, [other])
    assert found.word == word
    assert held_out_error(found.reasons[0]) == pytest.approx(100.0 * share, abs=10.0)


def test_one_bad_recording_among_good_ones_is_not_averaged_away(structure, run, other, sound):
    _, result = sound
    good = result.predict([other])
    bad = [replace(fit, predicted=-fit.predicted) for fit in good]
    found = grade(result, structure, [run], {'a': good, 'b': good, 'c': bad}, [])
    assert found.word == 'unusable'
    assert 'on c,' in found.reasons[0]


def with_torque_of(recording, joint, change):
    """Return a recording with the torque of one joint changed."""
    tau = recording.tau.copy()
    tau[:, joint] = change(tau[:, joint])
    return replace(recording, tau=tau)


def test_the_grade_is_that_of_the_joint_that_is_predicted_worst(structure, run, other, sound):
    """Of all joints together hardly anything is off: the others take ten times the torque."""
    _, result = sound
    fits = result.predict([other])
    blind = [replace(fit, predicted=fit.predicted * [1, 1, 1, 1, 1, 0]) for fit in fits]
    assert Score.of(blind).relative_error_percent < LIMITS.poor
    found = grade(result, structure, [run], {'other': blind}, [other])
    assert found.word == 'unusable'
    assert held_out_error(found.reasons[0]) == 100.0
    assert structure.robot.joints[5] in found.reasons[0]


@pytest.mark.slow
def test_noise_as_large_as_the_torque_of_a_joint_condemns_no_model(structure, run, other):
    """No model predicts noise."""
    rng = np.random.default_rng(0)

    def noisy(tau):
        return tau + np.std(tau) * rng.normal(size=tau.shape)

    loud = [with_torque_of(part, 5, noisy) for part in (run, other)]
    found, result = graded(structure, loud[:1], loud[1:])
    error = Score.of(result.predict(loud[1:])).joint_relative_error_percent[5]
    assert error > LIMITS.poor
    assert found.word == 'good'


@pytest.mark.slow
def test_a_joint_at_rest_with_any_torque_within_its_friction_condemns_no_model(structure, arm):
    """Friction holds it with whatever torque it was left with."""
    motion = multisine(arm.robot.joints, 20.0, RATE, seed=1, base_hz=0.12)
    moves = np.array([1, 1, 1, 1, 1, 0])
    held = replace(motion, q=motion.q * moves, dq=motion.dq * moves, ddq=motion.ddq * moves)
    left = 0.04 * np.sign(np.sin(0.5 * motion.t))
    record = with_torque_of(
        recorded(arm, held, torque_noise=0.005, position_noise=1e-5), 5, lambda tau: tau + left
    )
    found, _ = graded(structure, [record])
    assert not [reason for reason in found.reasons if f'% in {arm.robot.joints[5]}' in reason]
    assert found.word == 'poor'


def resting(recording, joints):
    """Return a recording of the same motion in which some joints stand still."""
    q = recording.q.copy()
    q[:, joints] = 0.1
    return replace(recording, q=q)


def test_joints_that_never_move_are_named_and_no_good_model(arm, structure):
    motion = multisine(arm.robot.joints, 20.0, RATE, seed=1, base_hz=0.12)
    moves = np.array([1, 1, 1, 0, 0, 1])
    held = replace(motion, q=motion.q * moves, dq=motion.dq * moves, ddq=motion.ddq * moves)
    still, moving = (
        [j for j, m in zip(motion.joints, moves, strict=True) if m == k] for k in (0, 1)
    )
    found, _ = graded(structure, [recorded(arm, held, torque_noise=0.02)])
    assert found.word == 'poor'
    assert ', '.join(still) in found.reasons[0]
    assert f'--joints {",".join(moving)}.' in found.reasons[0]


def test_a_joint_that_rests_in_what_is_held_out_is_named(structure, run, sound):
    _, result = sound
    fits = result.predict([resting(run, [5])])
    exact = [replace(fit, predicted=fit.motion.tau) for fit in fits]
    found = grade(result, structure, [run], {'other': exact})
    assert any(structure.robot.joints[5] in reason for reason in found.reasons[1:])
    assert found.word == 'good'


def test_noise_is_told_from_torque_that_no_model_describes(run, sound):
    """What a joint is off by slowly is no noise, however large it is."""
    _, result = sound
    white = 0.2 * np.random.default_rng(0).normal(size=run.tau.shape)
    slow = np.sin(3.0 * run.t)[:, np.newaxis] * np.ones(6)
    expected = 0.2 * np.linalg.norm(result.used.taps())
    for tau in (run.tau + white, run.tau + white + slow):
        noise = torque_noise(result.predict([replace(run, tau=tau)]), result.used)
        np.testing.assert_allclose(noise, expected, rtol=0.15)


def test_without_held_out_data_halves_of_the_recording_judge_each_other(structure, run):
    found, result = graded(structure, [run])
    assert found.word == 'good'
    assert 'halves' in found.reasons[0]
    assert result.halves.whole < 5.0


def test_two_seconds_of_data_are_too_little(arm, structure):
    """The fit is as close as any; what it is fitted to does not repeat."""
    found, result = graded(structure, [record(arm, 1, duration=2.0)])
    assert found.word != 'good'
    assert 'record longer' in found.reasons[0]
    assert result.halves.joints.max() > LIMITS.poor


@pytest.mark.slow
@pytest.mark.parametrize('seed', range(2))
def test_recordings_drawn_at_random_are_good(arm, structure, seed):
    found, _ = graded(structure, [record(arm, 10 + seed, duration=15.0 + 20.0 * seed)])
    assert found.word == 'good'


@pytest.mark.parametrize('held_out', [False, True])
def test_a_mistake_is_said_once_with_its_joint_and_recording(structure, run, other, held_out):
    turned = [replace(part, q=part.q * [1, -1, 1, 1, 1, 1]) for part in (run, other)]
    found, _ = graded(structure, [run] if held_out else turned[:1], turned[1:])
    assert found.word == 'unusable'
    (said,) = (reason for reason in found.reasons if 'opposite sign' in reason)
    assert 'shoulder_roll' in said
    assert ('In other' in said) == held_out


def test_a_velocity_of_the_opposite_sign_is_said_and_condemns_nothing(structure, run, other):
    """Positions alone are fitted, so that a velocity that is wrong harms no model."""
    turned = np.gradient(other.q, other.t, axis=0)
    turned[:, 1] *= -1.0
    found, _ = graded(structure, [run], [replace(other, dq=turned)])
    joint = run.joints[1]
    assert found.word == 'good'
    (said,) = (reason for reason in found.reasons if 'opposite sign' in reason)
    assert said.startswith('In other') and joint in said


def test_torques_that_come_late_are_not_good(structure, run):
    """A free fit takes them for friction and inertia, and is not far off."""
    late = replace(run, t=run.t[:-10], q=run.q[10:], tau=run.tau[:-10])
    found, _ = graded(structure, [late])
    assert found.word == 'poor'
    said = re.search(r'(\d+) ms later', found.reasons[0]).group(1)
    assert int(said) == pytest.approx(100, abs=3)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('since', [0, 1000])
def test_a_dead_channel_of_torque_is_unusable(structure, run, other, since):
    """The fit explains a torque that is not there by links that weigh nothing."""
    tau = run.tau.copy()
    tau[since:, 3] = 0.0
    dead = replace(run, tau=tau)
    found, _ = graded(structure, [dead])
    assert found.word == 'unusable'
    joint = structure.robot.joints[3]
    assert joint in found.reasons[0]
    assert ('10.000 s' if since else 'throughout') in found.reasons[0]
    found, _ = graded(structure, [other], [dead])
    assert found.word == 'unusable'


@pytest.mark.parametrize(
    ('factor', 'word', 'said'),
    [
        (0.05, 'poor', '0.05 times'),  # it may be wrong masses
        (1.0 / 9.80665, 'unusable', 'kgf m'),
    ],
)
def test_currents_for_torques_are_asked_about_and_a_unit_is_unusable(
    structure, run, factor, word, said
):
    """A free fit is as good in any unit."""
    found, _ = graded(structure, [replace(run, tau=factor * run.tau)])
    assert found.word == word
    assert said in found.reasons[0]


def test_gravity_of_the_earth_on_a_recording_from_the_moon_is_unusable(arm, structure):
    moon = replace(arm, robot=arm.robot.with_gravity((0.0, 0.0, -1.62)))
    found, _ = graded(structure, [record(moon, 1)])
    assert found.word == 'unusable'
    assert '--gravity moon' in found.reasons[0]


def test_a_clock_that_was_set_back_is_said(structure, run):
    report = ReadReport(messages=3000, samples=2000, restarted=1000)
    found, _ = graded(structure, [replace(run, report=report)])
    assert found.word == 'good'
    assert any('clock' in line and '1000' in line for line in found.reasons)


def test_what_goes_down_gives_out_energy_and_is_no_wrong_sign(arm, structure):
    """Three seconds in which the arm sinks were refused as torques of the opposite sign."""
    motion = multisine(arm.robot.joints, 3.0, 200.0, seed=1)
    found, _ = graded(structure, [recorded(arm, motion, torque_noise=0.02)])
    assert not any('sign' in reason for reason in found.reasons)


def of_machine(machine, real_data, folder, effects=FRICTION):
    maker = getattr(real_recordings, machine)
    data = maker(real_data) if machine == 'ur10' else maker(real_data, folder)
    robot = load_robot(str(data.robot))
    structure = ArmModel(robot)
    for name in effects:
        structure = structure.with_effect(make_effect(name, robot))
    recordings = [read_recording(bag, joints=robot.joints) for bag in data.bags]
    found, _ = graded(structure, recordings[:1], recordings[1:])
    return found


@pytest.mark.real_data
@pytest.mark.parametrize('machine', ['emps', 'ur10'])
def test_real_recordings_are_good(machine, real_data, tmp_path):
    assert of_machine(machine, real_data, tmp_path).word == 'good'


@pytest.mark.long
@pytest.mark.real_data
def test_a_wrist_with_a_coupling_is_good_with_it_and_unusable_without(real_data, tmp_path):
    """Half of the torque of joint 5 of the TX40 is friction of the coupling with joint 6."""
    without = of_machine('tx40', real_data, tmp_path)
    assert without.word == 'unusable'
    assert 'joint_5' in without.reasons[0]
    (folder := tmp_path / 'coupled').mkdir()
    effects = (*FRICTION, 'coupled_joint_friction')
    assert of_machine('tx40', real_data, folder, effects).word == 'good'


def test_a_position_that_jumps_and_does_not_come_back_at_once_is_poor(structure, run):
    q = run.q.copy()
    q[700:720, 1] += 2.0 * np.pi
    found, _ = graded(structure, [replace(run, q=q)])
    assert found.word != 'good'
    joint = structure.robot.joints[1]
    assert any(joint in one and '7.000 s' in one for one in found.faults)
