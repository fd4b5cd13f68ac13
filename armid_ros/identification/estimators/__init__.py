# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Estimators other than least squares.

Least squares takes the regressor as known, though it is computed from noisy positions.
Instrumental variables (``instruments``) correlate it with that of a simulated motion.

"""

from __future__ import annotations

from typing import get_args, Literal

Estimator = Literal['ols', 'wls', 'irls', 'iv']

#: All estimators.
ESTIMATORS: tuple[Estimator, ...] = get_args(Estimator)

#: Description of each estimator.
IN_WORDS: dict[Estimator, str] = {
    'ols': 'ordinary least squares',
    'wls': 'least squares weighted by the noise of each joint',
    'irls': 'least squares weighted by the noise of each joint, outliers weighted down',
    'iv': 'instrumental variables from a simulation of the arm',
}
