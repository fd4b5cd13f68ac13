# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with a recording is said, with the joint; what is right is not complained of."""

from dataclasses import replace

import armid_ros as ar
from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect, USUAL_EFFECTS
from armid_ros.identification import identify
from armid_ros.identification.assess.grade import grade
from armid_ros.inspection.facts import Sampling
from armid_ros.recording import ReadReport, Recording
from armid_ros.recording.recording import PositionRange
from armid_ros.robots import load_robot
import numpy as np
import pytest

from tests.identification.conftest import multisine, recorded

PERIOD = 10.0


@pytest.fixture(scope='module')
def clean(robot):
    """Record two periods of a motion of the arm with friction, at 100 Hz."""
    motion = multisine(robot.joints, 2 * PERIOD, 100.0, seed=0, base_hz=1.0 / PERIOD)
    bent = replace(motion, q=motion.q + 0.6 * (np.arange(6) == 3))  # the elbow bends one way
    arm = ArmModel(robot).with_effect(make_effect('viscous_friction', robot), np.full(6, 0.1))
    run = recorded(arm, bent, torque_noise=0.002, source='run')
    return replace(run, dq=motion.dq)


def remarks(recording, robot=None):
    """Return what an inspection remarks, each with its weight in front."""
    found = ar.inspect(robot, recording).core
    return [f'{remark.weight}: {remark.text}' for remark in found.remarks]


def test_of_a_clean_recording_nothing_is_said(clean, robot):
    found = ar.inspect(robot, clean).core
    assert found.remarks == ()
    assert found.trial.rank == found.trial.theory
    assert found.trial.relative_error_percent < 3.0
    assert found.sampling.period == pytest.approx(PERIOD, abs=0.1)
    assert found.sampling.periods == pytest.approx(2.0, abs=0.02)
    for joint in found.joints:
        assert joint.velocity_ratio == pytest.approx(1.0, abs=0.03)


def test_a_motion_that_does_not_repeat_has_no_period(clean):
    half = clean.select(slice(0, 1300))
    assert Sampling.of(half).period is None
    turning = replace(clean, q=np.cumsum(np.ones((2000, 6)), axis=0) * 1e-3)
    assert Sampling.of(turning).period is None


def jittering(clean):
    noise = np.random.default_rng(1).uniform(-0.004, 0.004, len(clean))
    return replace(clean, t=clean.t + noise)


@pytest.mark.parametrize(
    ('spoil', 'said'),
    [
        (lambda run: replace(run, q=np.degrees(run.q), dq=np.degrees(run.dq)), 'pitch reaches'),
        (lambda run: replace(run, dq=np.degrees(run.dq)), 'degrees/s'),
        (lambda run: replace(run, dq=-run.dq), 'opposite sign'),
        (lambda run: replace(run, dq=0 * run.dq), 'are zero'),
        (lambda run: replace(run, tau=None), 'bad: no efforts'),
        (lambda run: replace(run, tau=0 * run.tau + 1.0), 'bad: efforts'),
        (lambda run: replace(run, q=0 * run.q + 0.2, dq=0 * run.dq), 'bad: no joint'),
        (lambda run: replace(run, q=np.where(np.arange(6) == 3, 0.6, run.q)), 'frozen'),
        (lambda run: run.select(np.r_[0:800, 860:2000]), '0.61 s'),
        (jittering, 'vary by'),
        (lambda run: replace(run, q=np.repeat(run.q[::4], 4, axis=0)), 'repeat in'),
        (lambda run: run.select(slice(0, 300)), 'is short'),
    ],
)
def test_what_is_wrong_is_said_without_a_robot(spoil, said, clean):
    assert any(said in remark for remark in remarks(spoil(clean))), remarks(spoil(clean))
    assert not any(said in remark for remark in remarks(clean))


@pytest.mark.parametrize(
    ('factor', 'said'), [(1e3, 'N mm'), (-1.0, 'opposite'), (12.0, 'kgf cm'), (4.0, 'currents')]
)
def test_units_of_efforts_are_seen_against_the_description(factor, said, clean, robot):
    wrong = replace(clean, tau=factor * clean.tau)
    assert any(said in remark for remark in remarks(wrong, robot))


def test_stamps_that_are_rounded_are_said_with_their_step(clean):
    """Of five samples in 50 ms two have one stamp if it is rounded to 12.5 ms."""
    t = np.round(clean.t / 0.0125) * 0.0125
    first = np.flatnonzero(np.diff(t, prepend=-1.0) > 0.0)
    lost = len(clean) - len(first)
    report = ReadReport(messages=len(clean), samples=len(first), duplicates=lost)
    rounded = replace(clean.select(first), t=t[first], report=report)
    assert any('12.5 ms' in remark and f'{lost} of' in remark for remark in remarks(rounded))
    twice = replace(clean, report=replace(report, samples=len(clean)))
    jittered = replace(twice, t=clean.t + 1e-3 * np.random.default_rng(1).uniform(size=2000))
    assert not any('rounded' in remark for remark in remarks(jittered))


@pytest.mark.parametrize('beyond', [0.3, -0.2, 1e-3])
def test_a_joint_beyond_its_limit_is_doubted_with_both_numbers(clean, robot, beyond):
    """A stop gives way by a hundredth of the range."""
    elbow, end = clean.q[:, 3], np.sign(beyond)
    limit, reached = (robot.upper[3], elbow.max()) if end > 0.0 else (robot.lower[3], elbow.min())
    shifted = replace(clean, q=clean.q + (limit + beyond - reached) * np.eye(6)[3])
    found = [remark for remark in remarks(shifted, robot) if 'limits' in remark]
    assert bool(found) == (abs(beyond) > 0.1)
    for remark in found:
        assert remark.startswith('doubt: ') and 'elbow_pitch' in remark
        assert f'{limit + beyond:.4g} of {limit:.4g} rad' in remark


def test_a_joint_that_moves_without_being_driven_is_doubted(clean):
    left = load_robot('humanoid_arm', joints=clean.joints[:-1])
    q, tau = clean.q[:, :-1], clean.tau[:, :-1]
    others = (PositionRange(clean.joints[-1], -0.5, 0.6),)
    part = replace(clean, joints=left.joints, q=q, dq=None, tau=tau, others=others)
    said = [text for text in remarks(part, left) if clean.joints[-1] in text]
    assert any(text.startswith('doubt: ') and '-0.5' in text for text in said)


@pytest.mark.slow
def test_what_identify_calls_unusable_is_not_taken(clean, robot):
    """The grade of identify is asked, whatever it is for: here a torque that is no arm's."""
    pushed = clean.tau.std(axis=0) * np.sin(7.0 * clean.t)[:, np.newaxis]
    other = replace(clean, tau=clean.tau + pushed)
    arm = ArmModel.of(robot, effects=USUAL_EFFECTS)
    result = identify(arm, [other], rng=np.random.default_rng(0))
    graded = grade(result, arm, [other], {})
    found = ar.inspect(robot, other).core
    assert graded.word != 'good'
    assert (found.trial.grade, found.trial.reasons) == (graded.word, graded.reasons)
    assert graded.word in found.verdict and graded.reasons[0] in found.verdict


@pytest.mark.parametrize('period', [6.0, 7.973, 8.0])
def test_a_period_is_no_multiple_of_the_step_that_it_is_searched_with(period):
    t = np.arange(4000) / 200.0
    angle = 2.0 * np.pi * t[:, np.newaxis] / period
    q = np.sin(angle + np.array([0.0, 1.0])) + 0.4 * np.sin(3.0 * angle + np.array([2.0, 0.5]))
    recording = Recording(joints=('a', 'b'), t=t, q=q)
    assert Sampling.of(recording).period == pytest.approx(period, abs=1e-3)
