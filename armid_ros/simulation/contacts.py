# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What can hold an arm at a standstill: dry friction, and the stops of its joints."""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.effects import DryFriction
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray
from armid_ros.simulation.box_complementarity import BoxLaw
import numpy as np


@dataclass(frozen=True, eq=False)
class Contacts:
    """
    Elements that can hold: dry friction, and joint stops.

    Attributes
    ----------
    directions : ndarray, shape (m, n)
        Velocity of each element as a combination of the joint velocities.
    law : BoxLaw
        What torques they take.
    axes : tuple of int, length m
        The joint that an element acts on alone; -1 if it acts on several.
    friction : DryFriction
        What they are without a load, where the load matters.

    """

    directions: FloatArray
    law: BoxLaw
    axes: tuple[int, ...]
    friction: DryFriction | None = None

    @classmethod
    def of(cls, friction: DryFriction) -> Contacts:
        """Return the contacts of friction elements."""
        axes = tuple(_axis(direction) for direction in friction.directions)
        law = BoxLaw(friction.lower, friction.upper)
        loaded = None if friction.load_share is None else friction
        return cls(friction.directions, law, axes, loaded)

    def under(self, load: FloatArray) -> Contacts:
        """Return the contacts as they are under a torque of the rigid body, shape (n,) [N m]."""
        if self.friction is None:
            return self
        more = self.friction.widening(load)
        return replace(self, law=BoxLaw(self.friction.lower - more, self.friction.upper + more))


def split_constant(friction: DryFriction | None, n_joints: int) -> tuple[DryFriction, FloatArray]:
    """Part the elements that cannot stick, whose levels are one constant torque, from the rest."""
    if friction is None:
        return DryFriction(np.empty((0, n_joints)), np.empty(0), np.empty(0)), np.zeros(n_joints)
    if np.any(friction.lower > friction.upper):
        raise ModelError(
            'dry friction that pushes: the torque of an element forwards is less than backwards '
            f'({friction.upper} against {friction.lower}); friction torques have to be positive'
        )
    share = np.zeros(len(friction.lower)) if friction.load_share is None else friction.load_share
    constant = (friction.lower == friction.upper) & (share == 0.0)
    sticking = DryFriction(
        np.ascontiguousarray(friction.directions[~constant]),
        friction.lower[~constant],
        friction.upper[~constant],
        None if friction.load_share is None else share[~constant],
    )
    return sticking, np.asarray(friction.lower[constant] @ friction.directions[constant])


def _axis(direction: FloatArray) -> int:
    """Return the joint that an element acts on alone, -1 if it acts on several."""
    joints = np.flatnonzero(direction)
    return int(joints[0]) if len(joints) == 1 else -1
