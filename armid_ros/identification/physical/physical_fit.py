# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From the free fit of an arm to that among bodies, linearised again where it has to be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.estimate import Estimate
from armid_ros.identification.fitting.excited import bounds, excited
from armid_ros.identification.fitting.least_squares import Method, solve
from armid_ros.identification.fitting.nonlinear import agree, FittedValues, through, torques
from armid_ros.identification.physical.fit_among_bodies import fit_bodies, PhysicalSettings
from armid_ros.identification.physical.physical_certificate import PhysicalCertificate
from armid_ros.identification.rows.regression import regressions
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.recording import Recording
import numpy as np

#: Linearisations of a fit among bodies, each with the search for the weight of the prior.
_MOST_PASSES = 8


def fit_to_bodies(
    arm: ArmModel,
    free: FittedValues,
    recordings: Sequence[Recording],
    used: Conditioning,
    method: Method,
    settings: PhysicalSettings,
    rng: np.random.Generator,
) -> tuple[FittedValues, PhysicalCertificate]:
    """
    Fit bodies where a free fit has been.

    Parameters
    ----------
    arm : ArmModel
        Description: the prior of the links.
    free : FittedValues
        The fit without constraints.
    recordings : sequence of Recording
        Training data.
    used : Conditioning
        Filters.
    method : {'ols', 'wls', 'irls'}
        As of ``solve``.
    settings : PhysicalSettings
        What else is known.
    rng : numpy.random.Generator
        Draws the states over which base parameters are found.

    Returns
    -------
    fit : FittedValues
        With values that bodies have; its covariance is what the data alone say.
    certificate : PhysicalCertificate
        Why to believe it.

    """
    fit, certificate = _bodies(arm, free, settings)
    if free.passes == 1:
        return fit, certificate
    for passes in range(1, _MOST_PASSES):
        promised = tuple(part.torque(fit.values) for part in fit.problem)
        predicted = torques(fit.arm, recordings, used)
        fit = replace(fit, predicted=predicted, passes=free.passes + passes)
        settled = agree(fit.problem, fit.solution.weights, promised, predicted)
        if settled:
            return replace(fit, settled=free.settled), certificate
        # linearise about the fit in the parameters that are identifiable there, and solve
        theory = fit.arm.base_parameters(rng)
        columns = regressions(fit.arm, theory.independent, recordings, used)
        base, problem = excited(theory, columns)
        values = base.values(fit.arm.theta)
        problem = through(problem, fit.predicted, values)
        solution = solve(problem, method, bounds(fit.arm, base))
        fit = replace(fit, base=base, values=values, problem=problem, solution=solution)
        fit, certificate = _bodies(arm, fit, settings)
    predicted = torques(fit.arm, recordings, used)
    return replace(fit, predicted=predicted, settled=False), certificate


def _bodies(
    arm: ArmModel, fit: FittedValues, settings: PhysicalSettings
) -> tuple[FittedValues, PhysicalCertificate]:
    """Fit bodies to a linear problem."""
    base, solution = fit.base, fit.solution
    alone = Estimate(base.parameters, solution.values, solution.covariance)
    theta, certificate = fit_bodies(arm, base, fit.problem, solution.weights, alone, settings)
    values = base.values(theta)
    predicted = tuple(part.torque(values) for part in fit.problem)
    found = arm.with_theta(theta)
    return replace(fit, arm=found, values=values, predicted=predicted), certificate
