# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Cross-validation: errors of predicting parts of the data from a fit to other parts.

If a motion is too short or excites too little, the fit follows the noise. The two halves of the
data then yield different parameters, and each predicts the other half badly.

A spectrum of positions above white noise need not be motion. Jitter of stamps, encoder steps and
backlash of gears look like motion, and differentiation amplifies them by the square of their
frequency. Torques distinguish motion from these faults. The cut-off is therefore chosen by the
prediction of held-out torques.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.identification.fitting.least_squares import (
    informative_basis,
    informative_solution,
    NormalEquations,
)
from armid_ros.identification.rows.regression import by_stretch, Regression, regressions, Score
from armid_ros.identification.rows.signals import Conditioning, TORQUE_RESOLUTION
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt

#: Number of samples for the comparison of cut-offs: about a hundred for every parameter of seven
#: joints.
_MAX_ROWS = 6000


def halves_error(
    problem: Sequence[Regression],
    weights: FloatArray,
    described: FloatArray,
    spread: FloatArray | None = None,
) -> Score:
    """
    Return the torque errors of predicting each half of the data by a fit to the other half.

    Parameters
    ----------
    problem : sequence of Regression
        N samples of r columns, in the order of time.
    weights : ndarray, shape (N, n)
        Weight of each sample of each joint in the fit: inverse residual of the joint.
    described : ndarray, shape (r,)
        Values of the description; parameters that a half does not determine keep them.
    spread : ndarray, shape (r,), optional
        Largest expected errors of these values; by default, errors of the size of the torque.

    Returns
    -------
    Score
        Errors of the predicted torque.

    """
    # about fifty samples for every parameter of seven joints
    step, columns, tau, target, informative = _some_rows(problem, 4000)
    difference, weight = target - columns @ described, weights[::step]
    expected = np.full(len(described), np.inf) if spread is None else spread
    middle = len(tau) // 2
    halves = slice(0, middle), slice(middle, None)
    residual = np.zeros_like(tau)
    for fitted, predicted in (halves, halves[::-1]):
        # Bayesian estimate in units of the residual. The prior deviation is the expected error
        # of the description, or the size of the torque. Without a prior, parameters that a half
        # does not determine would be arbitrary. With a residual near zero, these parameters keep
        # the described values.
        own = weight[fitted]
        size = np.sqrt(np.mean((columns[fitted] * own[:, :, np.newaxis]) ** 2, axis=(0, 1)))
        torque = np.sqrt(np.mean((tau[fitted] * own) ** 2))
        share = np.where(size > 0.0, size, 1.0) / max(torque, 1.0)
        change = _fit(columns[fitted], difference[fitted], own, share**2 + expected**-2.0)
        residual[predicted] = difference[predicted] - columns[predicted] @ change
    return Score.of_rows(residual, tau, informative)


def jackknife(
    problem: Sequence[Regression], weights: FloatArray, values: FloatArray
) -> FloatArray:
    """
    Return the changes of fitted values if each recording in turn is left out, shape (K, r).

    The squared changes of a value sum to its variance. The weight of a change is the precision
    with which the other recordings determine the value. For white noise, the sum of squares then
    equals the variance of least squares, even if one recording determines most of a value. Values
    that the other recordings do not determine have no change.

    Parameters
    ----------
    problem : sequence of Regression
        N samples of r columns.
    weights : ndarray, shape (N, n)
        Weight of each sample of each joint in the fit.
    values : ndarray, shape (r,)
        Fitted values.

    Returns
    -------
    ndarray, shape (K, r)
        Changes without each of K recordings; empty for a single recording.

    References
    ----------
    Wu, Jackknife, bootstrap and other resampling methods in regression analysis, Annals of
    Statistics 14, 1986.

    """
    parts: dict[str, FloatArray] = {}
    for part, weight in zip(problem, by_stretch(problem, weights), strict=True):
        own = NormalEquations.of([part], weight).summed()[:-1]
        own[:, -1] -= own[:, :-1] @ values
        parts[part.source] = parts.get(part.source, np.zeros_like(own)) + own
    if len(parts) < 2:
        return np.zeros((0, len(values)))
    products = np.array(list(parts.values()))
    whole = products.sum(axis=0)
    fits = []
    for normal in (whole, *(whole - products)):
        basis = informative_basis(normal[:, :-1])
        fits.append((basis @ (basis.T @ normal[:, -1]), np.sqrt(np.sum(basis**2, axis=1))))
    (change, std), *held_out = fits
    result = []
    for held_change, held_std in held_out:
        determined = held_std > 0.0
        share = np.where(determined, std / np.where(determined, held_std, 1.0), 0.0)
        result.append(share * (held_change - change))
    return np.array(result)


def cutoff_of_torques(
    arm: ArmModel,
    columns: npt.NDArray[np.intp],
    recordings: Sequence[Recording],
    used: Conditioning,
) -> Conditioning:
    """
    Choose the position cut-off that predicts held-out torques best; return the filters.

    The cut-off is halved while held-out torques are predicted better. The result is the highest
    cut-off whose held-out loss is within a tenth, or one standard error, of the smallest loss. The
    cut-off of clean data therefore does not change. Source of the standard error: Breiman et al.,
    Classification and Regression Trees, 1984.

    Parameters
    ----------
    arm : ArmModel
        Rigid body and effects.
    columns : ndarray of int, shape (r,)
        Parameters of the arm that are identifiable in some motion.
    recordings : sequence of Recording
        Data with torques.
    used : Conditioning
        Filters with the highest cut-off to be tested.

    Returns
    -------
    Conditioning
        Filters with the chosen cut-off.

    """
    # smallest gain, as a share of the error, for which a cut-off is lowered. Jitter and backlash
    # increase the error by a third or more on every tested machine.
    min_gain = 0.1
    # windows evenly spread over long recordings; at 1 kHz, a filter of 1 Hz removes a tenth of
    # each window at its ends
    n_windows, most = 8, 2 * _MAX_ROWS * used.decimation
    total = sum(len(recording) for recording in recordings)
    if total > most:
        begins = np.linspace(0, total - most // n_windows, n_windows).astype(int)
        windows, before = [], 0
        for recording in recordings:
            ends = np.stack([begins, begins + most // n_windows]) - before
            inside = np.clip(ends, 0, len(recording)).T
            windows += [recording.select(slice(*pair)) for pair in inside if np.ptp(pair) > 1]
            before += len(recording)
        recordings = windows
    tried: dict[float, list[list[Regression]]] = {}
    good = [used.cutoff_hz]
    cutoff, rows = used.cutoff_hz, 0
    while True:
        lower = replace(used, cutoff_hz=cutoff)
        try:
            problem = [regressions(arm, columns, [one], lower) for one in recordings]
        except IdentificationError:
            break
        count = sum(len(part.tau) for parts in problem for part in parts)
        if count < 0.8 * rows or not count:  # the cut-off is too low for these stretches
            break
        rows = max(rows, count)
        tried[cutoff] = problem
        losses = {hz: _losses(one, problem) for hz, one in tried.items()}
        best = min(losses.values(), key=np.mean)
        worse = {hz: own - best for hz, own in losses.items()}
        good = [
            hz
            for hz, excess in worse.items()
            if np.mean(excess) <= max(np.std(excess, ddof=1) / np.sqrt(len(excess)), min_gain)
        ]
        if cutoff not in good:
            break
        cutoff *= 0.5
    return replace(used, cutoff_hz=max(good))


def _losses(
    problem: Sequence[Sequence[Regression]], lowest: Sequence[Sequence[Regression]]
) -> FloatArray:
    """Return the held-out loss of each fold: the mean logarithm of the joints' rms errors."""
    # Odd folds are predicted from even ones, and vice versa; their losses give the standard error
    # of the mean. Every joint counts by the ratio of its errors: a light joint, whose torque is
    # mostly noise, gains by a low cut-off and must not hide that a heavy one loses.
    n_folds = 16
    # the lowest cut-off has fewer samples at the ends, while the arm starts and stops
    shared = []
    for parts, shorter in zip(problem, lowest, strict=True):
        for part in parts:
            t = part.motion.t
            inside = [(t >= own.motion.t[0]) & (t <= own.motion.t[-1]) for own in shorter]
            kept = np.flatnonzero(np.any(inside, axis=0))
            if len(kept):
                shared.append(part.select(kept))
    _, x, _, y, informative = _some_rows(shared, _MAX_ROWS)
    fold = np.arange(len(y)) * n_folds // len(y)
    residual = np.zeros_like(y)
    score = Score.of_rows(y - x @ _fit(x, y, informative), y, informative)
    weight = 1.0 / np.maximum(score.rms, 1e-12)
    for odd in (0, 1):
        chosen = fold % 2 == odd
        value = _fit(x[chosen], y[chosen], informative[chosen] * weight)
        residual[~chosen] = y[~chosen] - x[~chosen] @ value
    folds = [fold == k for k in range(n_folds)]
    rms = np.array([Score.of_rows(residual[own], y[own], informative[own]).rms for own in folds])
    least = np.maximum(TORQUE_RESOLUTION * score.torque_rms, 1e-12)
    return np.asarray(np.mean(np.log(np.maximum(rms, least)), axis=1))


def _fit(
    x: FloatArray,
    y: FloatArray,
    weights: npt.NDArray[np.floating] | npt.NDArray[np.bool_],
    precision: FloatArray | float = 0.0,
) -> FloatArray:
    """Return r parameters by weighted least squares, with a prior of mean 0 and `precision`."""
    rows = (x * weights[:, :, np.newaxis]).reshape(-1, x.shape[2])
    normal = rows.T @ rows
    normal[np.diag_indices_from(normal)] += precision
    return informative_solution(normal, rows.T @ (y * weights).ravel())


def _some_rows(
    problem: Sequence[Regression], count: int
) -> tuple[int, FloatArray, FloatArray, FloatArray, npt.NDArray[np.bool_]]:
    """Return stride, columns, torque, target and `informative` of about `count` samples."""
    step = max(1, sum(len(part.tau) for part in problem) // count)
    columns, tau, target = (
        np.concatenate([getattr(part, name) for part in problem])[::step]
        for name in ('columns', 'tau', 'target')
    )
    informative = np.concatenate([part.informative for part in problem])[::step]
    return step, columns, tau, target, informative
