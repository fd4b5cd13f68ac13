# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Digest that identifies the robot of a description, wherever its file is."""

from __future__ import annotations

import hashlib

from armid_ros.robots import Robot
import numpy as np


def kinematics_digest(robot: Robot) -> str:
    """
    Return a digest of the joints of a description, in hexadecimal.

    The digest covers names, kinds, axes and placements of joints, and names of links, to a
    micrometre. It does not cover masses and gravity, which may be corrected later.

    """
    digest = hashlib.sha256()
    model = robot.model
    for index, (joint, link) in enumerate(zip(robot.joints, robot.links, strict=True), start=1):
        place = model.jointPlacements[index]
        numbers = np.concatenate([place.rotation.ravel(), place.translation])
        rounded = np.round(numbers, 6) + 0.0  # no negative zero
        kind = model.joints[index].shortname()
        parts = (
            joint,
            link,
            kind,
            str(model.parents[index]),
            ' '.join(f'{x:.6f}' for x in rounded),
        )
        digest.update('\n'.join(parts).encode())
    return digest.hexdigest()[:16]
