# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Exact solution of the linear complementarity problem of friction elements that stick or slip.

Over one step, the velocities of m elements are w = w_free - G f, with G symmetric and positive
semidefinite (the Delassus matrix times the step) and f the friction torques of the elements. Every
element obeys its law:

    w_i > 0 and f_i = upper_i,   or   w_i < 0 and f_i = lower_i,   or   w_i = 0 and f_i between.

Source: block principal pivoting with Murty's rule as its safeguard, Judice and Pires 1994.

"""

from __future__ import annotations

from dataclasses import dataclass, field

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

#: Rounds in which all elements that break their law change at once. A typical step needs one
#: round. Some problems cycle; after these rounds only the first such element changes, which always
#: terminates.
BLOCK_ROUNDS = 12
ROUNDS = 500


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
            pattern = self._patterns[modes] = _pattern(self, modes)
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
    for rounds in range(ROUNDS):
        broken = law.violations(w_free - g.dot(f), f, modes)
        if not broken:
            break
        changed = list(modes)
        for element, mode in broken if rounds < BLOCK_ROUNDS else broken[:1]:
            changed[element] = mode
        modes = tuple(changed)
        f = law.torques(g, w_free, modes)
    return f, modes


def _pattern(law: BoxLaw, modes: Modes) -> _Pattern:
    array = np.array(modes)
    stuck = array == 0
    bound = np.where(stuck, 0.0, np.where(array > 0, law.upper, law.lower))
    rows = stuck[:, np.newaxis] * (1.0 + law.shift * np.eye(len(modes)))
    return _Pattern(bound, stuck * 1.0 if stuck.any() else None, rows, np.diag(1.0 - stuck))
