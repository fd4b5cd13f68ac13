# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The grade of an identification: what a person would stop at, and nothing else."""

from dataclasses import replace
import re

from armid_ros.identification import grade, identify, Score
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.recording import ReadReport
import numpy as np
import pytest

from ..conftest import multisine, recorded

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
def sound(structure, run):
    return identify(structure, [run], rng=np.random.default_rng(0))


@pytest.mark.parametrize(
    ('share', 'word'), [(0.0, 'good'), (0.3, 'poor'), (0.8, 'unusable'), (1.59, 'unusable')]
)
def test_the_word_follows_the_held_out_error(structure, run, other, sound, share, word):
    """Torques that no motion explains; noise alone is a tenth of the smallest torque."""
    fits = sound.predict([other])
    rng = np.random.default_rng(0)
    off = [
        replace(fit, predicted=fit.predicted + share * rng.permutation(fit.motion.tau))
        for fit in fits
    ]
    found = grade(sound, structure, [run], {'other': off}, [other])
    assert found.word == word and 'on other' in found.reasons[0]
    assert len(found.reasons) == 1 or share > 0.0
    assert held_out_error(found.reasons[0]) == pytest.approx(100.0 * share, abs=10.0)


def test_one_bad_recording_among_good_ones_is_not_averaged_away(structure, run, other, sound):
    good = sound.predict([other])
    bad = [replace(fit, predicted=-fit.predicted) for fit in good]
    found = grade(sound, structure, [run], {'a': good, 'b': good, 'c': bad}, [])
    assert found.word == 'unusable'
    assert 'on c,' in found.reasons[0]


def test_the_grade_is_that_of_the_joint_that_is_predicted_worst(structure, run, other, sound):
    """Of all joints together hardly anything is off: the others take ten times the torque."""
    fits = sound.predict([other])
    blind = [replace(fit, predicted=fit.predicted * [1, 1, 1, 1, 1, 0]) for fit in fits]
    assert Score.of(blind).relative_error_percent < LIMITS.poor
    found = grade(sound, structure, [run], {'other': blind}, [other])
    assert found.word == 'unusable'
    assert held_out_error(found.reasons[0]) == 100.0
    assert structure.robot.joints[5] in found.reasons[0]


@pytest.mark.slow
def test_noise_as_large_as_the_torque_of_a_joint_condemns_no_model(structure, run, other):
    """No model predicts noise."""
    rng, wrist = np.random.default_rng(0), np.arange(6) == 5
    loud = []
    for part in (run, other):
        noise = wrist * np.std(part.tau, axis=0) * rng.normal(size=part.tau.shape)
        loud.append(replace(part, tau=part.tau + noise))
    found, result = graded(structure, loud[:1], loud[1:])
    error = Score.of(result.predict(loud[1:])).joint_relative_error_percent[5]
    assert error > LIMITS.poor
    assert found.word == 'good'


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
    resting = replace(run, q=np.where(np.arange(6) == 5, 0.1, run.q))
    exact = [replace(fit, predicted=fit.motion.tau) for fit in sound.predict([resting])]
    found = grade(sound, structure, [run], {'other': exact})
    assert any(structure.robot.joints[5] in reason for reason in found.reasons[1:])
    assert found.word == 'good'


def test_without_held_out_data_halves_of_the_recording_judge_each_other(structure, run, sound):
    found = grade(sound, structure, [run], {})
    assert found.word == 'good'
    assert 'halves of the data' in found.reasons[0]
    assert sound.halves.relative_error_percent < 5.0


def test_two_seconds_of_data_are_too_little(arm, structure):
    """The fit is as close as any; what it is fitted to does not repeat."""
    found, result = graded(structure, [record(arm, 1, duration=2.0)])
    assert found.word != 'good'
    assert 'record longer' in found.reasons[0]
    assert result.halves.joint_relative_error_percent.max() > LIMITS.poor


@pytest.mark.parametrize('held_out', [False, True])
def test_a_mistake_is_said_once_with_its_joint_and_recording(structure, run, other, held_out):
    turned = [replace(part, q=part.q * [1, -1, 1, 1, 1, 1]) for part in (run, other)]
    found, _ = graded(structure, [run] if held_out else turned[:1], turned[1:])
    assert found.word == 'unusable'
    (said,) = (reason for reason in found.reasons if 'opposite sign' in reason)
    assert 'shoulder_roll' in said
    assert ('In other' in said) == held_out


def late(run):
    return replace(run, t=run.t[:-10], q=run.q[10:], tau=run.tau[:-10])


def dead(run):
    """Torque of a channel that is numerically zero, of which a fit makes weightless links."""
    return replace(run, tau=np.where(np.arange(6) == 2, 1e-309 * run.tau, run.tau))


def backwards(run):
    """Velocities with the opposite sign, which the fit does not use."""
    return replace(run, dq=-np.gradient(run.q, run.t, axis=0))


def jumping(run):
    return replace(run, q=run.q + 2.0 * np.outer(run.t >= 10.0, np.arange(6) == 1))


def restarted(run):
    return replace(run, report=ReadReport(messages=3000, samples=2000, restarted=1000))


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize(
    ('change', 'word', 'fact'),
    [
        (late, 'poor', r'\b(99|10[01]) ms'),
        (lambda run: replace(run, tau=0.05 * run.tau), 'poor', r'0\.05 times'),  # or wrong masses
        (lambda run: replace(run, tau=run.tau / 9.80665), 'unusable', 'kgf m'),
        (dead, 'unusable', 'torque of upper_arm_yaw'),
        (jumping, 'unusable', 'shoulder_roll jumps'),
        (restarted, 'good', 'clock.*1000'),
        (backwards, 'good', 'In run velocities.*opposite sign'),
    ],
    ids=['late', 'currents', 'unit', 'dead', 'jump', 'clock', 'velocity'],
)
def test_a_mistake_that_a_free_fit_hides_is_graded(structure, run, change, word, fact):
    found, _ = graded(structure, [change(run)])
    assert found.word == word
    assert re.search(fact, ' '.join(found.reasons))
