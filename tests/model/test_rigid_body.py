# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

from armid_ros.errors import RobotError
from armid_ros.model import (
    gravity_sensitivity,
    inverse_dynamics,
    inverse_dynamics_derivatives,
    points_motion,
    random_motion,
    regressor,
)
from armid_ros.model.pseudo_inertia import (
    Consistency,
    link_parameters,
    pseudo_inertia,
)
from armid_ros.robots import load_robot
import numpy as np
import pinocchio as pin
import pytest

from tests.simulation.test_compiled import TREE


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


@pytest.mark.parametrize('joints', [None, ('j2',), ('j1', 'j2')])
def test_points_of_links_are_where_pinocchio_has_them(joints):
    robot = load_robot('humanoid_arm' if joints is None else TREE, joints=joints)
    rng = np.random.default_rng(0)
    q = rng.uniform(-1.0, 1.0, (5, robot.n_joints))
    offsets = rng.normal(size=(robot.n_joints, 3))
    positions, jacobians = points_motion(robot, robot.joints, offsets, q)
    data = robot.model.createData()
    for k, configuration in enumerate(q):
        pin.computeJointJacobians(robot.model, data, configuration)
        for i, offset in enumerate(offsets):
            place = data.oMi[i + 1]
            np.testing.assert_allclose(positions[k, i], place.act(offset), atol=1e-12)
            frame = pin.SE3(np.eye(3), place.rotation @ offset)
            moved = pin.getJointJacobian(
                robot.model, data, i + 1, pin.LOCAL_WORLD_ALIGNED
            ).reshape(6, -1)
            at_point = frame.actionInverse @ moved
            np.testing.assert_allclose(jacobians[k, i], at_point[:3], atol=1e-12)


def point_masses(masses, places):
    """Return the ten parameters of point masses from their definition."""
    inertia = sum(
        m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, places, strict=True)
    )
    upper = [inertia[i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
    return np.array([masses.sum(), *(masses @ places), *upper])


@pytest.fixture
def cloud():
    rng = np.random.default_rng(0)
    return rng.uniform(0.1, 1.0, 6), rng.normal(size=(6, 3))


def test_pseudo_inertia_is_the_second_moment_of_homogeneous_coordinates(cloud):
    masses, places = cloud
    homogeneous = np.column_stack([places, np.ones(len(places))])
    expected = np.einsum('k,ki,kj->ij', masses, homogeneous, homogeneous)
    pi = point_masses(masses, places)
    np.testing.assert_allclose(pseudo_inertia(pi), expected, rtol=1e-12)
    pair = np.array([pi, 2.0 * pi])
    np.testing.assert_allclose(link_parameters(pseudo_inertia(pair)), pair, rtol=1e-12)


def test_mass_centre_and_moments_are_those_about_the_centre(cloud):
    masses, places = cloud
    center = masses @ places / masses.sum()
    found = Consistency.of('cloud', point_masses(masses, places))
    central = Consistency.of('cloud', point_masses(masses, places - center))
    np.testing.assert_allclose(found.center, center)
    np.testing.assert_allclose(found.moments, central.moments)
    assert found.consistent


def test_a_violated_triangle_inequality_is_no_body():
    """Moments 1, 1, 3 are positive, but no mass distribution has them."""
    found = Consistency.of('plate', [1.0, 0, 0, 0, 1.0, 0, 1.0, 0, 0, 3.0])
    assert not found.consistent
    assert found.moments[0] + found.moments[1] < found.moments[2]
