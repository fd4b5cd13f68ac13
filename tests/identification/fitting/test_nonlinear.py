# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every effect of the catalogue, alone and in pairs, is fitted as the arm has it."""

from dataclasses import replace
from itertools import pairwise

from armid_ros.arm import ArmModel
from armid_ros.effects import CATALOGUE, make_effect
from armid_ros.identification import IdentificationSettings, identify, Score
from armid_ros.motion import Temperatures
import numpy as np
import pytest

from tests.effects.test_contract import SIZES

from ..conftest import multisine, recorded

NOISE = 0.002
#: Effects that change the columns of others.
NONLINEAR = (
    'load_dependent_friction torque_gain torque_crosstalk torque_lag time_delay encoder_offset '
    'gravity_magnitude base_tilt joint_elasticity backlash'
).split()
_ORDER = np.random.default_rng(0).permutation(list(CATALOGUE)).tolist()
#: Every effect with two others.
PAIRS = list(pairwise([*_ORDER, _ORDER[0]]))


def with_sizes(robot, names, seed):
    """Return an arm that is 10 % heavier than described, with effects as large as is typical."""
    rng = np.random.default_rng(seed)
    arm = ArmModel(robot.with_inertias(1.1 * robot.rigid_parameters))
    for name in dict.fromkeys(['viscous_friction', *names]):
        effect = make_effect(name, robot).referred_to(dict.fromkeys(robot.joints, 30.0))
        if name == 'presliding_hysteresis':  # what it was bent by before is soon forgotten
            effect = effect.with_shape(0.001)
        typical = [np.sqrt(np.prod(q.typical)) if q.typical else 0.1 for q in effect.quantities]
        size = np.resize(SIZES.get(name, typical), len(effect.parameters(robot)))
        lower = np.resize([q.lower for q in effect.quantities], len(size))
        if name == 'actuator_saturation':  # a report that is clipped is not what was asked for
            size[1::2] = 0.0
        sign = np.where(lower < 0.0, rng.choice([-1.0, 1.0], len(size)), 1.0)
        arm = arm.with_effect(effect, sign * size * rng.uniform(0.7, 1.3, len(size)))
    return arm


def warming(robot, duration, seed):
    """Return a motion in which the joints warm up from 20 to 40 degC."""
    ends = np.tile([[20.0], [40.0]], robot.n_joints)
    motion = multisine(robot.joints, duration, 200.0, seed=seed)
    return replace(motion, temperature=Temperatures(motion.t[[0, -1]], ends))


def fitted(robot, names, seed=0, **settings):
    """Return the true arm, what was recorded of it, and its identification."""
    truth = with_sizes(robot, names, seed)
    recording = recorded(truth, warming(robot, 12.0, 1), seed, NOISE)
    structure = ArmModel(robot, truth.effects)
    asked = IdentificationSettings(**settings)
    result = identify(structure, [recording], asked, rng=np.random.default_rng(0))
    return truth, recording, result


def error(fits):
    return Score.of(fits).relative_error_percent


def leaves_the_noise(recording, result):
    """Check that a fit has converged, predicts its training data, and leaves their noise."""
    training = error(result.training)
    assert error(result.predict([recording])) == pytest.approx(training, rel=1e-3)
    assert not any('has not converged' in note for note in result.notes)
    np.testing.assert_allclose(
        result.joint_std, NOISE * np.linalg.norm(result.used.taps), rtol=0.3
    )


def agrees(robot, names, seed=0):
    """Check the prediction of the training data, and the truth along another motion."""
    truth, recording, result = fitted(robot, names, seed)
    leaves_the_noise(recording, result)
    other = recorded(truth, warming(robot, 6.0, 7))
    assert error(result.predict([other])) < 1.0
    return truth, result


@pytest.mark.slow
@pytest.mark.parametrize('name', CATALOGUE)
def test_the_training_data_given_again_have_the_training_error_and_the_truth_comes_back(
    robot, name
):
    truth, result = agrees(robot, [name])
    there = truth.base_parameters(np.random.default_rng(0))
    own = {
        p for p, row in zip(there.parameters, there.grouping, strict=True) if sum(row != 0) == 1
    }
    alone = [parameter in own for parameter in result.base.parameters]
    off = (result.estimate.values - result.base.values(truth.theta)) / result.estimate.std
    assert np.abs(off[alone]).max(initial=0.0) < 5.0
    assert (result.passes > 1) == (name in NONLINEAR)


@pytest.mark.long
@pytest.mark.parametrize('pair', PAIRS, ids='+'.join)
def test_pairs_too(robot, pair):
    agrees(robot, pair, seed=1)


def test_what_is_known_of_a_nonlinear_effect_is_where_the_fit_begins(robot):
    """An arm that has the values already is at its own torque, not at that of its columns."""
    truth, recording, _ = fitted(robot, ['torque_gain', 'encoder_offset'])
    leaves_the_noise(recording, identify(truth, [recording], rng=np.random.default_rng(0)))


def test_a_fit_that_does_not_settle_says_so(robot, monkeypatch):
    monkeypatch.setattr('armid_ros.identification.fitting.nonlinear._MAX_PASSES', 1)
    _, recording, result = fitted(robot, ['torque_gain'])
    assert any('has not converged' in note for note in result.notes)
    training = error(result.training)
    assert error(result.predict([recording])) == pytest.approx(training, rel=1e-3)


def test_what_the_described_torque_never_reaches_is_found_where_the_fitted_one_does(robot):
    """Springs that the description does not know of take drives beyond their level."""
    truth, recording, result = fitted(robot, ['actuator_saturation', 'joint_spring'], seed=1)
    levels = np.array(truth.effects[1].shape)
    assert np.any(np.abs(result.training[0].motion.tau).max(axis=0) > levels)
    leaves_the_noise(recording, result)
