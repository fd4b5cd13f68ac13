# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What acts on the joints of an arm beside its rigid body, one family a file."""

from armid_ros.effects.action import (
    Action,
    Displacement,
    DryFriction,
    law_derivatives,
    TorqueLaw,
    Transmission,
)
from armid_ros.effects.base import Effect, Kind, Quantity, Shape
from armid_ros.effects.catalogue import CATALOGUE, make_effect, parse_effect
from armid_ros.effects.merge import merge_actions
from armid_ros.effects.readings import Displacing, TorqueReading
from armid_ros.effects.slipping import Hysteresis

__all__ = [
    'CATALOGUE',
    'make_effect',
    'parse_effect',
    'Effect',
    'Kind',
    'Quantity',
    'Shape',
    'Displacing',
    'TorqueReading',
    'Action',
    'Displacement',
    'DryFriction',
    'Hysteresis',
    'Transmission',
    'TorqueLaw',
    'law_derivatives',
    'merge_actions',
]
