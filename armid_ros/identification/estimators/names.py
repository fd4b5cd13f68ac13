# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the estimators are called."""

from __future__ import annotations

from typing import get_args, Literal

from armid_ros.errors import IdentificationError
from armid_ros.identification.fitting.least_squares import Method

Estimator = Literal['ols', 'wls', 'irls', 'iv', 'cloe', 'ekf']

#: All estimators, in the order in which they are compared.
ESTIMATORS: tuple[Estimator, ...] = get_args(Estimator)

#: What each is, in words.
IN_WORDS: dict[Estimator, str] = {
    'ols': 'ordinary least squares',
    'wls': 'least squares weighted by the noise of each joint',
    'irls': 'least squares weighted by the noise of each joint, outliers weighted down',
    'iv': 'instrumental variables from a simulation of the arm',
    'cloe': 'closed-loop output error of a simulation of the arm',
    'ekf': 'extended Kalman filter of positions, velocities and parameters',
}


def least_squares_of(estimator: Estimator) -> Method:
    """Return the least squares that an estimator is, or starts from."""
    if estimator == 'ols' or estimator == 'wls' or estimator == 'irls':
        return estimator
    return 'wls'


def require_estimator(name: str, beside: str = '') -> None:
    """Raise an IdentificationError that lists the estimators, and what may stand beside them."""
    if name not in ESTIMATORS:
        raise IdentificationError(f"no method '{name}'; there are {', '.join(ESTIMATORS)}{beside}")


def estimators_of(text: str) -> tuple[Estimator, ...]:
    """
    Read 'all', or names with commas.

    Raises
    ------
    IdentificationError
        If there is no such estimator; the message lists those that there are.

    """
    if text == 'all':
        return ESTIMATORS
    asked = [name.strip() for name in text.split(',')]
    for name in asked:
        require_estimator(name, ', or all')
    return tuple(name for name in ESTIMATORS if name in asked)
