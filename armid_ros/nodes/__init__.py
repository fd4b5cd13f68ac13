# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""ROS 2 nodes. No other package imports rclpy."""
