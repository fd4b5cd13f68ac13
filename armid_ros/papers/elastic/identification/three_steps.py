# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
All three steps of the identification of a two-link arm, and the tuning (step 3b).

Step 3b fits simulated velocity responses to the measured ones: nonlinear least squares in the
logarithms of the parameters, which are therefore positive. The data determine the sum of viscous
friction of motor and link, dl + dm gear^2, but hardly the ratio. With a free ratio the fit
diverges; a fixed ratio biases the stiffness. The ratio therefore has a prior with a standard
deviation of a factor of two. Coulomb torques start from step 1 and are nuisance parameters. The
arm is at rest before a step.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate
from armid_ros.identification.fitting.covariance import score_products, widened
from armid_ros.motion import ElasticRun, FloatArray
from armid_ros.papers.elastic.identification.interaction import (
    fit_joints,
    HOLD,
    joint_signals,
    measured_response,
    ORDER,
)
from armid_ros.papers.elastic.identification.response import (
    pack,
    parameter_names,
    sensitivities,
    SIZE,
    Steps,
    unpack,
    velocities,
)
from armid_ros.papers.elastic.identification.rigid import fit_rigid, RigidFit
from armid_ros.papers.elastic.identification.subspace import identify_subspace, StateSpace
from armid_ros.robots.two_link import TwoLinkParameters
from armid_ros.simulation.controller import VelocityLoop
import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares


@dataclass(frozen=True, eq=False)
class Tuning:
    """
    Parameters fitted to closed-loop step responses, and the simulated responses.

    Attributes
    ----------
    parameters : TwoLinkParameters
        Tuned parameters.
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
        """RMS velocity residuals before and after tuning, noise included [rad/s]."""
        return (
            float(np.sqrt(np.mean((self.before - self.measured) ** 2))),
            float(np.sqrt(np.mean((self.after - self.measured) ** 2))),
        )


def tune(runs: Sequence[ElasticRun], start: TwoLinkParameters, loop: VelocityLoop) -> Tuning:
    """
    Fit the parameters of a two-link arm to step responses under velocity control.

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
        If the responses do not determine the parameters.

    """
    steps = Steps.of(runs, loop)
    count = len(steps.reference)
    measured = np.stack(
        [np.hstack([run.motor.dq[:count], run.link.dq[:count]]) for run in runs], axis=1
    )
    base = np.concatenate([unpack(start), start.coulomb])
    # prior of the ratio of link (7, 8) to motor friction (9, 10): a factor of two
    prior = np.zeros((4, SIZE + 2))
    prior[[0, 1], [7, 8]], prior[[0, 1], [9, 10]] = np.array([1.0, -1.0]) / np.log(2.0)
    # the standard deviation of the logarithms of the Coulomb torques is 0.1
    prior[[2, 3], [SIZE, SIZE + 1]] = 10.0
    weight = np.ones(measured.shape[-1])

    def arm(factors: FloatArray) -> TwoLinkParameters:
        values = base * np.exp(factors)
        return replace(pack(values[:SIZE], start), coulomb=values[SIZE:])

    def residual(factors: FloatArray) -> FloatArray:
        simulated = velocities(steps, arm(factors))
        return np.concatenate([((simulated - measured) / weight).ravel(), prior @ factors])

    def jacobian(factors: FloatArray) -> FloatArray:
        now = base * np.exp(factors)
        _, slopes = sensitivities(steps, arm(factors), np.diag(now))
        slopes = (slopes / weight[:, np.newaxis]).reshape(-1, len(base))
        return np.vstack([slopes, prior])

    factors = np.zeros(len(base))
    for _ in range(3):  # from the second pass on, every sensor is weighted by its own noise
        fit = least_squares(
            residual, factors, jac=jacobian, method='trf', x_scale='jac', xtol=1e-9
        )
        factors = fit.x
        residuals = fit.fun[: -len(prior)].reshape(-1, len(weight)) * weight
        weight = np.sqrt(np.mean(residuals**2, axis=0)) + 1e-12
    after = arm(factors)
    found = unpack(after)
    rows, residuals = jacobian(factors), residual(factors)
    # residuals are correlated, so scores are summed over channels of a sample, without the prior
    white_noise, data = _covariance(rows), len(residuals) - len(prior)
    scores = (rows * residuals[:, np.newaxis])[:data].reshape(*measured.shape, -1).sum(axis=2)
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


def _covariance(jacobian: FloatArray) -> FloatArray:
    """Return the covariance of the log parameters for residuals of unit variance."""
    scale = np.linalg.norm(jacobian, axis=0)
    if not np.all(scale > 0.0):
        raise IdentificationError(
            'the step responses do not depend on all parameters; record steps of both joints'
        )
    _, sizes, rows = np.linalg.svd(jacobian / scale, full_matrices=False)
    if sizes[-1] < 1e-10 * sizes[0]:
        raise IdentificationError(
            'the step responses do not determine all parameters; record steps of both joints in '
            'several poses'
        )
    half = rows.T / sizes
    return np.asarray(half @ half.T / np.outer(scale, scale))


@dataclass(frozen=True, eq=False)
class MeasuredJoint:
    """
    Measured frequency responses of a joint from motor torque to motor and link velocity.

    Attributes
    ----------
    frequency : ndarray, shape (K,)
        [Hz].
    decoupled, coupled : ndarray of complex, shape (K, 2)
        With the interaction torque as a second input, and without [rad/s / (N m)].

    """

    frequency: FloatArray
    decoupled: npt.NDArray[np.complex128]
    coupled: npt.NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class TwoInertiaIdentification:
    """
    Results of the three identification steps of a two-link arm.

    Attributes
    ----------
    joints : tuple of str
        Names of the joints.
    rigid : RigidFit
        Step 1.
    measured : sequence of MeasuredJoint
        Measured responses without a model, for comparison.
    systems : sequence of StateSpace
        Step 2, of both joints.
    untuned : TwoLinkParameters
        Parameters after step 3a.
    interaction_gain : ndarray, shape (2,)
        Gain of the interaction torques in step 3a; 1 if beta and gamma are right.
    experiments : int
        Number of experiments through the resonances.
    tuning : Tuning or None
        Step 3b; None without step responses.

    """

    joints: tuple[str, ...]
    rigid: RigidFit
    measured: Sequence[MeasuredJoint]
    systems: Sequence[StateSpace]
    untuned: TwoLinkParameters
    interaction_gain: FloatArray
    experiments: int
    tuning: Tuning | None

    @property
    def parameters(self) -> TwoLinkParameters:
        """Tuned parameters; without tuning, the parameters fitted to frequency responses."""
        return self.untuned if self.tuning is None else self.tuning.parameters


def identify_two_inertia(
    runs: Sequence[ElasticRun],
    drives: TwoLinkParameters,
    loop: VelocityLoop,
    *,
    steps: Sequence[ElasticRun] = (),
    start: TwoLinkParameters | None = None,
    progress: Callable[[float, str], None] = lambda share, what: None,
) -> TwoInertiaIdentification:
    """
    Identify a planar two-link arm with elastic joints in three steps; return the results.

    Parameters
    ----------
    runs : sequence of ElasticRun
        Experiments through the resonances, with some slow motion.
    drives : TwoLinkParameters
        Gears and torque constants; other parameters are not used.
    loop : VelocityLoop
        Gains of the velocity loop of the step responses.
    steps : sequence of ElasticRun
        Step responses for the tuning; without them, step 3b is omitted.
    start : TwoLinkParameters, optional
        Initial values of the tuning instead of those of step 3a; Coulomb friction is always that
        of step 1.
    progress : callable, optional
        Callback with the share that is done and the next step.

    Raises
    ------
    IdentificationError
        If the data do not determine the parameters; the message names the step and the remedy.

    """
    progress(0.0, 'step 1: rigid arm')
    rigid = fit_rigid(runs)
    first, beta, gamma, rotor = rigid.estimate.values[:4].tolist()
    if not (first > 0.0 and beta > 0.0 and first * beta > gamma**2):
        raise IdentificationError(
            f'the fitted inertias are impossible: alpha + mm gear^2 = {first:.3g} (link 1 and '
            f'rotor 1), beta = {beta:.3g} (link 2), gamma = {gamma:.3g} kg m^2 (coupling). Record '
            'a faster motion, and check the signs of torques and velocities'
        )
    alpha = max(first - max(rotor, 0.0), 1.01 * gamma**2 / beta)
    known = replace(
        drives, alpha=alpha, beta=beta, gamma=gamma, coulomb=rigid.coulomb / drives.gear
    )
    joints, t = runs[0].motor.joints, runs[0].motor.t
    dt = float(t[-1] - t[0]) / (len(t) - 1)
    window = min(1.0, min(len(run.motor) for run in runs) * dt)
    systems, measured = [], []
    for k, joint in enumerate(joints):
        progress(0.05 + 0.2 * k, f'step 2: decoupled {joint}')
        signals = joint_signals(runs, known, k, decoupled=True)
        alone = joint_signals(runs, known, k, decoupled=False)
        systems.append(identify_subspace(signals, dt, ORDER, HOLD))
        frequency, decoupled = measured_response(signals, dt, window=window)
        _, coupled = measured_response(alone, dt, window=window)
        measured.append(MeasuredJoint(frequency, decoupled[:, :, 0], coupled[:, :, 0]))
    progress(0.45, 'step 3: physical parameters')
    untuned, gain = fit_joints(systems, joints, known)
    tuning = None
    if steps:
        progress(0.5, 'step 3: tuning to step responses')
        begin = untuned if start is None else replace(start, coulomb=untuned.coulomb)
        tuning = tune(steps, begin, loop)
    progress(1.0, 'done')
    return TwoInertiaIdentification(
        joints, rigid, measured, systems, untuned, gain, len(runs), tuning
    )
