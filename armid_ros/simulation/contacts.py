# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Elements that can hold a joint at rest, dry friction and joint stops, and their exact solution.

Over one step, the velocities of m elements are w = w_free - G f, with G symmetric and positive
semidefinite (the Delassus matrix times the step) and f the friction torques of the elements. Every
element obeys its law:

    w_i > 0 and f_i = upper_i,   or   w_i < 0 and f_i = lower_i,   or   w_i = 0 and f_i between.

Source: block principal pivoting with Murty's rule as its safeguard, Judice and Pires 1994.

"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from armid_ros.effects import DryFriction, NO_FRICTION
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray
import numpy as np
from scipy.linalg.lapack import dgesv

#: Mode of each element: 1 slips forwards, -1 slips backwards, 0 sticks.
Modes = tuple[int, ...]

#: Share of its diagonal that is added to G if G may be singular. Linearly dependent elements (two
#: joints and the sum of the two) make G singular. Their torques are then undetermined, their
#: velocities are not.
REGULARISATION = 1e-10

#: Tolerances of the law of an element: share of a bound, and velocity [rad/s or m/s].
TORQUE_TOLERANCE = 1e-12
SPEED_TOLERANCE = 1e-13


@dataclass(frozen=True, eq=False)
class BoxLaw:
    """
    The bounds of m friction elements.

    Attributes
    ----------
    lower, upper : ndarray, shape (m,)
        Torque while the element moves backwards, and forwards; lower < upper, infinite for an
        element that never slips.
    shift : float
        Share of its diagonal that is added to G; 0 if G is regular.

    """

    lower: FloatArray
    upper: FloatArray
    shift: float = REGULARISATION
    _limits: list[tuple[float, float]] = field(init=False, repr=False)
    _patterns: dict[Modes, _Pattern] = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Add the tolerance to the bounds."""
        lower = self.lower - TORQUE_TOLERANCE * np.abs(self.lower)
        upper = self.upper + TORQUE_TOLERANCE * np.abs(self.upper)
        object.__setattr__(self, '_limits', list(zip(lower.tolist(), upper.tolist(), strict=True)))

    def torques(self, g: FloatArray, w_free: FloatArray, modes: Modes) -> FloatArray:
        """
        Return the torques: the bounds of slipping elements, the solution of w = 0 for stuck ones.

        The same patterns of modes recur in many steps; the constants of each pattern are cached.

        """
        pattern = self._patterns.get(modes)
        if pattern is None:
            array = np.array(modes)
            stuck = array == 0
            pattern = self._patterns[modes] = _Pattern(
                np.where(stuck, 0.0, np.where(array > 0, self.upper, self.lower)),
                stuck * 1.0 if stuck.any() else None,
                stuck[:, np.newaxis] * (1.0 + self.shift * np.eye(len(modes))),
                np.diag(1.0 - stuck),
            )
        if pattern.stuck is None:
            return pattern.bound
        system = g * pattern.rows
        system += pattern.ones
        right = w_free * pattern.stuck
        right += pattern.bound
        return np.asarray(dgesv(system, right, 1, 1)[2])

    def violations(self, w: FloatArray, f: FloatArray, modes: Modes) -> list[tuple[int, int]]:
        """Return the elements that break their law, each with the mode to try next."""
        broken = []
        for element, (speed, torque, (lower, upper), mode) in enumerate(
            zip(w.tolist(), f.tolist(), self._limits, modes, strict=True)
        ):
            if mode:
                if speed * mode < -SPEED_TOLERANCE:
                    broken.append((element, 0))
            elif torque > upper:
                broken.append((element, 1))
            elif torque < lower:
                broken.append((element, -1))
        return broken


@dataclass(frozen=True, eq=False)
class _Pattern:
    """Constants of one pattern of modes: masks (m,), (m, m), and bounds of slipping elements."""

    bound: FloatArray
    stuck: FloatArray | None
    rows: FloatArray
    ones: FloatArray


def solve_box_complementarity(
    law: BoxLaw, g: FloatArray, w_free: FloatArray, modes: Modes
) -> tuple[FloatArray, Modes]:
    """
    Solve for the torques of the friction elements.

    Parameters
    ----------
    law : BoxLaw
        Bounds of the m elements.
    g : ndarray, shape (m, m)
        Change of velocity per torque.
    w_free : ndarray, shape (m,)
        Velocities at the end of the step without friction.
    modes : tuple of int, length m
        First guess, such as the modes of the last step, which are nearly always right.

    Returns
    -------
    torque : ndarray, shape (m,)
        f [N m], within its bounds.
    modes : tuple of int, length m
        Mode of each element.

    """
    f = law.torques(g, w_free, modes)
    for rounds in range(500):
        broken = law.violations(w_free - g.dot(f), f, modes)
        if not broken:
            break
        changed = list(modes)
        # A typical step needs one round, in which all elements that break their law change at
        # once. Some problems cycle; after 12 rounds only the first such element changes, which
        # always terminates.
        for element, mode in broken if rounds < 12 else broken[:1]:
            changed[element] = mode
        modes = tuple(changed)
        f = law.torques(g, w_free, modes)
    return f, modes


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
