# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the simulated arm, and the arm that they describe."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.arm.model_file import load_model
from armid_ros.errors import RobotError
from armid_ros.files import reading
from armid_ros.nodes.parameters.table import NodeParameter, Values
from armid_ros.recording.columns import numbers, per_joint
from armid_ros.robots import load_robot, parse_gravity
from armid_ros.robots.two_link import TwoLinkSet
from armid_ros.simulation import Sensors, SimulatedArm
from armid_ros.simulation.elastic import make_simulated_arm, shipped_arm
import numpy as np

ARM_PARAMETERS = (
    NodeParameter('robot', 'humanoid_arm', 'A shipped robot, or the path of a URDF or xacro.'),
    NodeParameter(
        'gravity',
        '',
        'earth, moon, or x,y,z in the base frame; empty: that of the model, or earth [m/s^2].',
        check=lambda text: text and parse_gravity(text),
    ),
    NodeParameter('model', '', 'Path of a model.yaml; empty: the description and the effects.'),
    NodeParameter(
        'effects',
        [''],
        'Effects, each as NAME[@joint+joint]:quantity=value,quantity=value; set on the running '
        'node, the arm continues with them.',
        read_only=False,
    ),
    NodeParameter(
        'start',
        '',
        'Initial position, as q1,q2,...; empty: middle of the position limits [rad or m].',
    ),
    *(
        NodeParameter(
            name, [0.0], f'{what}, one or one per joint; 0: none.', unit, read_only=False
        )
        for name, what, unit in (
            ('torque_noise', 'Standard deviation', 'N m or N'),
            ('position_noise', 'Standard deviation', 'rad or m'),
            ('velocity_noise', 'Standard deviation', 'rad/s'),
            ('resolution', 'Encoder step', 'rad or m'),
        )
    ),
    NodeParameter(
        'torque_delay', 0, 'Delay of the torque measurement in time steps.', limits=(0, 100000)
    ),
    NodeParameter(
        'loop_gain',
        1.0,
        'Factor on the gains of the velocity loops of elastic joints.',
        limits=(0.0, 10.0),
    ),
    NodeParameter('seed', 0, 'Random seed of the noise.', limits=(0, 2**62)),
    NodeParameter('time_step', 0.001, 'Time step of the integration.', 's', limits=(1e-5, 0.01)),
)


#: Parameters of the sensors that can be set while the arm moves, one number or one per joint.
SENSOR_PARAMETERS = ('torque_noise', 'position_noise', 'velocity_noise', 'resolution')


def make_arm(
    value: Values, arm: ArmModel, drives: TwoLinkSet | None, warn: Callable[[str], object]
) -> SimulatedArm:
    """
    Make the simulated arm from parameters, with elastic joints if any.

    Parameters
    ----------
    value : callable
        Returns the value of a parameter of `ARM_PARAMETERS`.
    arm, drives : ArmModel, and TwoLinkSet or None
        Result of `described_arm`.
    warn : callable
        Called with texts on parts of the model that cannot be simulated.

    Raises
    ------
    ArmidError
        If robot, model, effects or sensors are not valid or do not fit each other.

    """
    arm = with_effects(arm, value('effects'))
    n = arm.robot.n_joints
    with reading("parameter 'start'", RobotError):
        start = numbers(value('start'))
        if start and len(start) != n:
            raise RobotError(f'it has {len(start)} numbers, but there are {n} joints')
    return make_simulated_arm(
        arm,
        rng=np.random.default_rng(value('seed')),
        warn=warn,
        drives=drives,
        gain=value('loop_gain'),
        dt=value('time_step'),
        sensors=sensors_of(value, arm.robot.joints),
        start=start or None,
    )


def sensors_of(value: Values, joints: Sequence[str]) -> Sensors:
    """
    Return the sensors that parameters describe.

    Raises
    ------
    ArmidError
        If the count of numbers differs from that of the joints, or a number is negative.

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
    Return an arm model with effects added.

    Parameters
    ----------
    arm : ArmModel
        Arm model without the effects.
    texts : iterable of str
        Each NAME[@joint+joint]:quantity=value,quantity=value; empty texts are ignored.

    Raises
    ------
    ArmidError
        If an effect or joint does not exist.

    """
    more = ArmModel.of(arm.robot, effects=tuple(filter(None, texts)))
    return replace(arm, effects=arm.effects + more.effects, values=arm.values + more.values)


def described_arm(value: Values) -> tuple[ArmModel, TwoLinkSet | None]:
    """Return the arm of the parameters without `effects`, and its drives if shipped."""
    gravity, drives = value('gravity'), None
    if value('model'):
        arm = load_model(value('model'))
        if gravity:
            arm = replace(arm, robot=arm.robot.with_gravity(parse_gravity(gravity)))
    else:
        arm, drives = shipped_arm(load_robot(value('robot'), gravity=gravity or 'earth'))
    return arm, drives
