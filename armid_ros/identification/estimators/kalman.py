# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
An extended Kalman filter of positions, velocities and parameters.

State x = (q, dq, theta), input the recorded torque, output the recorded position; theta is
constant and begins at the values of least squares, with deviations widened. The arm is integrated
from sample to sample with the parameters as believed so far, and each position corrects all
three. Positions and torques are as recorded; only where the model is differentiated, velocity and
acceleration are those of the smooth motion.
Source: Gautier and Poignet 2001; Jazwinski 1970, section 8.3.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.identification.fitting.excited import bounds
from armid_ros.identification.fitting.nonlinear import FittedValues, moved, torques
from armid_ros.identification.rows.regression import REST_SPEED
from armid_ros.identification.rows.signals import (
    Conditioning,
    conditioning,
    decimate,
    decimated_samples,
    segments,
    SignalSettings,
)
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import cho_factor, cho_solve, LinAlgError

#: Samples per second that are enough to integrate an arm between them [Hz].
_RATE = 500.0
#: Steps of differences of position [rad or m] and velocity.
_STEP = 1e-6
#: What a parameter may be off by, if least squares knows it so well: this share of its value ...
_PRIOR_SHARE = 0.3
#: ... or what makes this share of the torque that is recorded, whichever is more: of effects, and
#: of the body.
_PRIOR_TORQUE = 0.1, 0.01
#: Deviations of least squares are widened so many times, as the noise of encoders biases them.
_DOUBT = 10.0
#: The start and the filter have the same data, and the covariance of the two as if they were
#: independent is too small; whatever their correlation, it is at most so many times that
#: (covariance intersection with equal weights, Julier and Uhlmann 1997).
_TWICE = 2.0
#: A filter that leaves so many times the torque of least squares has not converged.
_CONVERGED = 1.5
#: Least position noise [rad or m]: below it rounding of the integration counts.
_LEAST_NOISE = 1e-7


def fit_by_kalman_filter(
    start: ArmModel,
    fit: FittedValues,
    recordings: Sequence[Recording],
    used: Conditioning,
    free: FloatArray,
) -> tuple[FittedValues, tuple[str, ...]]:
    """
    Fit by an extended Kalman filter.

    Parameters
    ----------
    start : ArmModel
        Where it begins: least squares, or the nearest arm that can be simulated.
    fit : FittedValues
        Weighted least squares: which parameters, and how large the torque noise is.
    recordings : sequence of Recording
        Training data.
    used : Conditioning
        Filters of the least squares; the Kalman filter has none but that before decimation.
    free : ndarray, shape (10 n, k)
        Directions of the rigid parameters that change no torque.

    Raises
    ------
    IdentificationError
        If an effect has a memory or is not linear in its parameters, or the filter diverges.

    """
    if fit.passes > 1 or not all(effect.instantaneous for effect in start.effects):
        named = ', '.join(effect.name for effect in start.effects)
        raise IdentificationError(
            'ekf takes effects without a memory whose torque is linear in their parameters; '
            f'among {named} is one that is not so: use wls'
        )
    limits = bounds(start, fit.base)
    values = fit.base.values(start.theta)
    covariance = _prior(fit, values)
    clear = conditioning(list(recordings), SignalSettings())
    smooth = replace(used, cutoff_hz=min(used.cutoff_hz, clear.cutoff_hz))
    for recording in recordings:
        for motion in segments(recording, smooth):
            kalman = _Filter(start, fit, _thinned(recording, motion, used), used)
            values, covariance = kalman.run(values, covariance, limits)
    arm = moved(fit.arm, fit.base, values, free)
    found = replace(
        fit,
        arm=arm,
        values=values,
        solution=replace(fit.solution, values=values, covariance=_TWICE * covariance),
        predicted=torques(arm, recordings, used),
    )
    ratio = _left(found) / max(_left(fit), 1e-300)
    if ratio < _CONVERGED:
        return found, ()
    return found, (
        f'ekf leaves {ratio:.2g} times the torque that wls leaves: it has not converged',
    )


def _left(fit: FittedValues) -> float:
    """Return the size of what a fit leaves of the torque."""
    left = [p.tau - torque for p, torque in zip(fit.problem, fit.predicted, strict=True)]
    return float(np.linalg.norm(np.concatenate(left)))


def _prior(fit: FittedValues, values: FloatArray) -> FloatArray:
    """
    Return the covariance of the parameters before the filter sees the data, shape (r, r).

    The values are those of least squares. Nothing may be believed of them that is narrower than
    their own deviations: what the data cannot tell would be taken for known. Much wider it may not
    be either, or what a model lacks carries the filter off before the data hold it.

    """
    size = np.sqrt(np.mean(np.concatenate([part.tau for part in fit.problem]) ** 2, axis=0))
    columns = np.concatenate([part.columns for part in fit.problem])
    reach = np.max(np.sqrt(np.mean(columns**2, axis=0)) / size[:, np.newaxis], axis=0)
    body = [parameter.rigid for parameter in fit.base.parameters]
    least = np.where(body, _PRIOR_TORQUE[1], _PRIOR_TORQUE[0])
    known = np.maximum(_PRIOR_SHARE * np.abs(values), least / reach)
    alone = np.maximum(known, np.sqrt(np.diag(fit.solution.covariance)))
    moved_by = np.diag((values - fit.values) ** 2)  # to an arm that can be simulated
    wide = _DOUBT**2 * fit.solution.covariance + moved_by
    scaled = wide / np.outer(alone, alone)
    return np.asarray(
        np.outer(alone, alone) * np.linalg.solve(scaled + np.eye(len(alone)), scaled)
    )


def _colour(fit: FittedValues) -> float:
    """
    Return how many times the variance of white noise has to be to blur parameters as much.

    What a model lacks comes back for many samples; the deviations of least squares have that in
    them, and a filter that takes it for white follows it with its parameters.

    """
    columns = np.concatenate([part.columns for part in fit.problem])
    rows = fit.solution.weights[:, :, np.newaxis] * columns
    flat = rows.reshape(-1, rows.shape[2])
    size = np.sqrt(np.diag(fit.solution.covariance))
    white = np.linalg.pinv((flat * size).T @ (flat * size), hermitian=True)
    return max(1.0, float(np.median(1.0 / np.diag(white))))


def _thinned(recording: Recording, motion: Motion, used: Conditioning) -> Motion:
    """
    Return positions and torques as recorded, at the rate of the Kalman filter.

    Velocity and acceleration are those of the smooth motion: they say where the model is
    differentiated. The filter's own velocity and acceleration have the noise of encoders and
    torques in them, and columns that go with the noise bias the parameters.

    """
    factor = max(1, round(used.rate_hz / _RATE))
    raw = Conditioning(used.rate_hz, used.rate_hz, factor)
    assert motion.tau is not None
    q = CubicSpline(recording.t, recording.q)(motion.t)
    rows = np.arange(len(motion))
    if factor > 1:
        rows = np.array(decimated_samples(len(motion), raw), dtype=np.intp)
        q, tau = decimate(q, raw), decimate(motion.tau, raw)
    else:
        tau = motion.tau
    return replace(motion.select(rows), q=q, tau=tau, partner=None)


@dataclass(frozen=True)
class _Slopes:
    """
    The torque of an arm at one state, and its derivatives.

    Attributes
    ----------
    torque : ndarray, shape (n,)
        Without acceleration.
    by_q, by_dq, inertia : ndarray, shape (n, n)
        Derivatives by position, velocity and acceleration.
    columns : ndarray, shape (n, r)
        Derivatives by the parameters, at the acceleration that was asked for.
    step : ndarray, shape (n,)
        Half the torque between slow motion forwards and backwards, which friction may hold, of
        joints that are slow; of others none.

    """

    torque: FloatArray
    by_q: FloatArray
    by_dq: FloatArray
    inertia: FloatArray
    columns: FloatArray
    step: FloatArray


class _Filter:
    """
    The filter along one stretch.

    Parameters
    ----------
    arm : ArmModel
        Structure.
    fit : FittedValues
        Parameters and torque noise.
    motion : Motion
        Positions and torques.
    used : Conditioning
        Filters of the least squares, whose residual is the torque noise.

    """

    def __init__(
        self, arm: ArmModel, fit: FittedValues, motion: Motion, used: Conditioning
    ) -> None:
        self._arm, self._columns, self._motion = arm, fit.base.independent, motion
        self._dt = float(motion.t[1] - motion.t[0])
        self._start = fit.base.values(arm.theta)
        self._slow = REST_SPEED * np.max(np.abs(motion.dq), axis=0)
        self._noise = np.maximum(_position_noise(motion), _LEAST_NOISE) ** 2
        # the residual of the least squares is white at its own rate; the same spectrum here
        rows = used.rate_hz / used.decimation
        white = fit.solution.joint_std**2 * max(1.0, 1.0 / (self._dt * rows))
        self._torque_noise = white * _colour(fit)

    def run(
        self, values: FloatArray, covariance: FloatArray, limits: tuple[FloatArray, FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """Filter the stretch; return parameters and their covariance."""
        n, r = self._motion.n_joints, len(values)
        assert self._motion.tau is not None
        x = np.concatenate([self._motion.q[0], self._motion.dq[0], values])
        p = np.zeros((2 * n + r, 2 * n + r))
        p[:n, :n] = np.diag(self._noise)
        p[n : 2 * n, n : 2 * n] = np.diag(2.0 * self._noise / self._dt**2)
        p[2 * n :, 2 * n :] = covariance
        for k in range(1, len(self._motion)):
            tau = 0.5 * (self._motion.tau[k - 1] + self._motion.tau[k])
            x, p = self._predict(x, p, k - 1, tau)
            x, p = self._correct(x, p, self._motion.q[k])
            x[2 * n :] = np.clip(x[2 * n :], *limits)
            if not np.all(np.isfinite(x)):
                raise IdentificationError(_diverged(self._motion.t[k]))
        return x[2 * n :], p[2 * n :, 2 * n :]

    def _predict(
        self, x: FloatArray, p: FloatArray, k: int, tau: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        n, dt = self._motion.n_joints, self._dt
        q, dq, theta = x[:n], x[n : 2 * n], x[2 * n :]
        smooth = self._motion.dq[k]
        here = self._slopes(q + 0.5 * dt * dq, smooth, self._motion.ddq[k], theta)
        torque = here.torque + here.by_dq @ (dq - smooth)
        try:
            factor = cho_factor(here.inertia)
        except (LinAlgError, ValueError):
            raise IdentificationError(_diverged(self._motion.t[-1])) from None
        implicit = here.inertia + 0.5 * dt * here.by_dq  # velocity terms at the middle of the step
        ddq = np.asarray(np.linalg.solve(implicit, tau - torque), dtype=np.float64)
        after = np.concatenate([q + dt * dq + 0.5 * dt**2 * ddq, dq + dt * ddq, theta])
        slopes = -np.linalg.solve(implicit, np.hstack([here.by_q, here.by_dq, here.columns]))
        moves = np.eye(len(x))
        moves[:n, n : 2 * n] += dt * np.eye(n)
        moves[n : 2 * n] += dt * slopes
        moves[:n] += 0.5 * dt**2 * slopes
        p = moves @ p @ moves.T
        gain = cho_solve(factor, np.diag(np.sqrt(self._torque_noise + here.step**2)))
        noise = np.vstack([0.5 * dt**2 * gain, dt * gain])
        p[: 2 * n, : 2 * n] += noise @ noise.T
        return after, p

    def _correct(
        self, x: FloatArray, p: FloatArray, q: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        n = self._motion.n_joints
        innovation = p[:n, :n] + np.diag(self._noise)
        gain = np.linalg.solve(innovation, p[:n]).T
        x = x + gain @ (q - x[:n])
        left = np.eye(len(x))
        left[:, :n] -= gain
        return x, left @ p @ left.T + (gain * self._noise) @ gain.T  # Joseph's form

    def _slopes(
        self, q: FloatArray, dq: FloatArray, ddq: FloatArray, theta: FloatArray
    ) -> _Slopes:
        """
        Differentiate the torque by everything, from one call of the columns.

        Between slow motion backwards and forwards it is taken as straight, as friction may be
        anything there.

        """
        n, slow = len(q), np.abs(dq) < self._slow
        middle = np.where(slow, 0.0, dq)
        reach = np.where(slow, self._slow, _STEP)
        states = np.empty((4 * n + 2, 3, n))
        states[:, 0], states[:, 1], states[:, 2] = q, middle, ddq
        states[:n, 0] += _STEP * np.eye(n)
        states[n : 2 * n, 1] += np.diag(reach)
        states[2 * n : 3 * n, 1] -= np.diag(reach)
        states[3 * n : 4 * n, 2] += np.eye(n)
        states[-2, 2] = 0.0
        t = self._dt * np.arange(len(states), dtype=float)
        motion = Motion(self._motion.joints, t, states[:, 0], states[:, 1], states[:, 2])
        columns = self._arm.columns(motion)[:, :, self._columns]
        by_dq = (columns[n : 2 * n] - columns[2 * n : 3 * n]) / (2.0 * reach)[:, None, None]
        along = np.tensordot(np.where(slow, dq, 0.0), by_dq, 1)
        torque = columns @ theta
        heavier = columns[3 * n : 4 * n] - columns[-1]
        inertia = (heavier @ theta).T
        if np.linalg.eigvalsh(0.5 * (inertia + inertia.T))[0] <= 0.0:
            inertia = (heavier @ self._start).T  # until the parameters are those of bodies again
        return _Slopes(
            torque[-2] + along @ theta,
            ((torque[:n] - torque[-1]) / _STEP).T,
            (by_dq @ theta).T,
            0.5 * (inertia + inertia.T),
            columns[-1] + along,
            np.where(slow, reach * np.abs(np.einsum('jjp,p->j', by_dq, theta)), 0.0),
        )


def _position_noise(motion: Motion) -> FloatArray:
    """Return the standard deviation of white position noise, from differences, shape (n,)."""
    differences = np.diff(motion.q, n=4, axis=0)  # gain of white noise: sqrt(70)
    return np.asarray(np.median(np.abs(differences), axis=0) / 0.6745 / np.sqrt(70.0))


def _diverged(t: float) -> str:
    return (
        f'ekf: the filter diverged within {t:.0f} s: the description is too far off, or the '
        'sampling too slow; use wls'
    )
