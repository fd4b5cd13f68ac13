# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the online identifier, and the identifier that they describe."""

from __future__ import annotations

from armid_ros.api.arguments import USUAL
from armid_ros.arm import ArmModel
from armid_ros.identification.online.identifier import OnlineIdentifier, OnlineSettings
from armid_ros.nodes.parameters.table import NodeParameter, Values
from armid_ros.robots import load_robot, parse_gravity, Robot, robot_from_urdf
import numpy as np

#: Parameters of nodes that can take the robot from robot_description.
ROBOT_PARAMETERS = (
    NodeParameter(
        'robot', '', 'A shipped robot, or a path; empty: the robot of robot_description.'
    ),
    NodeParameter(
        'gravity',
        'earth',
        'earth, moon, or x,y,z in the base frame [m/s^2]; that of the model where there is one.',
        check=parse_gravity,
    ),
    NodeParameter('joints', [''], 'Driven joints; if empty, all joints except those of grippers.'),
)
IDENTIFIER_PARAMETERS = (
    *ROBOT_PARAMETERS,
    NodeParameter(
        'effects',
        USUAL.split(','),
        'Effects to estimate with the rigid body, each as NAME[@joint+joint].',
    ),
    NodeParameter(
        'cutoff',
        5.0,
        'Cut-off of the low-pass filter of torque and regressor.',
        'Hz',
        limits=(0.01, 1000.0),
    ),
    NodeParameter(
        'forgetting',
        1.0,
        'Forgetting factor per used sample; 1: no forgetting.',
        limits=(0.9, 1.0),
        read_only=False,
    ),
    NodeParameter(
        'torque_noise',
        [0.0],
        'Standard deviation of a torque sample, one per joint; [0.0]: from the residuals.',
        'N m or N',
    ),
    NodeParameter(
        'max_gap',
        10,
        'Longest gap that is interpolated.',
        limits=(1, 1000),
        read_only=False,
    ),
    NodeParameter(
        'measured_velocity', False, 'Differentiate the measured velocity, not the position.'
    ),
    NodeParameter(
        'false_alarm_time',
        360000.0,
        'Mean time between false reports of a change; 0: no search for changes.',
        's',
        limits=(0.0, 1e9),
        read_only=False,
    ),
)


def robot_of(value: Values, description: str | None) -> Robot:
    """Return the robot of a URDF, or without a URDF the robot that parameters name."""
    given = {'gravity': value('gravity'), 'joints': value('joints') or None}
    if description is None:
        return load_robot(value('robot'), **given)
    return robot_from_urdf(description, **given)


def make_identifier(value: Values, description: str | None = None) -> OnlineIdentifier:
    """
    Make the identifier that parameters describe.

    Parameters
    ----------
    value : callable
        Returns the value of a parameter of `IDENTIFIER_PARAMETERS`.
    description : str, optional
        URDF that replaces the robot of the parameter.

    Raises
    ------
    ArmidError
        If robot, effects or settings are not valid or do not fit each other.

    """
    arm = ArmModel.of(robot_of(value, description), effects=value('effects'))
    return OnlineIdentifier(arm, settings_of(value, arm), rng=np.random.default_rng(0))


def settings_of(value: Values, arm: ArmModel) -> OnlineSettings:
    """Return the settings that parameters describe."""
    noise = tuple(value('torque_noise'))
    if len(noise) == 1:
        noise = noise * arm.robot.n_joints
    return OnlineSettings(
        cutoff=value('cutoff'),
        forgetting=value('forgetting'),
        torque_noise=noise if any(noise) else None,
        max_gap=value('max_gap'),
        measured_velocity=value('measured_velocity'),
        false_alarm_time=value('false_alarm_time') or None,
    )
