# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Elements that can hold a joint at rest: dry friction and joint stops."""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.effects import DryFriction, NO_FRICTION
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray
from armid_ros.simulation.box_complementarity import BoxLaw, REGULARISATION
import numpy as np


@dataclass(frozen=True, eq=False)
class Contacts:
    """
    Elements that can hold a joint at rest: dry friction and joint stops.

    Attributes
    ----------
    directions : ndarray, shape (m, n)
        Velocity of each element as a combination of the joint velocities.
    law : BoxLaw
        Bounds of the torques of the elements.
    axes : tuple of int, length m
        The joint that an element acts on alone; -1 if it acts on several.
    friction : DryFriction
        Dry friction without a load, if friction depends on the load.

    """

    directions: FloatArray
    law: BoxLaw
    axes: tuple[int, ...]
    friction: DryFriction | None = None

    @classmethod
    def of(cls, friction: DryFriction) -> Contacts:
        """Return the contacts of friction elements."""
        directions = friction.directions
        joints = [np.flatnonzero(direction).tolist() for direction in directions]
        axes = tuple(some[0] if len(some) == 1 else -1 for some in joints)
        independent = -1 not in axes and len(set(axes)) == len(axes)
        law = BoxLaw(friction.lower, friction.upper, 0.0 if independent else REGULARISATION)
        loaded = None if friction.load_share is None else friction
        return cls(directions, law, axes, loaded)

    def under(self, load: FloatArray) -> Contacts:
        """Return the contacts under a torque of the rigid body, shape (n,) [N m]."""
        if self.friction is None:
            return self
        more = self.friction.widening(load)
        return replace(self, law=BoxLaw(self.friction.lower - more, self.friction.upper + more))


def split_constant(friction: DryFriction | None, n_joints: int) -> tuple[DryFriction, FloatArray]:
    """Separate elements that cannot stick, because both levels are equal, as a constant torque."""
    if friction is None:
        return DryFriction(np.empty((0, n_joints)), np.empty(0), np.empty(0)), np.zeros(n_joints)
    span = friction.upper - friction.lower
    pushing = np.flatnonzero(span < -NO_FRICTION)
    if len(pushing):
        worst = int(pushing[0])
        joint = int(np.argmax(friction.directions[worst] != 0.0)) + 1  # noqa: RUF069 - directions of single joints are exact
        raise ModelError(
            f'dry friction of joint {joint} pushes: its torque forwards is less than backwards '
            f'({friction.upper[worst]:g} against {friction.lower[worst]:g} N m); friction torques '
            'have to be positive'
        )
    share = np.zeros(len(friction.lower)) if friction.load_share is None else friction.load_share
    constant = (span <= NO_FRICTION) & (np.abs(share) <= NO_FRICTION)
    first = np.argsort(np.argmax(friction.directions != 0.0, axis=1), kind='stable')  # noqa: RUF069 - directions of single joints are exact
    able = first[~constant[first]]  # in the order of the joints
    sticking = DryFriction(
        np.ascontiguousarray(friction.directions[able]),
        friction.lower[able],
        friction.upper[able],
        None if friction.load_share is None else share[able],
    )
    return sticking, np.asarray(friction.lower[constant] @ friction.directions[constant])
