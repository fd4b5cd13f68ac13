# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Names of the topics of arms that are measured on both sides of their transmissions."""

from __future__ import annotations

import re

#: Motors as seen at the joints, links, and what the loops are asked for.
MOTOR, LINK, REFERENCE = '/joint_states', '/link/joint_states', '/reference/joint_states'


def imu_topic(link: str) -> str:
    """Return the topic of the accelerometer on a link, whose name ROS may not take as it is."""
    name = re.sub('[^A-Za-z0-9_]', '_', link)
    return f'/{"_" if name[:1].isdigit() else ""}{name}/imu'
