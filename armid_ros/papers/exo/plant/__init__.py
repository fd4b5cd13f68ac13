# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The leg pair free to walk: gaits, ground, whole cycles, joints by their torque.

`walking_pair` hangs both bodies from their hips, `walkable` finds the nearest gait whose feet stay
where they stand, `gait_cycle` lets the pair walk it, `check_cycle` drives a joint by its torque.

"""
