# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which unit torques are in, by the factor that they are too large."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.identification.rows.checks import TORQUE_UNITS
import numpy as np

#: A factor of torques is that of a unit if it is within this factor of it: masses of a description
#: are off by less.
NEAR = 1.5
#: Units of a force on a lever [1/(N m)], which all joints have at once: of one joint alone a load
#: makes the torque ten times as large.
_FORCE_UNITS = {'kgf m': 1.0 / 9.80665, 'kgf cm': 100.0 / 9.80665, 'lbf in': 1.0 / 0.1129848}
#: The same for those, which gains of currents are near to: 10 N m/A is 1.02 kgf m/A. Masses of a
#: description that are off make about as much of the factor of one joint.
_NEAR_FORCE = 1.2
_OF_JOINTS = {**TORQUE_UNITS, 'N m times 57.3 (degrees against radians)': float(np.rad2deg(1.0))}


def unit_of(factor: float, of_joints: Sequence[float] = ()) -> str:
    """
    Return the unit, or two, in which torques are that are so many times too large, or ''.

    Parameters
    ----------
    factor : float
        Of all joints together.
    of_joints : sequence of float
        Of single joints: a unit has to fit each of them, where the gains of currents differ.

    """
    fitting = [set(units_near(one)) for one in of_joints]
    return ' or '.join(u for u in units_near(factor) if all(u in units for units in fitting))


def units_near(factor: float, near_force: float = _NEAR_FORCE) -> dict[str, float]:
    """
    Return the factors of units that torques may be in, by their names, the nearest first.

    Parameters
    ----------
    factor : float
        By which torques are too large.
    near_force : float
        How far it may be from that of a unit of force on a lever, as a factor.

    """
    if factor <= 0.0:
        return {}
    known = {**_OF_JOINTS, **_FORCE_UNITS}
    off = {
        unit: abs(float(np.log(factor / per))) / float(np.log(near))
        for units, near in ((_OF_JOINTS, NEAR), (_FORCE_UNITS, near_force))
        for unit, per in units.items()
    }
    return {unit: known[unit] for unit in sorted(off, key=off.__getitem__) if off[unit] < 1.0}
