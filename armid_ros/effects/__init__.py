# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What acts on the joints of an arm beside its rigid body, one family a file."""

from armid_ros.effects.base import Action, DryFriction, Effect, Quantity
from armid_ros.effects.catalogue import CATALOGUE, make_effect, parse_effect

__all__ = [
    'CATALOGUE',
    'Action',
    'DryFriction',
    'Effect',
    'Quantity',
    'make_effect',
    'parse_effect',
]
