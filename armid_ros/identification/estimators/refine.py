# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From least squares to the estimator that was asked for."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError, IdentificationError
from armid_ros.identification.estimators.instruments import fit_by_instruments
from armid_ros.identification.estimators.kalman import fit_by_kalman_filter
from armid_ros.identification.estimators.names import Estimator, least_squares_of
from armid_ros.identification.estimators.output_error import fit_output_error
from armid_ros.identification.fitting.nonlinear import FittedValues, ungrouped
from armid_ros.identification.physical.fit_among_bodies import PhysicalSettings
from armid_ros.identification.physical.physical_fit import fit_to_bodies
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.recording import Recording
from armid_ros.simulation import Plant
import numpy as np


def refined(
    estimator: Estimator,
    arm: ArmModel,
    fit: FittedValues,
    recordings: Sequence[Recording],
    used: Conditioning,
    rng: np.random.Generator,
) -> tuple[FittedValues, tuple[str, ...]]:
    """
    Take a fit by least squares on to another estimator.

    Parameters
    ----------
    estimator : {'ols', 'wls', 'irls', 'iv', 'cloe', 'ekf'}
        What is asked for; least squares are as they are.
    arm : ArmModel
        The description.
    fit : FittedValues
        Least squares of the same data.
    recordings : sequence of Recording
        Training data.
    used : Conditioning
        Filters.
    rng : numpy.random.Generator
        Draws the states over which base parameters are found.

    Returns
    -------
    fit : FittedValues
        By that estimator.
    notes : tuple of str
        What a person should know of it.

    Raises
    ------
    IdentificationError
        If the estimator cannot be used on this arm; the message says why.

    """
    if estimator == least_squares_of(estimator):
        return fit, ()
    if arm.quasi_static:
        raise IdentificationError(
            f'{estimator} simulates the arm, and a quasi-static model has no inertia: use wls'
        )
    free = ungrouped(fit.arm, fit.base)
    if estimator == 'iv':
        return fit_by_instruments(fit, recordings, used, free)
    begin, notes = fit, tuple[str, ...]()
    if not _moves(fit.arm):
        begin, _ = fit_to_bodies(arm, fit, recordings, used, 'wls', PhysicalSettings(), rng)
        notes = (f'{estimator} began from a fit among bodies: that of wls cannot be simulated',)
    if estimator == 'ekf':
        found, said = fit_by_kalman_filter(begin.arm, fit, recordings, used, free)
    else:
        found, said = fit_output_error(begin, recordings, used, free)
    return found, (*notes, *said)


def _moves(arm: ArmModel) -> bool:
    """Tell whether an arm can be simulated where it begins; further on, its simulation tells."""
    try:
        Plant(arm)
    except ArmidError:
        return False
    return True
