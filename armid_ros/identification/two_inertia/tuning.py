# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Step 3b: the parameters that make simulated velocity responses the measured ones.

Nonlinear least squares in the logarithms of the parameters, which keeps them positive and makes
every one a scale factor. The viscous frictions of motor and link of a joint are tied: a rigid
motion shows their sum, dl + dm gear^2, alone, and what a vibration shows of their difference is
far below its noise (free, their standard deviations are 10 to 40 % where that of the sum is 1 %;
with ten times the noise the fit then runs away). They share one factor, so the split of the
start stays.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate
from armid_ros.identification.two_inertia.names import pack, parameter_names, SIZE, unpack
from armid_ros.identification.two_inertia.response import sensitivities, Steps, velocities
from armid_ros.motion import FloatArray
from armid_ros.robots.two_link import TwoLinkParameters
from armid_ros.simulation.elastic_run import ElasticRun, VelocityLoop
import numpy as np
from scipy.optimize import least_squares

#: Places of dl and dm of both joints in the parameter vector.
_LINK, _MOTOR = (7, 8), (9, 10)


@dataclass(frozen=True, eq=False)
class Tuning:
    """
    Parameters tuned to closed-loop responses.

    Attributes
    ----------
    parameters : TwoLinkParameters
        The result.
    estimate : Estimate
        The thirteen values, and their covariance as if none of them were tied: the split of
        friction that tying keeps is not known any better for it.
    steps : Steps
        The experiments.
    measured, before, after : ndarray, shape (N, E, 4)
        Velocities of motors and links [rad/s], measured and simulated with the parameters at
        the start and at the end.
    evaluations : int
        Simulations of all experiments with derivatives.

    """

    parameters: TwoLinkParameters
    estimate: Estimate
    steps: Steps
    measured: FloatArray
    before: FloatArray
    after: FloatArray
    evaluations: int

    @property
    def rms(self) -> tuple[float, float]:
        """Root mean square of what is not explained before and after, noise included [rad/s]."""
        return (
            float(np.sqrt(np.mean((self.before - self.measured) ** 2))),
            float(np.sqrt(np.mean((self.after - self.measured) ** 2))),
        )


def tying(tied: bool = True) -> FloatArray:
    """Return which factor each of the thirteen parameters has, as a matrix (13, factors)."""
    ties = np.eye(SIZE)
    if tied:
        for link, motor in zip(_LINK, _MOTOR, strict=True):
            ties[motor, link] = 1.0
        ties = np.delete(ties, _MOTOR, axis=1)
    return ties


def tune(
    runs: Sequence[ElasticRun],
    start: TwoLinkParameters,
    loop: VelocityLoop,
    *,
    tied: bool = True,
    links_only: bool = False,
) -> Tuning:
    """
    Tune the parameters to velocity responses under the loop that drove them.

    Parameters
    ----------
    runs : sequence of ElasticRun
        Measured responses to steps of the reference, from rest.
    start : TwoLinkParameters
        Where to begin; its Coulomb friction and drives stay.
    loop : VelocityLoop
        Gains of the loop.
    tied : bool
        Whether dl and dm of a joint share a factor.
    links_only : bool
        Whether the velocities of the motors are left out.

    Raises
    ------
    IdentificationError
        If there are no runs, or the responses do not determine the factors.

    """
    if not runs:
        raise IdentificationError('tuning needs step responses, and there are none')
    steps = Steps.of(runs, loop)
    count = len(steps.reference)
    measured = np.stack(
        [np.hstack([run.motor.dq[:count], run.link.dq[:count]]) for run in runs], axis=1
    )
    chosen = slice(2, 4) if links_only else slice(0, 4)
    base, ties = unpack(start), tying(tied)
    weight = np.ones(measured[:, :, chosen].shape[-1])

    def values(factors: FloatArray) -> FloatArray:
        return np.asarray(base * np.exp(ties @ factors))

    def residual(factors: FloatArray) -> FloatArray:
        simulated = velocities(steps, pack(values(factors), start))
        return np.asarray(((simulated - measured)[:, :, chosen] / weight).ravel())

    def jacobian(factors: FloatArray) -> FloatArray:
        now = values(factors)
        _, slopes = sensitivities(steps, pack(now, start), (ties * now[:, np.newaxis]).T)
        slopes = slopes[:, :, chosen] / weight[:, np.newaxis]
        return np.asarray(slopes.reshape(-1, ties.shape[1]))

    factors, evaluations = np.zeros(ties.shape[1]), 0
    for _ in range(2):  # the second time every sensor counts by its own noise
        fit = least_squares(
            residual, factors, jac=jacobian, method='trf', x_scale='jac', xtol=1e-9
        )
        factors, evaluations = fit.x, evaluations + fit.njev
        left = fit.fun.reshape(-1, len(weight)) * weight
        weight = np.sqrt(np.mean(left**2, axis=0)) + 1e-12
    found = values(factors)
    free = sensitivities(steps, pack(found, start), np.diag(found))[1][:, :, chosen]
    relative = _covariance((free / weight[:, np.newaxis]).reshape(-1, SIZE))
    covariance = relative * np.outer(found, found)
    after = pack(found, start)
    return Tuning(
        after,
        Estimate(parameter_names(runs[0].motor.joints), found, covariance),
        steps,
        measured,
        velocities(steps, start),
        velocities(steps, after),
        evaluations,
    )


def _covariance(jacobian: FloatArray) -> FloatArray:
    """Return the covariance of the factors where the residuals have unit variance."""
    scale = np.linalg.norm(jacobian, axis=0)
    if np.any(scale == 0.0):
        raise IdentificationError(
            'the step responses do not depend on every parameter; do both joints move in them?'
        )
    _, sizes, rows = np.linalg.svd(jacobian / scale, full_matrices=False)
    if sizes[-1] < 1e-10 * sizes[0]:
        raise IdentificationError(
            'the step responses do not tell the parameters apart; add steps of both joints, in '
            'several poses'
        )
    half = rows.T / sizes
    return np.asarray(half @ half.T / np.outer(scale, scale))
