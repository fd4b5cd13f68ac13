# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The grade of an identification: what a person would stop at, and nothing else."""

from dataclasses import replace
import re

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification import grade, identify, Score
from armid_ros.identification.assess.grade import beyond_noise, torque_noise
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
    assert len(found.reasons) == 1
    assert 'Torque error on other, held out: ' in found.reasons[0]


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
    error = float(found.reasons[0].split('held out: ')[1].split(' %')[0])
    assert error == pytest.approx(100.0 * share, abs=10.0)


def test_one_bad_recording_among_good_ones_is_not_averaged_away(structure, run, other, sound):
    _, result = sound
    good = result.predict([other])
    bad = [replace(fit, predicted=-fit.predicted) for fit in good]
    found = grade(result, structure, [run], {'a': good, 'b': good, 'c': bad}, [])
    assert found.word == 'unusable'
    assert 'on c, held out' in found.reasons[0]


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
    assert f'100 % (worst joint: {structure.robot.joints[5]})' in found.reasons[0]


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
    assert 'is hardly predicted of' in ' '.join(found.reasons)
    assert found.word == 'poor'
    assert found.reasons[0].startswith('Not identified and not checked')


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
    assert f'do not move: {", ".join(still)}; record' in found.reasons[0]
    assert f'--joints {",".join(moving)}.' in found.reasons[0]


def test_joints_that_rest_in_what_is_held_out_are_said_not_to_be_checked(structure, run, sound):
    _, result = sound
    fits = result.predict([resting(run, [5])])
    exact = [replace(fit, predicted=fit.motion.tau) for fit in fits]
    found = grade(result, structure, [run], {'other': exact})
    last = structure.robot.joints[5]
    assert f'Not checked, as they do not move in what was held out: {last}.' in found.reasons
    assert found.word == 'good'


def named_worst(reasons):
    """Return the error and the joint that a grade names."""
    pattern = r'held out: ([0-9.]+) % \((?:0 % without noise, )?worst joint: (\w+)\)'
    (said,) = re.findall(pattern, ' '.join(reasons))
    return float(said[0]), said[1]


@pytest.mark.slow
@pytest.mark.parametrize('worst', [0, 4])
def test_the_joint_that_is_named_has_the_largest_error_where_all_is_noise(
    structure, run, other, sound, worst
):
    """As large as the noise is every error: none is left of any of them without it."""
    _, result = sound
    rng = np.random.default_rng(0)
    size = np.where(np.arange(6) == worst, 0.4, 0.1)
    fits = result.predict(
        [replace(other, tau=other.tau + size * rng.normal(size=other.tau.shape))]
    )
    exact = [
        replace(fit, predicted=fit.motion.tau + 0.1 * size * rng.normal(size=fit.motion.tau.shape))
        for fit in fits
    ]
    errors = Score.of(exact).joint_relative_error_percent
    assert not np.any(beyond_noise(errors, exact, result.used))
    error, joint = named_worst(grade(result, structure, [run], {'other': exact}).reasons)
    assert joint == structure.robot.joints[int(np.argmax(errors))]
    assert error == pytest.approx(float(errors.max()), rel=0.01)


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
    assert 'halves of the data' in found.reasons[0]
    assert result.halves.whole < 5.0


def test_two_seconds_of_data_are_too_little(arm, structure):
    """The fit is as close as any; what it is fitted to does not repeat."""
    found, result = graded(structure, [record(arm, 1, duration=2.0)])
    assert found.word != 'good'
    assert 's of this motion do not determine' in found.reasons[0]
    assert 'record longer' in found.reasons[0]
    assert result.halves.joints.max() > LIMITS.poor


@pytest.mark.slow
@pytest.mark.parametrize('seed', range(6))
def test_recordings_drawn_at_random_are_good(arm, structure, seed):
    found, _ = graded(structure, [record(arm, 10 + seed, duration=15.0 + 5.0 * seed)])
    assert found.word == 'good'


def test_a_mistake_of_all_recordings_is_said_once(structure, run, other):
    turned = [replace(part, q=part.q * [1, -1, 1, 1, 1, 1]) for part in (run, other)]
    found, _ = graded(structure, turned[:1], turned[1:])
    assert found.word == 'unusable'
    assert found.reasons[0].startswith('The position of shoulder_roll seems to have the opposite')
    assert sum('opposite sign' in reason for reason in found.reasons) == 1


def test_a_mistake_of_one_recording_names_it(structure, run, other):
    turned = replace(other, q=other.q * [1, -1, 1, 1, 1, 1])
    found, _ = graded(structure, [run], [turned])
    assert found.word == 'unusable'
    (said,) = (reason for reason in found.reasons if 'opposite sign' in reason)
    assert said.startswith('In other: the position of shoulder_roll')


def test_a_velocity_of_the_opposite_sign_is_said_and_condemns_nothing(structure, run, other):
    """Positions alone are fitted, so that a velocity that is wrong harms no model."""
    turned = np.gradient(other.q, other.t, axis=0)
    turned[:, 1] *= -1.0
    found, _ = graded(structure, [run], [replace(other, dq=turned)])
    joint = run.joints[1]
    said = f'In other velocities of {joint} have the opposite sign of what the positions do; '
    assert found.word == 'good'
    assert any(reason.startswith(said) for reason in found.reasons)


def test_torques_that_come_late_are_not_good(structure, run):
    """A free fit takes them for friction and inertia, and is not far off."""
    late = replace(run, t=run.t[:-10], q=run.q[10:], tau=run.tau[:-10])
    found, _ = graded(structure, [late])
    assert found.word == 'poor'
    (said,) = re.findall(r'about (\d+) ms later than the position', found.reasons[0])
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
    when = f'from {since / RATE:.3f} s' if since else 'throughout'
    assert f'In run the torque of {joint} stays at 0 N m {when}' in found.reasons[0]
    found, _ = graded(structure, [other], [dead])
    assert found.word == 'unusable'


@pytest.mark.parametrize(
    ('factor', 'word', 'said'),
    [
        (0.05, 'poor', 'seem to be 0.05 times the torque in N m'),  # it may be wrong masses
        (1.0 / 9.80665, 'unusable', 'in kgf m instead of N m'),
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
    assert any('In run the clock jumped back; 1000 of 3000' in line for line in found.reasons)


def test_what_goes_down_gives_out_energy_and_is_no_wrong_sign(arm, structure):
    """Three seconds in which the arm sinks were refused as torques of the opposite sign."""
    motion = multisine(arm.robot.joints, 3.0, 200.0, seed=1)
    found, _ = graded(structure, [recorded(arm, motion, torque_noise=0.02)])
    assert found.word in ('good', 'poor', 'unusable')


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
    assert 'worst joint: joint_5' in without.reasons[0]
    (folder := tmp_path / 'coupled').mkdir()
    effects = (*FRICTION, 'coupled_joint_friction')
    assert of_machine('tx40', real_data, folder, effects).word == 'good'


@pytest.mark.parametrize('back', [20, None])
def test_a_position_that_jumps_and_does_not_come_back_at_once_is_poor(structure, run, back):
    q = run.q.copy()
    q[700 : None if back is None else 700 + back, 1] += 2.0 * np.pi
    found, _ = graded(structure, [replace(run, q=q)])
    assert found.word != 'good'
    joint = structure.robot.joints[1]
    assert any(f'position of {joint} jumps by 6.29 rad at 7.000 s' in one for one in found.faults)
