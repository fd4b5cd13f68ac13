# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How a joint moves its link: what kinematics need of it, and no motion changes."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray
import numpy as np
import pinocchio as pin


@dataclass(frozen=True, eq=False)
class JointGeometry:
    """
    A joint of one degree of freedom.

    Attributes
    ----------
    parent : int
        Number of the joint that moves the link it is on; -1 for the base.
    movers : tuple of int
        The joints that move its link, from the base on.
    slide, turn : ndarray, shape (3,)
        What it does to its link per unit, in the link's frame: translation and rotation.
    origin, sliding : ndarray, shape (3,)
        Where it is on the link before at zero [m], and where it slides per unit.
    turning : ndarray, shape (3, 3, 3)
        Rotation of the link on the link before: this times (1, sin q, 1 - cos q).

    """

    parent: int
    movers: tuple[int, ...]
    slide: FloatArray
    turn: FloatArray
    origin: FloatArray
    sliding: FloatArray
    turning: FloatArray

    @classmethod
    def of(cls, model: pin.Model, number: int) -> JointGeometry:
        """Look up a joint of a model."""
        joint, placement = model.joints[number + 1], model.jointPlacements[number + 1]
        data = joint.createData()
        joint.calc(data, np.zeros(joint.nq))
        motion = np.asarray(data.S).ravel()
        cross = pin.skew(motion[3:])
        rotation = np.array(placement.rotation)
        return cls(
            int(model.parents[number + 1]) - 1,
            tuple(int(above) - 1 for above in model.supports[number + 1] if above > 0),
            motion[:3],
            motion[3:],
            np.array(placement.translation),
            rotation @ motion[:3],
            np.stack([rotation, rotation @ cross, rotation @ cross @ cross], axis=2),
        )
