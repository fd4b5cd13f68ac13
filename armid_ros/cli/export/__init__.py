# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
An identified arm in the formats of other programs: ``armid export``.

The torque as code, the payload as load data, ranges of parameters, and a model for Gazebo.

"""
