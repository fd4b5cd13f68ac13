# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The catalogue: every effect that can be simulated, estimated and named."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from armid_ros.effects.base import Effect
from armid_ros.effects.drive import RotorInertia
from armid_ros.effects.friction import (
    AsymmetricFriction,
    CoulombFriction,
    CoupledJointFriction,
    ViscousFriction,
)
from armid_ros.effects.gravity import BaseTilt, GravityMagnitude
from armid_ros.effects.load import Payload
from armid_ros.effects.sensing import TorqueOffset
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np

_EFFECTS: tuple[type[Effect], ...] = (
    ViscousFriction,
    CoulombFriction,
    AsymmetricFriction,
    CoupledJointFriction,
    TorqueOffset,
    RotorInertia,
    Payload,
    GravityMagnitude,
    BaseTilt,
)

CATALOGUE: Mapping[str, type[Effect]] = MappingProxyType({e.name: e for e in _EFFECTS})


def make_effect(text: str, robot: Robot) -> Effect:
    """
    Make an effect from its name, with joints where the default is not wanted.

    Parameters
    ----------
    text : str
        'viscous_friction', or with joints 'coupled_joint_friction@joint_5+joint_6'.
    robot : Robot
        The arm it acts on.

    Raises
    ------
    ModelError
        If the catalogue has no such effect or the robot no such joint; the message lists them.

    """
    name, _, joints = text.strip().partition('@')
    if name not in CATALOGUE:
        raise ModelError(f"no effect '{name}'; the catalogue has {', '.join(CATALOGUE)}")
    return CATALOGUE[name].on(robot, tuple(joints.split('+')) if joints else None)


def parse_effect(text: str, robot: Robot) -> tuple[Effect, FloatArray]:
    """
    Make an effect and its values from one line of text.

    Parameters
    ----------
    text : str
        'coulomb_friction:coulomb_torque=0.2', or 'payload@wrist:payload_m=0.3,payload_mz=0.01'.
        Every joint of the effect gets the values; what is not given is zero.
    robot : Robot
        The arm it acts on.

    Raises
    ------
    ModelError
        If effect, joint or quantity do not exist or a value is not a number.

    """
    head, _, assignments = text.partition(':')
    effect = make_effect(head, robot)
    known = [quantity.name for quantity in effect.quantities]
    values = np.zeros((len(effect.owners), len(known)))
    for assignment in filter(None, assignments.split(',')):
        key, _, number = assignment.partition('=')
        if key.strip() not in known:
            raise ModelError(f"{effect.name} has no '{key.strip()}'; it has {', '.join(known)}")
        try:
            values[:, known.index(key.strip())] = float(number)
        except ValueError:
            raise ModelError(
                f"{text}: '{number}' is not a number; write {effect.name}:{key.strip()}=0.1"
            ) from None
    return effect, values.ravel()
