# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
ROS 2 nodes: the only place that imports rclpy.

Each node is a thin adapter around an object of the packages below: parameters, topics, timers,
and one line of work. `lockstep` runs all five in one process, faster than real time.

"""
