# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Estimators beside least squares, and all of them side by side.

Least squares takes the regressor as known, though it is computed from noisy positions. Instruments
(``instruments``) and closed-loop output errors (``output_error``) take simulated motion instead;
an extended Kalman filter (``kalman``) estimates motion and parameters together.

"""
