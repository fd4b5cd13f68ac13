# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Identification from commanded and measured positions, without torque: ``armid positions``.

`LoopModel` simulates an arm under position control, and `fit_positions` fits it to recordings.

"""
