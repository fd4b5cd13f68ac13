# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Estimators other than least squares.

Least squares takes the regressor as known, though it is computed from noisy positions.
Instrumental variables (``instruments``) correlate it with that of a simulated motion.

"""
