# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Effects: physical causes of joint torque in addition to the rigid body.

A user-defined effect derives from ``Effect``. ``register`` adds it to the catalogue.
``joint_columns`` and ``scatter`` arrange the columns and values of an effect that acts on each
joint separately. ``armid_ros.arm.testing`` checks a user-defined class.

"""

from armid_ros.effects.action import (
    Action,
    Displacement,
    DryFriction,
    merge_actions,
    NO_FRICTION,
    TorqueLaw,
    Transmission,
)
from armid_ros.effects.base import Effect
from armid_ros.effects.catalogue import (
    CATALOGUE,
    make_effect,
    parse_effect,
    register,
    USUAL_EFFECTS,
)
from armid_ros.effects.joint_law import joint_columns, scatter
from armid_ros.effects.quantities import Quantity, Shape
from armid_ros.effects.readings import Displacing, TorqueReading
from armid_ros.effects.slipping import Hysteresis
from armid_ros.effects.traits import Traits

__all__ = [
    'CATALOGUE',
    'USUAL_EFFECTS',
    'register',
    'make_effect',
    'parse_effect',
    'Effect',
    'Quantity',
    'Shape',
    'Traits',
    'Displacing',
    'TorqueReading',
    'Action',
    'Displacement',
    'DryFriction',
    'NO_FRICTION',
    'Hysteresis',
    'Transmission',
    'TorqueLaw',
    'merge_actions',
    'joint_columns',
    'scatter',
]
