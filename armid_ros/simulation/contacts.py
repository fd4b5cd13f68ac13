# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Dry friction and joint stops as complementarity conditions, solved exactly.

An element is a source of dry friction, or a joint stop. It can hold a joint at rest. Over one
step, the velocities of m elements are w = w_free - G f. G is symmetric and positive semidefinite:
the Delassus matrix times the step. The torque f_i of an element is upper_i for w_i > 0, lower_i
for w_i < 0, and between them for w_i = 0.

Source: block principal pivoting with Murty's rule as its safeguard, Judice and Pires 1994.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

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

#: Tolerances of the friction law of an element: share of a bound, velocity [rad/s or m/s].
TORQUE_TOLERANCE = 1e-12
SPEED_TOLERANCE = 1e-13


def solve_box_complementarity(
    lower: FloatArray,
    upper: FloatArray,
    g: FloatArray,
    w_free: FloatArray,
    modes: Modes,
    shift: float = REGULARISATION,
) -> tuple[FloatArray, Modes]:
    """
    Solve the complementarity problem of dry friction for the torques and modes of all elements.

    Parameters
    ----------
    lower, upper : ndarray, shape (m,)
        Torque while an element moves backwards, and forwards; lower < upper, infinite for an
        element that never slips [N m].
    g : ndarray, shape (m, m)
        Change of velocity per torque.
    w_free : ndarray, shape (m,)
        Velocities at the end of the step without friction.
    modes : tuple of int, length m
        First guess, such as the modes of the last step, which are nearly always right.
    shift : float
        Share of its diagonal that is added to G; 0 if G is regular.

    Returns
    -------
    torque : ndarray, shape (m,)
        f [N m], within its bounds.
    modes : tuple of int, length m
        Mode of each element.

    """
    low, high, found = lower.tolist(), upper.tolist(), list(modes)
    f = np.zeros(len(modes))
    for rounds in range(500):
        # the bounds of slipping elements, and the solution of w = 0 for stuck elements
        f = np.array(
            [(0.0, *bounds)[mode] for mode, *bounds in zip(found, high, low, strict=True)]
        )
        stuck = [k for k, mode in enumerate(found) if mode == 0]
        if stuck:
            system = np.eye(len(modes))
            for k in stuck:
                system[k], f[k] = g[k], w_free[k]
                system[k, k] *= 1.0 + shift
            f = np.asarray(dgesv(system, f, 1, 1)[2])
        # elements that violate their condition, each with its next mode
        broken = []
        speeds = (w_free - g.dot(f)).tolist()
        for k, (speed, torque) in enumerate(zip(speeds, f.tolist(), strict=True)):
            if found[k] and speed * found[k] < -SPEED_TOLERANCE:
                broken.append((k, 0))
            elif found[k] == 0 and torque > high[k] + TORQUE_TOLERANCE * abs(high[k]):
                broken.append((k, 1))
            elif found[k] == 0 and torque < low[k] - TORQUE_TOLERANCE * abs(low[k]):
                broken.append((k, -1))
        if not broken:
            break
        # A typical step needs one iteration, in which all violating elements change together.
        # Some problems cycle: after 12 iterations only the first such element changes, which
        # always terminates.
        for k, mode in broken if rounds < 12 else broken[:1]:
            found[k] = mode
    return f, tuple(found)


@dataclass(frozen=True, eq=False)
class Contacts:
    """
    Elements that can hold a joint at rest: dry friction and joint stops.

    Attributes
    ----------
    directions : ndarray, shape (m, n)
        Velocity of each element as a combination of the joint velocities.
    lower, upper : ndarray, shape (m,)
        Bounds of the torques of the elements [N m].
    axes : tuple of int, length m
        The joint that an element acts on alone; -1 if it acts on several.
    of_single_joints : bool
        Whether every element acts on one joint, and no two elements on the same joint.
    friction : DryFriction
        Dry friction without a load, if friction depends on the load.

    """

    directions: FloatArray
    lower: FloatArray
    upper: FloatArray
    axes: tuple[int, ...]
    of_single_joints: bool
    friction: DryFriction | None = None

    @classmethod
    def of(cls, friction: DryFriction) -> Contacts:
        """Return the contacts of friction elements; a stop is an element of infinite friction."""
        joints = [np.flatnonzero(direction).tolist() for direction in friction.directions]
        axes = tuple(some[0] if len(some) == 1 else -1 for some in joints)
        loaded = None if friction.load_share is None else friction
        single = -1 not in axes and len(set(axes)) == len(axes)
        return cls(friction.directions, friction.lower, friction.upper, axes, single, loaded)

    def with_load(self, load: FloatArray) -> Contacts:
        """Return the contacts with friction levels widened by a rigid-body torque, (n,) [N m]."""
        if self.friction is None:
            return self
        more = self.friction.widening(load)
        return replace(self, lower=self.friction.lower - more, upper=self.friction.upper + more)

    def torques(self, g: FloatArray, w_free: FloatArray, modes: Modes) -> tuple[FloatArray, Modes]:
        """Return torques (m,) and modes of the elements, from `solve_box_complementarity`."""
        regular = self.friction is None and self.of_single_joints
        shift = 0.0 if regular else REGULARISATION
        return solve_box_complementarity(self.lower, self.upper, g, w_free, modes, shift)


def split_constant(friction: DryFriction | None, n_joints: int) -> tuple[DryFriction, FloatArray]:
    """Split friction into elements that can stick, and the sum of constant torques, (n,) [N m]."""
    if friction is None:
        return DryFriction(np.empty((0, n_joints)), np.empty(0), np.empty(0)), np.zeros(n_joints)
    span = friction.upper - friction.lower
    pushing = np.flatnonzero(span < -NO_FRICTION)
    if len(pushing):
        worst = int(pushing[0])
        joint = int(np.argmax(friction.directions[worst] != 0.0)) + 1  # noqa: RUF069 - directions of single joints are exact
        raise ModelError(
            f'dry friction of joint {joint} is negative: its upper limit, '
            f'{friction.upper[worst]:g} N m, is below its lower limit, '
            f'{friction.lower[worst]:g} N m; its Coulomb friction has to be positive'
        )
    share = np.zeros(len(friction.lower)) if friction.load_share is None else friction.load_share
    constant = (span <= NO_FRICTION) & (np.abs(share) <= NO_FRICTION)
    first = np.argsort(np.argmax(friction.directions != 0.0, axis=1), kind='stable')  # noqa: RUF069 - directions of single joints are exact
    able = first[~constant[first]]  # sorted by joint
    sticking = DryFriction(
        np.ascontiguousarray(friction.directions[able]),
        friction.lower[able],
        friction.upper[able],
        None if friction.load_share is None else share[able],
    )
    return sticking, np.asarray(friction.lower[constant] @ friction.directions[constant])
