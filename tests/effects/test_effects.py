# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The laws of effects with a closed form, their units, and which changes are possible."""

from dataclasses import replace

from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.effects import CATALOGUE, make_effect, Shape
from armid_ros.effects.base import Unexplained
from armid_ros.model import inverse_dynamics
from armid_ros.motion import Motion
from armid_ros.robots import load_robot, robot_from_urdf
import numpy as np
import pinocchio as pin
import pytest

from tests.serial_arm import serial_arm


def body(robot, motion, gravity=None, offset=0.0):
    """Return the rigid-body torque under another gravity, with encoders that are off."""
    robot = robot if gravity is None else robot.with_gravity(gravity)
    return inverse_dynamics(robot, replace(motion, q=motion.q + offset))


def only(columns, joints):
    """Return the torques of some joints; zero for the others."""
    torque = np.zeros((len(columns), 6))
    torque[:, joints] = columns
    return torque


def bumpers(robot, motion, below, above):
    """Return the torque of springs in the outer 15 % of the ranges."""
    margin = 0.15 * (robot.upper - robot.lower)
    low = np.minimum(motion.q - robot.lower - margin, 0.0)
    return below * low + above * np.maximum(motion.q - robot.upper + margin, 0.0)


#: Values of each effect, its shape, and the torque that they add to the rigid body.
LAWS = {
    'viscous_friction': (0.2, None, lambda r, m: 0.2 * m.dq),
    'coulomb_friction': (0.2, None, lambda r, m: 0.2 * np.sign(m.dq)),
    'quadratic_friction': (0.2, None, lambda r, m: 0.2 * m.dq * np.abs(m.dq)),
    # half the differences of Coulomb and viscous friction in both directions
    'asymmetric_friction': ([0.15, 0.1], None, lambda r, m: 0.15 + 0.1 * np.abs(m.dq)),
    'stribeck_friction': (
        0.4,
        [0.1, 2.0],
        lambda r, m: 0.4 * np.exp(-((m.dq / 0.1) ** 2)) * np.sign(m.dq),
    ),
    'load_dependent_friction': (
        0.1,
        None,
        lambda r, m: 0.1 * np.abs(body(r, m)) * np.sign(m.dq),
    ),
    'thermal_friction': (
        -0.2,
        [0.3],
        lambda r, m: -0.2 * (1.0 - np.exp(-m.t / 0.3))[:, None] * m.dq,
    ),
    'coupled_joint_friction': (
        [0.0, 0.0, 0.4],
        None,
        lambda r, m: only(0.4 * np.sign(m.dq[:, 4:].sum(axis=1, keepdims=True)), [4, 5]),
    ),
    'rotor_inertia': (0.07, None, lambda r, m: 0.07 * m.ddq),
    'gravity_magnitude': (
        1.62 - 9.81,
        None,
        lambda r, m: body(r, m, [0.0, 0.0, -1.62]) - body(r, m),
    ),
    'base_tilt': (
        [0.05, 0.0],
        None,
        lambda r, m: body(r, m, [0.0, -9.81 * np.sin(0.05), -9.81 * np.cos(0.05)]) - body(r, m),
    ),
    'torque_offset': (0.3, None, lambda r, m: np.full(m.q.shape, 0.3)),
    'torque_drift': (
        0.3,
        [0.2],
        lambda r, m: np.tile(0.3 * (1.0 - np.exp(-m.t / 0.2))[:, None], 6),
    ),
    'torque_gain': (-0.1, None, lambda r, m: -0.1 * body(r, m)),
    'torque_crosstalk@elbow_pitch+shoulder_pitch': (
        0.02,
        None,
        lambda r, m: only(0.02 * body(r, m)[:, [0]], [3]),
    ),
    'encoder_offset': (0.02, None, lambda r, m: body(r, m, offset=0.02) - body(r, m)),
    'joint_spring': ([4.0, -1.0], None, lambda r, m: 4.0 * m.q - 1.0),
    'soft_limit': ([50.0, 80.0], None, lambda r, m: bumpers(r, m, 50.0, 80.0)),
    'torque_ripple': (
        [0.1, 0.05],
        [12.0],
        lambda r, m: 0.1 * np.sin(12.0 * m.q) + 0.05 * np.cos(12.0 * m.q),
    ),
    'joint_coupling@elbow_pitch+shoulder_pitch': (
        2.0,
        None,
        lambda r, m: only(-2.0 * m.q[:, [3, 0]], [0, 3]),
    ),
}


@pytest.mark.parametrize('name', LAWS)
def test_the_torque_of_an_effect_is_its_law(robot, motion, added, name):
    values, shape, law = LAWS[name]
    torque = added(motion, name, values, shape)
    np.testing.assert_allclose(torque, law(robot, motion), atol=1e-11)


@pytest.mark.parametrize('seed', range(5))
def test_a_body_may_be_a_payload_and_one_lighter_about_its_axis_than_a_point_may_not(seed):
    rng = np.random.default_rng(seed)
    robot = load_robot('humanoid_arm')
    effect, arm = make_effect('payload', robot), ArmModel(robot)
    centre, thin = rng.uniform(0.05, 0.2, 3), rng.normal(size=(3, 3))
    inertia = pin.Inertia(rng.uniform(0.5, 5.0), centre, 1e-3 * thin @ thin.T)
    values = inertia.toDynamicParameters()
    std = np.full(10, 1e-6)
    assert effect.plausible(values, std, arm)
    nothing = np.concatenate([values[:4], 0.1 * values[4:]])
    assert not effect.plausible(nothing, std, arm)
    assert effect.plausible(nothing, np.abs(values), arm)


@pytest.mark.parametrize(('change', 'possible'), [(-6.7, False), (-1e-5, True), (6.7, True)])
def test_no_link_has_an_inertia_of_less_than_nothing(robot, change, possible):
    arm, effect = ArmModel(robot), CATALOGUE['link_inertia'].on(robot, ('elbow_pitch',))
    values, std = np.zeros(10), np.full(10, 1e-3)
    values[4] = change
    assert effect.plausible(values, std, arm) == possible
    hidden = np.where(np.arange(10) < 6, std, 0.0)  # Izz may stand for Ixx
    assert effect.plausible(values, hidden, arm)


@pytest.mark.parametrize(('shift', 'opposes'), [(0.4, True), (-0.4, True), (0.7, False)])
def test_friction_of_any_direction_opposes_the_motion(robot, shift, opposes):
    """A joint of 0.5 N m of friction is not pushed forwards by 0.2 N m of it."""
    arm = ArmModel(robot).with_effect(make_effect('coulomb_friction', robot), np.full(6, 0.5))
    effect = CATALOGUE['asymmetric_friction'].on(robot, ('elbow_pitch',))
    values, sure = np.array([shift, 0.0]), np.full(2, 0.01)
    assert effect.plausible(values, sure, arm) == opposes
    assert effect.plausible(values, 10.0 * sure, arm)
    assert effect.plausible(values, sure, ArmModel(robot))


@pytest.mark.parametrize(
    ('kind', 'order', 'reach'), [('revolute', 27.0, 1.5), ('prismatic', 628.0, 0.3)]
)
def test_the_search_begins_at_the_order_of_a_ripple(kind, order, reach):
    """The screw of a sliding joint has a turn every 10 mm."""
    robot = robot_from_urdf(serial_arm(f'axis {kind} 0,0,1 0,0,0'), gravity='earth')
    t = np.linspace(0.0, 20.0, 2001)
    q = (reach * np.sin(1.3 * t))[:, np.newaxis]
    rest = 0.4 * np.sin(order * q + 0.7) + np.random.default_rng(0).normal(size=q.shape)
    motion = Motion(robot.joints, t, q, 0.0 * q, 0.0 * q, rest)
    left = Unexplained(motion, q, rest, np.ones_like(q), np.empty((len(t), 1, 0)))
    (starts,) = make_effect('torque_ripple', robot).shape_starts(left, ArmModel(robot))
    assert np.min(np.abs(starts / order - 1.0)) < 0.01


@pytest.fixture
def scara():
    """Return a lift with two joints that turn on it."""
    turning = (f'{name} revolute 0,0,1 0.3,0,0' for name in ('shoulder', 'elbow'))
    return robot_from_urdf(serial_arm('lift prismatic 0,0,1 0,0,0', *turning))


@pytest.mark.parametrize(
    ('effect', 'units'),
    [
        ('rotor_inertia@lift', ['kg']),
        ('payload@lift', ['kg', *['kg m'] * 3, *['kg m^2'] * 6]),
        ('joint_coupling@lift+shoulder', ['N/rad']),
        ('joint_coupling@shoulder+lift', ['N/rad']),
        ('joint_coupling@shoulder+elbow', ['N m/rad']),
        ('torque_crosstalk@lift+shoulder', ['1/m']),
        ('torque_crosstalk@shoulder+lift', ['m']),
        ('torque_crosstalk@shoulder+elbow', ['']),
        ('coupled_joint_friction@lift+shoulder', ['kg m', 'N s/rad', 'N, N m']),
        ('coupled_joint_friction@shoulder+lift', ['kg m', 'N s/rad', 'N m, N']),
    ],
)
def test_units_are_those_of_joint_or_pair_in_a_file_as_well(scara, tmp_path, effect, units):
    made = make_effect(effect, scara)
    assert [name.unit for name in made.parameters(scara)] == units
    (tmp_path / 'scara.urdf').write_text(scara.urdf)
    arm = ArmModel(scara).with_effect(made, np.full(len(units), 0.1))
    save_model(tmp_path / 'model.yaml', arm, str(tmp_path / 'scara.urdf'))
    (again,) = load_model(tmp_path / 'model.yaml').effects
    assert again == made


TIME = Shape('time', 's', 0.1, 1e5, 600.0, (10.0, 60.0, 3000.0))
POWER = Shape('power', '', 0.3, 4.0, 2.0, (1.0, 2.0))
LAG = Shape('lag', 's', 0.0, 1.0, 0.0, (0.0, 0.001, 0.01))


@pytest.mark.parametrize(
    ('shape', 'value', 'half', 'expected'),
    [
        (TIME, 206.0, 40.0, True),
        (TIME, 206.0, 25000.0, False),
        (TIME, 206.0, np.inf, False),
        (LAG, 0.0, 0.002, True),
        (LAG, 0.0, 0.05, False),
        (POWER, 2.0, 3.0, False),
    ],
)
def test_a_shape_is_determined_where_its_interval_leaves_something_out(
    shape, value, half, expected
):
    assert shape.determined(value, half) is expected
