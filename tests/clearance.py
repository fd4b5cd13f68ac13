# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The clearance of poses by measuring all pairs of bodies, without bounds or intervals."""

import numpy as np
import pinocchio as pin


def path_clearance(collision, q):
    """Return the smallest distance in each pose, q of shape (N, n), infinite without pairs [m]."""
    model, geometry = collision.robot.model, collision.geometry
    smallest = np.full(len(q), np.inf)
    if len(geometry.collisionPairs):
        data, placed = model.createData(), geometry.createData()
        for sample, pose in enumerate(q):
            closest = pin.computeDistances(model, data, geometry, placed, pose)
            smallest[sample] = placed.distanceResults[closest].min_distance
    return smallest
