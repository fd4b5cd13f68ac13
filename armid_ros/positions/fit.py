# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Output-error fit of drives, friction, delay and tool to commanded and measured positions.

The simulated loop of `LoopModel` is fitted to the measured positions by Gauss-Newton iterations
with a trust region. The described links are taken as exact. Sensitivities are differences of
simulations. Weak priors around the start values keep undetermined parameters finite. The
standard error of such a parameter is infinite, as other values fit equally well. Standard errors
hold for residuals that are correlated within blocks of time.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

from armid_ros import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.estimate import ParameterName
from armid_ros.motion import FloatArray
from armid_ros.positions.loop import CommandedMotion, LoopModel, Window, windows_of
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares, nnls

#: Prior standard deviation of a parameter, relative to the size with which it alone explains the
#: torque.
_PRIOR_STD = 3.0
#: Ratio of residual to noise of a joint above which an effect is missing or a gain is wrong.
MAX_RESIDUAL_TO_NOISE = 1.3

#: A recording and its commands.
Run = tuple[Recording, CommandedMotion]


@dataclass(frozen=True)
class PositionFit:
    """
    Result of the output-error fit of a position-controlled arm.

    Attributes
    ----------
    arm : ArmModel
        The described links with the fitted effects.
    parameters : tuple of ParameterName
        The parameters of `LoopModel`, P of them.
    values, std : ndarray, shape (P,)
        Values and standard errors: 0 for a given value, infinite if the data do not determine it.
    reasons : tuple of str
        Why a value is not determined; empty if it is.
    gain_ratio, gain_ratio_std : ndarray, shape (n,)
        Ratio of the kp that fits the data to the given one, and standard error; 1, 0 if fitted.
    tracking, residual : ndarray, shape (n,)
        Rms of command minus position, and of simulated minus measured position [rad or m].
    noise : ndarray, shape (n,)
        Rms of the part of the residual that is independent from sample to sample [rad or m].
    duration : float
        Compared time [s].

    """

    arm: ArmModel
    parameters: tuple[ParameterName, ...]
    values: FloatArray
    std: FloatArray
    reasons: tuple[str, ...]
    gain_ratio: FloatArray
    gain_ratio_std: FloatArray
    tracking: FloatArray
    residual: FloatArray
    noise: FloatArray
    duration: float

    def of(self, name: str, joint: str = '') -> tuple[float, float]:
        """Return value and standard error of the fitted parameter with a name and a joint."""
        place = [(one.name, one.joint) for one in self.parameters].index((name, joint))
        return float(self.values[place]), float(self.std[place])


def fit_positions(
    model: LoopModel, runs: Sequence[Run], gains: FloatArray | None = None
) -> PositionFit:
    """
    Fit the parameters of a simulated position-control loop to recorded positions.

    Parameters
    ----------
    model : LoopModel
        The described robot and its kind of control.
    runs : sequence of (Recording, CommandedMotion)
        Recordings with their commands.
    gains : ndarray, shape (2, n), optional
        Known kp and kd [N m/rad, N m s/rad]; fitted by default.

    Raises
    ------
    IdentificationError
        If no recording is long enough, or a recording has too few samples.

    """
    windows = [window for run in runs for window in windows_of(*run)]
    if not windows:
        raise IdentificationError(
            f'{runs[0][0].source}: positions and commands overlap by less than 2 s without gaps; '
            'check that both were recorded together, and record longer'
        )
    start, size = start_values(model, runs, gains)
    free = np.ones(len(start), dtype=bool)
    free[1 : 2 * model.robot.n_joints + 1] = gains is None
    problem = _Problem(model, windows, start, size)
    return _fit_at(problem, problem.solved(free), free)


def start_values(
    model: LoopModel, runs: Sequence[Run], gains: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """
    Return start values and typical sizes of the P parameters for the fit, each of shape (P,).

    The torque balance of each joint is linear in gains, rotor inertia and friction. It is solved
    for nonnegative values and several delays. The result has the delay with the smallest
    residual.

    """
    robot, n = model.robot, model.robot.n_joints
    motions = [recording.motion() for recording, _ in runs]
    # 2000 samples of a recording are enough for start values
    motions = [one.select(slice(None, None, len(one) // 2000 + 1)) for one in motions]
    body = ArmModel(robot)
    load = np.concatenate([body.load(motion) for motion in motions])
    if model.compensated:
        load = load - np.concatenate([body.load(m.at_rest()) for m in motions])
    q, dq, ddq = (np.concatenate([getattr(m, x) for m in motions]) for x in ('q', 'dq', 'ddq'))
    side = np.sign(dq) * (np.abs(dq) > 0.05 * np.abs(dq).max(axis=0))
    free = np.array([gains is None, gains is None, True, True, True])
    if gains is None and not any(np.any(commands.dq) for _, commands in runs):
        free[3] = False  # velocity gain and viscous friction are collinear
    least, level = np.inf, np.sum(load**2, axis=0) + 1e-12
    for delay in np.arange(0.0, 0.1, 0.002):  # [s]
        means = []
        for motion, (_, commands) in zip(motions, runs, strict=True):
            half = 0.5 * (motion.t[1] - motion.t[0])
            edges = np.append(motion.t - half, motion.t[-1] + half) - delay
            means.append(commands.mean(edges))
        u, du = (np.concatenate(x) for x in zip(*means, strict=True))
        columns = np.array([u - q, du - dq, -ddq, -dq, -side])
        found = np.zeros((5, n))
        if gains is not None:
            found[:2] = gains
        rest = load - np.einsum('kmj,kj->mj', columns, found)
        misfit = 0.0
        for j in range(n):
            found[free, j], norm = nnls(columns[free, :, j].T, rest[:, j])
            misfit += norm**2 / level[j]
        if misfit < least:
            least, best, values, behind, slower = misfit, delay, found, u - q, du - dq
    effort = values[0] * behind + values[1] * slower
    speed, rate, effort, error = (
        np.sqrt(np.mean(x**2, axis=0)) + 1e-6 for x in (dq, ddq, effort, behind)
    )
    # a joint that sticks moves only by the noise of its encoder, which gives no scale
    speed, rate = (np.maximum(x, 0.01 * x.max()) for x in (speed, rate))
    if gains is None:  # the described load of a light last link gives no scale
        more = np.maximum(0.03 * effort.max() / effort, 1.0)
        values, effort = more * values, more * effort
    mass = float(robot.rigid_parameters[::10].sum())
    sizes = np.array([effort / error, effort / speed, effort / rate, effort / speed, effort])
    radius = 0.02  # radius of gyration of a tool [m]
    # sizes of delay [s], parameters of joints, mass [kg], centre and radius of the tool [m]
    size = np.concatenate([[0.03], sizes.ravel(), [mass / _PRIOR_STD], 3 * [0.1], [radius]])
    # move start values off the limits, as the solver hardly leaves a limit
    values[free] = np.maximum(values, 0.02 * sizes)[free]
    return np.concatenate([[best], values.ravel(), [0.01 * mass, 0.0, 0.0, 0.0, radius]]), size


@dataclass(eq=False)
class _Problem:
    """Least-squares problem of simulated minus measured positions, with weak priors."""

    model: LoopModel
    windows: list[Window]
    start: FloatArray
    size: FloatArray

    def residual(self, x: FloatArray) -> FloatArray:
        """Return simulated minus measured positions, shape (M, n)."""
        simulated = self.model.simulated(x, self.windows)
        measured = [window.q for window in self.windows]
        return np.concatenate(simulated) - np.concatenate(measured)

    def slopes(self, x: FloatArray, places: npt.NDArray[np.intp]) -> FloatArray:
        """Return derivatives of simulated positions by the k parameters at `places`, (M, n, k)."""
        share = 1e-3  # step of a parameter, as a share of its size
        now, steps = self.residual(x), share * np.diag(self.size)[places]
        columns = [(self.residual(x + step) - now) / share for step in steps]
        return np.stack(columns, axis=-1)

    def solved(self, free: npt.NDArray[np.bool_]) -> FloatArray:
        """Fit the `free` parameters, with joints weighted by 1 / rms residual; return all P."""
        x, places = self.start.copy(), np.flatnonzero(free)
        lower, upper = np.zeros(len(x)), np.full(len(x), np.inf)
        lower[0], upper[0] = -0.05, 0.3  # delay [s]; it is negative if the clocks differ
        lower[-4:-1], upper[-4:] = -1.0, 1.0  # centre and radius of the tool [m]
        size, prior = self.size[places], np.eye(len(places)) / _PRIOR_STD

        def parameters(z: FloatArray) -> FloatArray:
            found = self.start.copy()
            found[places] = size * z
            return found

        def weighted(z: FloatArray) -> FloatArray:
            return np.append(self.residual(parameters(z)) / sigma, (z - begin) / _PRIOR_STD)

        def jacobian(z: FloatArray) -> FloatArray:
            slopes = self.slopes(parameters(z), places) / sigma[:, np.newaxis]
            return np.concatenate([slopes.reshape(-1, len(places)), prior])

        begin, bounds = self.start[places] / size, (lower[places] / size, upper[places] / size)
        sigma = np.sqrt(np.mean(self.residual(x) ** 2, axis=0)) + 1e-9
        for _ in range(3):  # each iteration has a new estimate of the noise of the joints
            found = least_squares(
                weighted,
                x[places] / size,
                jacobian,
                bounds,
                x_scale='jac',
                ftol=1e-5,
                xtol=1e-5,
                max_nfev=25,
            )
            x, before = parameters(found.x), sigma
            sigma = np.sqrt(np.mean(self.residual(x) ** 2, axis=0)) + 1e-9
            if np.all(np.abs(before / sigma - 1.0) < 0.1):
                break
        return x


def _errors(
    information: FloatArray, scores: FloatArray, chosen: npt.NDArray[np.intp]
) -> tuple[FloatArray, FloatArray]:
    """Return covariance and standard errors of `chosen` parameters, divided by typical sizes."""
    inside = information[np.ix_(chosen, chosen)] + np.eye(len(chosen)) / _PRIOR_STD**2
    covariance = np.linalg.inv(inside)
    blocks = len(scores)
    correction = blocks / max(blocks - len(chosen), 0.2 * blocks)  # degrees of freedom
    middle = correction * scores[:, chosen].T @ scores[:, chosen]
    robust = np.diag(covariance @ middle @ covariance)
    return np.asarray(covariance), np.sqrt(np.maximum(np.diag(covariance), robust))


def _fit_at(problem: _Problem, x: FloatArray, free: npt.NDArray[np.bool_]) -> PositionFit:
    """Return the result for fitted parameters x: standard errors, residuals, gain ratios."""
    model, n, count = problem.model, problem.model.robot.n_joints, len(x)
    residuals = problem.residual(x)
    sigma = np.sqrt(np.mean(residuals**2, axis=0)) + 1e-9
    weighted = problem.slopes(x, np.arange(count)) / sigma[:, np.newaxis]
    gradients = np.einsum('mjp,mj->mp', weighted, residuals / sigma)
    t = np.concatenate([k * 1e6 + window.t for k, window in enumerate(problem.windows)])
    _, block = np.unique(np.floor(t / 0.5), return_inverse=True)  # 0.5 s: correlated residuals
    scores = np.zeros((block.max() + 1, count))
    np.add.at(scores, block, gradients)
    information = np.einsum('mjp,mjr->pr', weighted, weighted)

    errors = partial(_errors, information, scores)
    fitted = np.flatnonzero(free)
    covariance, own = errors(fitted)
    std, reasons = np.zeros(count), [''] * count
    limit = 0.3 * _PRIOR_STD  # larger standard errors are reported as infinite
    std[fitted] = own * problem.size[fitted]
    for k, place in enumerate(fitted):
        if own[k] < limit or place == count - 1:  # the radius, the last one, has a real prior
            continue
        std[place] = np.inf
        correlation = np.abs(covariance[k]) / np.sqrt(np.diag(covariance))
        correlation[k] = 0.0
        other = model.parameters[fitted[np.argmax(correlation)]]
        alone = information[place, place] ** -0.5 if information[place, place] else np.inf
        mixed = f'not separable from the {other.words} of {other.joint or "the arm"}'
        if 'velocity_gain' in (other.name, model.parameters[place].name):
            mixed += '; give --gains, or record commanded velocities'
        reasons[place] = mixed if alone < limit else 'the motion does not depend on it'
    residual = np.sqrt(np.mean(residuals**2, axis=0))
    noise = np.sqrt(np.mean(np.diff(residuals, 3, axis=0) ** 2, axis=0) / 20.0)
    ratio, ratio_std = np.ones(n), np.zeros(n)
    if not free[1]:
        values, deviation = x.copy(), np.zeros(count)
        with_kp = free | (np.arange(count) <= n)
        if np.any(residual > MAX_RESIDUAL_TO_NOISE * noise):  # too far for a linear step
            again = replace(problem, start=x).solved(with_kp)
            refitted = _fit_at(problem, again, with_kp)
            values, deviation = refitted.values, refitted.std
        else:  # one Gauss-Newton step with kp free as well
            some = np.flatnonzero(with_kp)
            covariance, own = errors(some)
            values[some] -= covariance @ gradients.sum(axis=0)[some] * problem.size[some]
            deviation[some] = own * problem.size[some]
        ratio, ratio_std = (each[1 : n + 1] / x[1 : n + 1] for each in (values, deviation))
    tracking = [w.commands.mean(np.append(w.t, w.t[-1] + 1e-3))[0] - w.q for w in problem.windows]
    return PositionFit(
        model.arm(x),
        model.parameters,
        x,
        std,
        tuple(reasons),
        ratio,
        ratio_std,
        np.sqrt(np.mean(np.concatenate(tracking) ** 2, axis=0)),
        residual,
        noise,
        sum(float(w.t[-1] - w.t[0]) for w in problem.windows),
    )
