# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Convert ROS 2 messages to and from types of the package."""
