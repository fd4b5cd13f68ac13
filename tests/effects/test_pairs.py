# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Units of effects go with how their joints move, slide or turn."""

from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.effects import make_effect, Shape
from armid_ros.robots import robot_from_urdf
import numpy as np
import pytest

from tests.serial_arm import serial_arm


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
