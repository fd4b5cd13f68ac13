# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The compiled steps are those of Python: the same body, the same run, the same errors."""

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.model import inverse_dynamics, regressor
from armid_ros.model.compiled import kernel, kernel_body
from armid_ros.motion import Motion
from armid_ros.robots import load_robot, robot_from_urdf
from armid_ros.simulation import ComputedTorque, Plant, Reference, simulate
from armid_ros.simulation.closed_loop import CompiledLoop
from armid_ros.simulation.controller import LinearFeedback
import numpy as np
import pinocchio as pin
import pytest

from tests.simulation.conftest import gravity_pd

pytestmark = pytest.mark.skipif(kernel() is None, reason='built without a compiler')

#: A tree of a turning, a sliding and two more turning joints on skew axes, in skew gravity.
TREE = """<robot name="tree"><link name="base"/>
{links}
{joints}
</robot>""".format(
    links='\n'.join(
        f'<link name="l{k}"><inertial><origin xyz="0.1 {0.02 * k} -0.05" rpy="0.3 0.2 {k}"/>'
        f'<mass value="{1 + k}"/><inertia ixx="0.03" ixy="0.002" ixz="0.001" iyy="0.04" '
        'iyz="-0.003" izz="0.05"/></inertial></link>'
        for k in range(4)
    ),
    joints='\n'.join(
        f'<joint name="j{k}" type="{kind}"><parent link="{parent}"/><child link="l{k}"/>'
        f'<origin xyz="0.2 -0.1 {0.1 * k}" rpy="0.5 {0.4 * k} -0.2"/><axis xyz="{axis}"/>'
        '<limit lower="-2" upper="2" effort="80" velocity="5"/></joint>'
        for k, (kind, parent, axis) in enumerate(
            [
                ('revolute', 'base', '0 0 1'),
                ('prismatic', 'l0', '0.6 0 0.8'),
                ('revolute', 'l1', '0 1 0'),
                ('revolute', 'l0', '0.36 0.48 0.8'),
            ]
        )
    ),
)
ROBOTS = ('humanoid_arm', 'two_link_elastic', TREE)


def robot(source):
    return robot_from_urdf(source) if source.startswith('<') else load_robot(source)


def with_effects(body, names):
    arm = ArmModel(body)
    for name in names:
        effect = make_effect(name, body)
        arm = arm.with_effect(effect, np.full(len(effect.parameters(body)), 0.05))
    return arm


def swinging(body, seconds=0.8):
    t = np.linspace(0.0, seconds, 33)
    rates = np.linspace(4.0, 9.0, body.n_joints)
    reach = np.minimum(0.3, 0.3 * body.velocity_limit / rates)
    shift = np.sin(np.outer(t, rates)) * reach
    return Reference(body.joints, t, body.middle_pose + shift)


def test_kernel_of_another_source_is_not_called(monkeypatch):
    monkeypatch.setattr('armid_ros.model._kernel.checksum', 0)
    assert kernel.__wrapped__() is None


@pytest.mark.parametrize('source', ROBOTS)
def test_body_is_that_of_pinocchio(source):
    body, rng = robot(source), np.random.default_rng(3)
    n = body.n_joints
    added = np.diag(rng.uniform(0.0, 0.1, n))
    data, structure = body.model.createData(), kernel_body(body, added)
    motion = Motion(body.joints, 0.1 * np.arange(20), *rng.uniform(-2.0, 2.0, (3, 20, n)))
    torques, regressors = inverse_dynamics(body, motion), regressor(body, motion)
    inertia = np.empty((n, n))
    for k, (q, dq, ddq) in enumerate(zip(motion.q, motion.dq, motion.ddq, strict=True)):
        exact = pin.rnea(body.model, data, q, dq, ddq)
        np.testing.assert_allclose(torques[k], exact, rtol=0, atol=1e-13 * np.abs(exact).max())
        exact = pin.computeJointTorqueRegressor(body.model, data, q, dq, ddq)
        np.testing.assert_allclose(regressors[k], exact, rtol=0, atol=1e-13 * np.abs(exact).max())
        kernel().inertia_matrix(structure.address, q.ctypes.data, inertia.ctypes.data)
        expected = pin.crba(body.model, data, q) + added
        np.testing.assert_allclose(inertia, expected, rtol=0, atol=1e-14 * expected.max())


@pytest.mark.parametrize('source', ROBOTS)
@pytest.mark.parametrize(
    ('names', 'stops'),
    [
        ((), False),
        (('viscous_friction', 'coulomb_friction', 'rotor_inertia'), True),
        (('coulomb_friction', 'quadratic_friction'), True),
    ],
)
@pytest.mark.parametrize('kind', [ComputedTorque, gravity_pd])
def test_run_is_that_of_python(source, names, stops, kind, monkeypatch):
    body = robot(source)
    plant = Plant(with_effects(body, names), hard_stops=stops)
    reference, controller = swinging(body), kind(ArmModel(body))
    assert CompiledLoop.of(plant, controller) is not None
    runs = [simulate(plant, reference, rng=np.random.default_rng(0), controller=controller)]
    monkeypatch.setattr(CompiledLoop, 'of', lambda *_: None)
    runs += [simulate(plant, reference, rng=np.random.default_rng(0), controller=controller)]
    fast, slow = (run.truth for run in runs)
    for name in ('q', 'dq', 'tau'):
        ours, theirs = getattr(fast, name), getattr(slow, name)
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12 * np.abs(theirs).max())


@pytest.mark.parametrize('error', [ZeroDivisionError, KeyboardInterrupt])
def test_what_a_torque_law_raises_ends_the_run(error):
    body = robot('humanoid_arm')
    plant = Plant(with_effects(body, ['stribeck_friction']))

    def broken(t, q, dq):
        raise error(f'at {float(t):g} s')

    object.__setattr__(plant, 'torque', broken)
    with pytest.raises(error, match=r'0\.0005 s'):
        simulate(plant, swinging(body), rng=np.random.default_rng(0))


def test_feedback_without_gravity_or_reference_is_a_spring():
    body = robot(TREE)
    n = body.n_joints
    law = LinearFeedback(body, np.eye(n), bandwidth=3.0, weighs=False, damping=2.0)
    q, desired = np.full(n, 0.1), (np.full(n, 0.3), np.ones(n), np.ones(n))
    pull = 9.0 * 0.2 * np.ones(n) + 6.0 * np.ones(n)
    inertia = pin.crba(body.model, body.model.createData(), q) + np.eye(n)
    tau = law.torque(q, np.zeros(n), desired, np.zeros(n))
    np.testing.assert_allclose(tau, inertia @ pull + 2.0, rtol=1e-12)
