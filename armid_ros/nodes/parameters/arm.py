# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the simulated arm."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.nodes.parameters.table import NodeParameter, setting, Values
from armid_ros.recording.columns import per_joint
from armid_ros.robots import parse_gravity
from armid_ros.simulation import Sensors

ARM_PARAMETERS = (
    NodeParameter('robot', 'humanoid_arm', 'A shipped robot, or the path of a URDF or xacro.'),
    NodeParameter(
        'gravity',
        '',
        'earth, moon, or x,y,z in the base frame; empty: that of the model, or earth [m/s^2].',
        check=lambda text: text and parse_gravity(text),
    ),
    NodeParameter('model', '', 'Path of a model.yaml; empty: the description and the effects.'),
    setting(
        'effects',
        [''],
        'Effects, each as NAME[@joint+joint]:quantity=value,quantity=value; a change applies to '
        'the moving arm.',
    ),
    NodeParameter(
        'start', '', 'Initial position q1,q2,...; empty: middle of the limits [rad or m].'
    ),
    *(
        setting(name, [0.0], f'{text}, one number or one per joint; 0: none.', unit)
        for name, text, unit in (
            ('torque_noise', 'Standard deviation of measured torques', 'N m or N'),
            ('position_noise', 'Standard deviation of measured positions', 'rad or m'),
            ('velocity_noise', 'Standard deviation of measured velocities', 'rad/s'),
            ('resolution', 'Step of the encoders', 'rad or m'),
        )
    ),
    NodeParameter(
        'torque_delay', 0, 'Delay of the torque measurement [time steps].', limits=(0, 100000)
    ),
    NodeParameter(
        'loop_gain', 1.0, 'Factor on the loop gains of elastic joints.', limits=(0.0, 10.0)
    ),
    NodeParameter('seed', 0, 'Random seed of the noise.', limits=(0, 2**62)),
    NodeParameter('time_step', 0.001, 'Time step of the integration.', 's', limits=(1e-5, 0.01)),
)


#: Parameters of the sensors that can be set while the arm moves, one number or one per joint.
SENSOR_PARAMETERS = ('torque_noise', 'position_noise', 'velocity_noise', 'resolution')


def sensors_of(value: Values, joints: Sequence[str]) -> Sensors:
    """
    Return sensors whose noise, resolution and delay are set by ROS parameters.

    Raises
    ------
    ArmidError
        If a parameter has neither one number nor one per joint, or a number is negative.

    """
    return Sensors(
        **{
            name: per_joint(value(name), joints, f"parameter '{name}'")
            for name in SENSOR_PARAMETERS
        },
        torque_delay=value('torque_delay'),
    )


def with_effects(arm: ArmModel, texts: Iterable[str]) -> ArmModel:
    """
    Add effects, each described by a text, to an arm model.

    Parameters
    ----------
    arm : ArmModel
        Arm model to which the effects are added.
    texts : iterable of str
        Each NAME[@joint+joint]:quantity=value,quantity=value; empty texts are ignored.

    Raises
    ------
    ArmidError
        If an effect or joint does not exist.

    """
    more = ArmModel.of(arm.robot, effects=tuple(filter(None, texts)))
    return replace(arm, effects=arm.effects + more.effects, values=arm.values + more.values)
