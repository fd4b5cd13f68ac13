# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
An identified arm in the form of other programs: ``armid export``.

``dynamics`` writes the torque as code, ``loads`` the payload as the load data of four makers,
``ranges`` the parameters with their standard deviations, and ``sdf`` a model for Gazebo.

"""
