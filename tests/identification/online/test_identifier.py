# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.errors import IdentificationError
from armid_ros.identification import identify, Score
from armid_ros.identification.online.checks import MissingSamples
from armid_ros.identification.online.identifier import OnlineIdentifier, OnlineSettings
from armid_ros.identification.rows.causal import MOTION_FILTER_RATIO
from armid_ros.identification.rows.regression import Fit, regressions
from armid_ros.recording import read_recording
from armid_ros.robots import load_robot
import numpy as np
import pytest

from benchmarks import real_recordings

from ..conftest import multisine

NOISE = 0.02
SETTINGS = OnlineSettings(torque_noise=(NOISE,) * 6)


def identifier(arm, settings=SETTINGS):
    """Return an identifier that knows the kinematics but none of the values."""
    nothing = replace(arm, values=())
    return OnlineIdentifier(nothing, settings, rng=np.random.default_rng(0))


def feed(online, t, q, tau):
    samples = (online.update(a, b, None, c) for a, b, c in zip(t, q, tau, strict=True))
    return [sample for sample in samples if sample is not None]


def torque_error(arm, online, motion):
    """Return the error of predicted torques on true motion, relative, all joints."""
    columns = arm.columns(motion.select(slice(0, None, 50)))[:, :, online.base.independent]
    truth = columns @ online.base.values(arm.theta)
    return np.linalg.norm(columns @ online.estimate().values - truth) / np.linalg.norm(truth)


@pytest.fixture(scope='module')
def motion(arm):
    return multisine(arm.robot.joints, 20.0, 500.0, seed=0, base_hz=0.14)


@pytest.fixture(scope='module')
def tau(arm, motion):
    return arm.torque(motion)


@pytest.mark.long
@pytest.mark.slow
def test_filtering_does_not_bias_a_rigid_arm(arm, motion):
    """
    Without noise the truth is found, and a single filter before the regressor would not do.

    The second identifier has F where the first has G, so all of its low-pass is before the
    regressor: its bias is about the square of MOTION_FILTER_RATIO as large.

    """
    rigid = ArmModel(arm.robot)
    tau = rigid.torque(motion)
    behind, before = (
        identifier(rigid, OnlineSettings(cutoff=cutoff))
        for cutoff in (5.0, 5.0 / MOTION_FILTER_RATIO)
    )
    for online in (behind, before):
        feed(online, motion.t, motion.q, tau)
    error, coarse = (torque_error(rigid, online, motion) for online in (behind, before))
    assert error < 1e-4
    assert coarse > 0.5 * MOTION_FILTER_RATIO**2 * error


def test_predictions_are_made_before_the_sample_is_seen_and_get_good(arm, motion, tau):
    rng = np.random.default_rng(2)
    online = identifier(arm)
    samples = feed(online, motion.t, motion.q, tau + NOISE * rng.normal(size=tau.shape))
    late = samples[len(samples) // 2 :]
    rms = np.sqrt(np.mean([s.residual**2 for s in late], axis=0))
    assert np.all(rms < 0.3 * NOISE)  # what the low-pass leaves of the noise
    # the stamp is the time of the motion, so that the curve lies on the unfiltered torque
    stamps = np.array([s.t for s in late])
    measured = np.array([s.measured for s in late])
    shifted = [
        np.linalg.norm(measured[:, 1] - np.interp(stamps + shift, motion.t, tau[:, 1]))
        for shift in (-0.02, 0.0, 0.02)
    ]
    assert np.argmin(shifted) == 1


def test_a_model_without_noise_predicts_from_thinned_rows_what_the_arm_does(arm, motion, tau):
    """Rows have the rate that the filter passes."""
    online = identifier(arm)
    feed(online, motion.t, motion.q, tau)
    assert online.samples == pytest.approx(200.0 * 20.0, rel=0.05)
    assert online.delay == pytest.approx(0.061, abs=0.002)
    assert online.condition_number < 1e5
    error = np.linalg.norm(online.model().torque(motion) - tau) / np.linalg.norm(tau)
    assert error < 1e-3


def test_an_arm_at_rest_teaches_nothing_it_could_unlearn(arm, motion, tau):
    """Held by friction, with torques anywhere within it, after a motion."""
    rng = np.random.default_rng(3)
    online = identifier(arm, replace(SETTINGS, forgetting=0.999))
    feed(online, motion.t[::2], motion.q[::2], tau[::2])
    t = motion.t[-1] + 1.0 + np.arange(2_000) * 4e-3
    q = motion.q[-1] + 1e-5 * rng.normal(size=(len(t), 6))
    held = tau[-1] + 0.05 * rng.uniform(-1.0, 1.0, 6) + NOISE * rng.normal(size=(len(t), 6))
    samples = feed(online, t[:500], q[:500], held[:500])  # which finishes work in the background
    before = online.estimate()
    samples += feed(online, t[500:], q[500:], held[500:])
    assert samples and not np.any([s.used for s in samples])
    after = online.estimate()
    np.testing.assert_array_equal(after.values, before.values)
    np.testing.assert_array_equal(after.covariance, before.covariance)


@pytest.mark.real_data
def test_a_real_arm_is_identified_online_as_well_as_offline(real_data):
    """UR10, one pass at 125 Hz: within a tenth of the offline fit of the same bag."""
    data = real_recordings.ur10(real_data)
    robot = load_robot(str(data.robot))
    arm = ArmModel.of(robot, effects='viscous_friction,coulomb_friction,torque_offset')
    recording = read_recording(data.bags[0], joints=robot.joints)
    offline = identify(arm, [recording], rng=np.random.default_rng(0))
    online = OnlineIdentifier(arm, rng=np.random.default_rng(0))
    feed(online, recording.t, recording.q, recording.tau)
    assert not online.rejected and not online.restarts
    problem = regressions(arm, online.base.independent, [recording], offline.used)
    values = online.estimate().values
    fits = [Fit(p.source, p.motion, p.informative, p.columns @ values) for p in problem]
    error = Score.of(fits).relative_error_percent
    assert error <= 6.6
    assert error <= 1.1 * Score.of(offline.training).relative_error_percent


def test_before_any_motion_the_model_is_the_one_given(arm):
    online = OnlineIdentifier(arm, rng=np.random.default_rng(0))
    np.testing.assert_allclose(online.model().theta, arm.theta, atol=1e-9)
    assert online.samples == 0
    assert online.delay is None


def test_an_arm_may_have_a_single_joint_without_a_known_limit():
    robot = load_robot('humanoid_arm', joints=('shoulder_pitch',))
    robot = replace(robot, torque_limit=np.full(1, np.inf))
    motion = multisine(robot.joints, 10.0, 200.0, seed=0)
    online = OnlineIdentifier(ArmModel(robot), rng=np.random.default_rng(0))
    feed(online, motion.t, motion.q, ArmModel(robot).torque(motion))
    truth = online.base.values(robot.rigid_parameters)
    np.testing.assert_allclose(online.estimate().values, truth, rtol=1e-3)


def test_reset_forgets_everything(arm, motion, tau):
    fresh, online = identifier(arm), identifier(arm)
    feed(online, motion.t[:1000], motion.q[:1000], tau[:1000])
    online.update(0.0, motion.q[0], None, tau[0])
    online.reset()
    assert online.samples == 0
    assert not online.rejected and not online.restarts
    for one in (fresh, online):
        feed(one, motion.t[:2000], motion.q[:2000], tau[:2000])
    np.testing.assert_array_equal(online.estimate().values, fresh.estimate().values)


def test_effects_that_remember_are_refused(arm):
    remembering = arm.with_effect(make_effect('presliding_hysteresis', arm.robot))
    with pytest.raises(IdentificationError, match='presliding_hysteresis'):
        OnlineIdentifier(remembering, rng=np.random.default_rng(0))


PERIOD = 0.001


def missing(stamps):
    samples = MissingSamples()
    for t in stamps:
        samples.take(t, PERIOD)
    return samples.count


@pytest.mark.parametrize('lost', [(), (7,), (7, 8, 9), (5, 50, 51, 90)])
def test_every_sample_that_did_not_come_is_counted(lost):
    rng = np.random.default_rng(0)
    stamps = PERIOD * (np.arange(100) + 0.2 * rng.uniform(-1.0, 1.0, 100))
    assert missing(np.delete(stamps, lost)) == len(lost)


@pytest.mark.parametrize('late', [0.7, 3.8])
def test_a_sender_that_pauses_and_catches_up_has_lost_nothing(late):
    index = np.arange(40.0)
    stamps = PERIOD * np.where(index < 20, index, np.maximum(index, 20.0 + late))
    stamps = stamps + 1e-6 * index  # no two are alike
    assert missing(stamps) == 0


def test_a_pause_and_a_clock_that_is_set_are_no_loss():
    assert missing([0.0, 0.001, 3600.0, 3600.001, 1.0, 1.001]) == 0


def test_what_comes_out_of_order_does_not_count_twice():
    stamps = list(PERIOD * np.arange(20.0))
    assert missing([*stamps[:10], stamps[6], *stamps[10:]]) == 0
    assert missing([*stamps[:6], stamps[7], stamps[6], *stamps[8:]]) == 0
