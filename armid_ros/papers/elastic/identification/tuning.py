# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Step 3b: fit of simulated velocity responses to the measured ones.

Nonlinear least squares in the logarithms of the parameters, so that all stay positive. The data
determine the sum of the viscous frictions of motor and link, dl + dm gear^2, but hardly their
ratio. A free ratio makes the fit diverge, and a fixed one biases the stiffness. The ratio
therefore has a prior with a standard deviation of a factor of two. Coulomb torques start from step
1 and are nuisance parameters. An arm at rest still vibrates: these initial vibrations are treated
as correlated noise of the velocities.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate
from armid_ros.identification.fitting.covariance import score_products, widened
from armid_ros.motion import ElasticRun, FloatArray
from armid_ros.papers.elastic.identification.response import (
    pack,
    parameter_names,
    ringing,
    sensitivities,
    SIZE,
    Steps,
    unpack,
    velocities,
)
from armid_ros.robots.two_link import TwoLinkParameters
from armid_ros.simulation.controller import VelocityLoop
import numpy as np
from scipy.optimize import least_squares

#: Places of dl and dm of both joints in the parameter vector, and of the Coulomb torques after it.
_LINK, _MOTOR = (7, 8), (9, 10)
#: Prior standard deviation of the logarithm of the friction ratio.
_SPLIT = np.log(2.0)
#: Standard deviations of the initial vibration: twist of the springs [rad] and velocity of the
#: links [rad/s], some tenths of a second after a step of 1 rad/s.
_RINGING = np.array([1e-5, 1e-5, 1e-3, 1e-3])


@dataclass(frozen=True, eq=False)
class Tuning:
    """
    Parameters tuned to closed-loop responses.

    Attributes
    ----------
    parameters : TwoLinkParameters
        The result.
    estimate : Estimate
        The thirteen values and their covariance, with the Coulomb torques as nuisance parameters.
    steps : Steps
        The experiments.
    measured, before, after : ndarray, shape (N, E, 4)
        Velocities of motors and links [rad/s], measured and simulated with the parameters at
        the start and at the end.

    """

    parameters: TwoLinkParameters
    estimate: Estimate
    steps: Steps
    measured: FloatArray
    before: FloatArray
    after: FloatArray

    @property
    def rms(self) -> tuple[float, float]:
        """Root mean squares of the residuals before and after tuning, noise included [rad/s]."""
        return (
            float(np.sqrt(np.mean((self.before - self.measured) ** 2))),
            float(np.sqrt(np.mean((self.after - self.measured) ** 2))),
        )


def tune(
    runs: Sequence[ElasticRun],
    start: TwoLinkParameters,
    loop: VelocityLoop,
) -> Tuning:
    """
    Tune the parameters to velocity responses under the loop that drove them.

    Parameters
    ----------
    runs : sequence of ElasticRun
        Measured responses to steps of the reference, from rest.
    start : TwoLinkParameters
        Initial parameters; the drives are not changed.
    loop : VelocityLoop
        Gains of the loop.

    Raises
    ------
    IdentificationError
        If the responses do not determine the factors.

    """
    steps = Steps.of(runs, loop)
    count = len(steps.reference)
    measured = np.stack(
        [np.hstack([run.motor.dq[:count], run.link.dq[:count]]) for run in runs], axis=1
    )
    base = np.concatenate([unpack(start), start.coulomb])
    # prior of the logarithms of factors, rows of unit standard deviation
    prior = np.zeros((4, SIZE + 2))
    prior[[0, 1], _LINK], prior[[0, 1], _MOTOR] = 1.0 / _SPLIT, -1.0 / _SPLIT
    # the standard deviation of the logarithms of the Coulomb torques is 0.1
    prior[[2, 3], [SIZE, SIZE + 1]] = 10.0
    weight = np.ones(measured.shape[-1])
    white = _Whitener.of(steps, start, weight)

    def arm(factors: FloatArray) -> TwoLinkParameters:
        values = base * np.exp(factors)
        return replace(pack(values[:SIZE], start), coulomb=values[SIZE:])

    def residual(factors: FloatArray) -> FloatArray:
        simulated = velocities(steps, arm(factors))
        left = white((simulated - measured)[..., np.newaxis] / weight[:, np.newaxis])
        return np.concatenate([left.ravel(), prior @ factors])

    def jacobian(factors: FloatArray) -> FloatArray:
        now = base * np.exp(factors)
        _, slopes = sensitivities(steps, arm(factors), np.diag(now))
        slopes = white(slopes / weight[:, np.newaxis])
        return np.vstack([slopes.reshape(-1, len(base)), prior])

    factors = np.zeros(len(base))
    for _ in range(3):  # from the second pass on, every sensor is weighted by its own noise
        fit = least_squares(
            residual, factors, jac=jacobian, method='trf', x_scale='jac', xtol=1e-9
        )
        factors = fit.x
        left = fit.fun[: -len(prior)].reshape(-1, len(weight)) * weight
        weight = np.sqrt(np.mean(left**2, axis=0)) + 1e-12
        white = _Whitener.of(steps, arm(factors), weight)
    after = arm(factors)
    found = unpack(after)
    rows, left = jacobian(factors), residual(factors)
    # residuals are correlated: sum the scores over the channels of a sample, without the prior
    white_noise, data = _covariance(rows), len(left) - len(prior)
    scores = (rows * left[:, np.newaxis])[:data].reshape(*measured.shape, -1).sum(axis=2)
    lags = max(1, count // 10)  # residuals are correlated over at most a tenth of an experiment
    middle = prior.T @ prior + score_products(list(scores.transpose(1, 0, 2)), lags)
    relative = widened(white_noise, white_noise, middle)[:SIZE, :SIZE]
    return Tuning(
        after,
        Estimate(parameter_names(runs[0].motor.joints), found, relative * np.outer(found, found)),
        steps,
        measured,
        velocities(steps, start),
        velocities(steps, after),
    )


@dataclass(frozen=True, eq=False)
class _Whitener:
    """Whitening of velocities for the initial vibrations of the arm."""

    shapes: FloatArray  # (E, 4, N C): orthonormal basis of the vibrations
    shares: FloatArray  # (E, 4): share of each that is removed

    @classmethod
    def of(cls, steps: Steps, parameters: TwoLinkParameters, weight: FloatArray) -> _Whitener:
        slopes = ringing(steps, parameters) * _RINGING / weight[:, np.newaxis]
        flat = np.moveaxis(slopes, 1, 0).reshape(slopes.shape[1], -1, slopes.shape[3])
        shapes, sizes, _ = np.linalg.svd(flat, full_matrices=False)
        return cls(shapes.transpose(0, 2, 1), 1.0 - 1.0 / np.sqrt(1.0 + sizes**2))

    def __call__(self, values: FloatArray) -> FloatArray:
        """Whiten values of shape (N, E, C, D)."""
        flat = np.moveaxis(values, 1, 0).reshape(values.shape[1], -1, values.shape[3])
        part = self.shares[..., np.newaxis] * (self.shapes @ flat)
        clean = flat - self.shapes.transpose(0, 2, 1) @ part
        count, experiments, channels, columns = values.shape
        clean = clean.reshape(experiments, count, channels, columns)
        return np.asarray(np.moveaxis(clean, 0, 1))


def _covariance(jacobian: FloatArray) -> FloatArray:
    """Return the covariance of the factors for residuals of unit variance."""
    scale = np.linalg.norm(jacobian, axis=0)
    if not np.all(scale > 0.0):
        raise IdentificationError(
            'the step responses do not depend on every parameter; do both joints move in them?'
        )
    _, sizes, rows = np.linalg.svd(jacobian / scale, full_matrices=False)
    if sizes[-1] < 1e-10 * sizes[0]:
        raise IdentificationError(
            'the step responses do not determine the parameters; add steps of both joints, in '
            'several poses'
        )
    half = rows.T / sizes
    return np.asarray(half @ half.T / np.outer(scale, scale))
