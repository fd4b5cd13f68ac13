# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Identification without torque, from commanded and measured positions: ``armid positions``.

`LoopModel` simulates an arm under position control, and `fit_positions` fits it to recordings.

"""
