# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What can hold an arm at a standstill: dry friction, and the stops of its joints."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

from armid_ros.effects import DryFriction, NO_FRICTION
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray
from armid_ros.simulation.box_complementarity import BoxLaw, Modes, SPEED_TOLERANCE
import numpy as np
import numpy.typing as npt


class KnownModes(NamedTuple):
    """
    What is constant of a step as long as every element does what it does.

    Attributes
    ----------
    taken : ndarray, shape (n,)
        Joint torques that slipping elements take [N m].
    held : tuple of ndarray, of shapes (n,), (n, n) and (n, n), or None
        What takes joints that stick out of the system: 1 for joints that move, 1 where two of
        them meet, and a diagonal matrix with 1 for those that stick. None if none does.

    """

    taken: FloatArray
    held: tuple[FloatArray, FloatArray, FloatArray] | None


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
    own : bool
        Whether they are friction of one joint after the other, whatever its load, so that a joint
        whose element sticks stood still before.
    friction : DryFriction
        What they are without a load, where the load matters.

    """

    directions: FloatArray
    law: BoxLaw
    axes: tuple[int, ...]
    own: bool
    friction: DryFriction | None = None
    _patterns: dict[Modes, KnownModes] = field(init=False, repr=False, default_factory=dict)

    @classmethod
    def of(cls, friction: DryFriction) -> Contacts:
        """Return the contacts of friction elements."""
        directions = friction.directions
        joints = [np.flatnonzero(direction).tolist() for direction in directions]
        axes = tuple(some[0] if len(some) == 1 else -1 for some in joints)
        law = BoxLaw(friction.lower, friction.upper)
        loaded = None if friction.load_share is None else friction
        own = loaded is None and np.array_equal(directions, np.eye(directions.shape[1]))
        return cls(directions, law, axes, own, loaded)

    def pattern(self, modes: Modes) -> KnownModes | None:
        """
        Return what a step is made of in which all elements do what they do; None if not known.

        What sticks can be taken out of the system where it is a joint. Patterns of modes come
        back step after step, so they are kept.

        """
        found = self._patterns.get(modes)
        if found is None and (self.own or 0 not in modes):
            found = self._patterns[modes] = self._new_pattern(np.array(modes, dtype=int))
        return found

    def _new_pattern(self, modes: npt.NDArray[np.intp]) -> KnownModes:
        bound = np.where(modes > 0, self.law.upper, np.where(modes < 0, self.law.lower, 0.0))
        taken = np.asarray(bound @ self.directions)
        if modes.all():
            return KnownModes(taken, None)
        free = np.where(modes == 0, 0.0, 1.0)
        return KnownModes(taken, (free, np.outer(free, free), np.diag(1.0 - free)))

    def obeyed(self, dq: FloatArray, modes: Modes, taken: FloatArray | None) -> bool:
        """Tell whether elements obey their laws at joint velocities, (n,), torques where held."""
        if taken is not None:
            return not self.law.violations(dq, taken, modes)
        speeds = dq if self.own else self.directions.dot(dq)
        for speed, mode in zip(speeds.tolist(), modes, strict=True):
            if speed * mode < -SPEED_TOLERANCE:
                return False
        return True

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
    span = friction.upper - friction.lower
    pushing = np.flatnonzero(span < -NO_FRICTION)
    if len(pushing):
        worst = int(pushing[0])
        joint = int(np.argmax(friction.directions[worst] != 0.0)) + 1  # noqa: RUF069 - of joints, never computed
        raise ModelError(
            f'dry friction of joint {joint} pushes: its torque forwards is less than backwards '
            f'({friction.upper[worst]:g} against {friction.lower[worst]:g} N m); friction torques '
            'have to be positive'
        )
    share = np.zeros(len(friction.lower)) if friction.load_share is None else friction.load_share
    constant = (span <= NO_FRICTION) & (np.abs(share) <= NO_FRICTION)
    first = np.argsort(np.argmax(friction.directions != 0.0, axis=1), kind='stable')  # noqa: RUF069 - of joints, never computed
    able = first[~constant[first]]  # in the order of the joints, so that most are one a joint
    sticking = DryFriction(
        np.ascontiguousarray(friction.directions[able]),
        friction.lower[able],
        friction.upper[able],
        None if friction.load_share is None else share[able],
    )
    return sticking, np.asarray(friction.lower[constant] @ friction.directions[constant])
