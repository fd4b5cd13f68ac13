# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Simulation of an exoskeleton and its wearer: gait, ground contact and torque-driven joints.

`walking_pair` gives both bodies floating hips. `walkable` finds the nearest gait without
slipping feet. `gait_cycle` simulates the pair with this gait. `check_cycle` drives a joint by its
torque.

"""
