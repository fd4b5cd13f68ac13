# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Gradients by the coefficients against differences along a direction."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.excitation import DesignProblem, DesignSettings
from armid_ros.excitation.feasibility import random_feasible
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.search import functions
from armid_ros.excitation.search.functions import Constraints, Objective
from armid_ros.model import random_motion
import numpy as np
import pytest

from .conftest import with_effects


def central(function, x, direction, step=1e-6):
    """Differentiate along a direction."""
    ahead, behind = function(x + step * direction), function(x - step * direction)
    return (np.asarray(ahead) - np.asarray(behind)) / (2.0 * step)


def coefficients(problem, rng):
    arm, limits, settings = problem.arm, problem.limits, problem.settings
    return random_feasible(arm, limits, settings.period, settings.harmonics, rng).coefficients


EFFECTS = {
    'none': (),
    'friction': ('viscous_friction', 'coulomb_friction', 'torque_offset', 'asymmetric_friction'),
    'drive': ('rotor_inertia', 'coupled_joint_friction'),
    'gravity': ('base_tilt',),
    'state': ('stribeck_friction', 'load_dependent_friction', 'torque_ripple'),
    'history': ('time_delay',),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ('robot', 'effects', 'settings'),
    [
        *(('tree', effects, {}) for effects in EFFECTS.values()),
        *(('tree', EFFECTS['state'], {'criterion': c}) for c in ('A', 'E', 'condition')),
        ('humanoid', (), {'target': 'gravity'}),
        ('humanoid', ('coulomb_friction', 'payload'), {'target': 'gravity'}),
        ('humanoid', ('payload', 'viscous_friction'), {'target': 'effects'}),
    ],
)
def test_gradient_of_each_criterion_effect_and_target(request, robot, effects, settings):
    arm = with_effects(request.getfixturevalue(robot), *effects)
    settings = DesignSettings(period=5.0, harmonics=2, **settings)
    problem = DesignProblem.of(arm, settings, np.random.default_rng(3))
    assert_gradient(Objective(problem), problem)


def test_gradient_of_a_subset_with_prior_information(two_link_arm):
    settings = DesignSettings(period=5.0, harmonics=2, focus=('coulomb_friction',))
    rng = np.random.default_rng(3)
    problem = DesignProblem.of(two_link_arm, settings, rng)
    known = problem.information(random_motion(two_link_arm.robot, rng, 50)).matrix
    assert_gradient(Objective(problem, known), problem)


def test_gradient_against_a_rival(two_link):
    settings = DesignSettings(period=5.0, harmonics=2, criterion='T')
    arm = ArmModel(two_link).with_effect(make_effect('viscous_friction', two_link), [0.5, 0.2])
    rival = with_effects(two_link, 'coulomb_friction', 'torque_offset')
    problem = DesignProblem.of(arm, settings, np.random.default_rng(3), rival)
    assert_gradient(Objective(problem), problem)


def assert_gradient(objective, problem):
    rng = np.random.default_rng(4)
    x = coefficients(problem, rng)
    _, gradient = objective.value(x)
    exact = gradient()
    for _ in range(3):
        direction = rng.normal(size=x.shape)
        numeric = central(lambda y: objective.value(y)[0], x, direction, 1e-5)
        np.testing.assert_allclose(np.sum(exact * direction), numeric, rtol=2e-5, atol=1e-7)
    with pytest.MonkeyPatch.context() as patch:  # the body by differences
        patch.setattr(functions, 'regressor_slopes', lambda *_: None)
        np.testing.assert_allclose(gradient(), exact, atol=2e-5 * np.abs(exact).max())


@pytest.mark.slow
@pytest.mark.parametrize(
    'effects',
    [
        (),
        ('viscous_friction', 'rotor_inertia'),
        ('coulomb_friction', 'load_dependent_friction', 'encoder_offset'),
        ('stribeck_friction', 'quadratic_friction', 'torque_ripple'),
        ('joint_spring', 'payload'),
    ],
)
def test_gradient_of_the_constraints(humanoid, humanoid_collision, effects):
    settings = DesignSettings(period=5.0, harmonics=2)
    arm = with_effects(humanoid, *effects)
    arm = replace(arm, values=tuple(v + 0.3 for v in arm.values))
    rng = np.random.default_rng(5)
    problem = DesignProblem.of(arm, settings, rng)
    constraints = Constraints(
        problem,
        ClearanceModel.of(humanoid_collision, 0.01),
        reserve=0.01,
        sharpness=60.0,
        more_times=np.array([0.123]),
    )
    x = coefficients(problem, rng)
    values, gradients = constraints.value(x)
    direction = rng.normal(size=x.shape)
    numeric = central(lambda y: constraints.value(y)[0], x, direction)
    np.testing.assert_allclose(np.sum(gradients() * direction, axis=(1, 2)), numeric, atol=1e-4)
    assert len(values) == 4 * humanoid.n_joints + 20
