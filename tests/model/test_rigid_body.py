# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

from armid_ros.errors import RobotError
from armid_ros.model import (
    gravity_sensitivity,
    inverse_dynamics,
    inverse_dynamics_derivatives,
    random_motion,
    regressor,
)
from armid_ros.model.pseudo_inertia import Consistency
from armid_ros.robots import load_robot
import numpy as np
import pytest


@pytest.fixture(scope='module', params=['earth', 'moon', '1.0,-2.0,3.0'])
def arm(request):
    return load_robot('humanoid_arm', gravity=request.param)


@pytest.fixture
def motion(arm):
    return random_motion(arm, np.random.default_rng(1), 30)


def test_regressor_times_parameters_is_inverse_dynamics(arm, motion):
    tau = regressor(arm, motion) @ arm.rigid_parameters
    np.testing.assert_allclose(tau, inverse_dynamics(arm, motion), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize('rounded', [0.0, 4.1e-17, -4.1e-17])
def test_a_mass_is_zero_however_it_is_rounded(arm, motion, rounded):
    """What a first moment without a mass is answered with does not depend on the processor."""
    parameters = arm.rigid_parameters.copy()
    parameters[50], parameters[51:54] = rounded, [0.0, 0.18, 0.0]
    with pytest.raises(RobotError, match='no mass'):
        arm.with_inertias(parameters)
    parameters[51:54] = rounded
    tau = inverse_dynamics(arm.with_inertias(parameters), motion)
    np.testing.assert_allclose(tau, regressor(arm, motion) @ parameters, rtol=1e-9, atol=1e-12)
    nothing = Consistency.of('link', [rounded, *np.full(9, rounded)])
    assert np.isnan([*nothing.center, *nothing.moments]).all()


def test_derivatives_are_those_of_bodies_that_no_arm_has_too(arm, motion):
    """A fit of base parameters may leave links less than nothing, alone and together."""
    parameters = arm.rigid_parameters.copy()
    parameters[::10] -= 1.3 * parameters[::10].max()
    fitted = arm.with_inertias(parameters)
    by_q, by_dq, by_ddq = inverse_dynamics_derivatives(fitted, motion)
    step = 1e-6
    for exact, name in ((by_q, 'q'), (by_dq, 'dq'), (by_ddq, 'ddq')):
        for joint in range(arm.n_joints):
            ends = []
            for sign in (1.0, -1.0):
                moved = getattr(motion, name) + sign * step * np.eye(arm.n_joints)[joint]
                ends.append(inverse_dynamics(fitted, replace(motion, **{name: moved})))
            slope = (ends[0] - ends[1]) / (2.0 * step)
            np.testing.assert_allclose(exact[:, :, joint], slope, rtol=1e-6, atol=1e-5)


def test_torque_is_linear_in_gravity(arm, motion):
    weightless = inverse_dynamics(arm.with_gravity(np.zeros(3)), motion)
    weight = gravity_sensitivity(arm, motion.q) @ arm.gravity
    np.testing.assert_allclose(weightless + weight, inverse_dynamics(arm, motion), atol=1e-12)
