# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm as lines from joint to joint, for drawings of arms without bodies."""

from __future__ import annotations

from armid_ros.motion import FloatArray
import numpy as np
import pinocchio as pin

#: The last body is drawn to this many times the distance of its centre of mass.
_BEYOND = 2.0


def sticks(model: pin.Model) -> list[tuple[int, FloatArray]]:
    """
    Return lines that begin at joints: index of the joint in the model, and the end in its frame.

    A line ends at a joint that the body carries; that of a last body beyond its centre of mass.
    Index 0 is the base.

    """
    lines = []
    for joint in range(model.njoints):
        carried = [k for k in range(1, model.njoints) if int(model.parents[k]) == joint]
        ends = [np.array(model.jointPlacements[k].translation) for k in carried]
        if joint and not ends:
            ends = [_BEYOND * np.array(model.inertias[joint].lever)]
        lines += [(joint, end) for end in ends]
    return lines
