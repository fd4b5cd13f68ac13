# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Fit by instrumental variables from the smoothed motion, and a test for the bias by encoder noise.

Least squares with noisy columns W is biased, because W' W contains the squared noise. With
columns Z of a motion without encoder noise, the solution of Z' (tau - W theta) = 0 is unbiased.
The motion without noise is the recorded motion, smoothed to far below the band of the regressor.
Smoothing leaves 1/3000 of the noise of accelerations. Two checks of a least-squares fit use the
smoothed motion:

- The Durbin-Wu-Hausman test compares the least-squares fit with the fit by instruments.
- A simulation gives the bias: the arm follows the smoothed motion, white noise of the recorded
  size is added to the positions, and the parameters are fitted again.

Source: Young 2011; Hausman 1978; Janot, Vandanjon and Gautier 2014 for robots, with instruments of
a simulated arm; Cook and Stefanski 1994 for the simulation.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.fitting.covariance import noise_products, sandwich
from armid_ros.identification.fitting.identifiability import bounds, HALF_WIDTH
from armid_ros.identification.fitting.least_squares import Method, solve, within_bounds
from armid_ros.identification.fitting.nonlinear import (
    FittedValues,
    linearised,
    torques,
    unidentifiable_directions,
    with_base_values,
)
from armid_ros.identification.rows.regression import Regression, weighted_rows
from armid_ros.identification.rows.signals import Conditioning, position_noise, unbroken
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
from scipy import signal
import scipy.linalg
from scipy.stats import chi2


class _Instrumented(NamedTuple):
    """Instrumental-variable estimate of r parameters, and the difference from least squares."""

    values: FloatArray
    covariance: FloatArray  # correlation of the residuals included
    difference: FloatArray  # values minus those of least squares, both without bounds
    spread: FloatArray  # covariance of the difference if the regressor has no noise


def fit_by_instruments(
    fit: FittedValues, recordings: Sequence[Recording], used: Conditioning
) -> FittedValues:
    """
    Fit base parameters by instrumental variables, computed from the smoothed motion.

    Parameters
    ----------
    fit : FittedValues
        Weighted least-squares fit, the start.
    recordings : sequence of Recording
        Training data.
    used : Conditioning
        Filters.

    """
    base, free = fit.base, unidentifiable_directions(fit.arm, fit.base)
    limits, weights = bounds(fit.arm, base), fit.solution.weights
    calm = _smoothed(recordings, used)
    # the torque of an arm may be nonlinear in its parameters
    for _ in range(4):
        exact, _ = linearised(fit.arm, base, calm, used)
        found = _by_instruments(fit.problem, [part.columns for part in exact], weights, limits)
        step = np.abs(found.values - fit.values) / np.sqrt(np.diag(found.covariance))
        solution = replace(fit.solution, values=found.values, covariance=found.covariance)
        arm = with_base_values(fit.arm, base, found.values, free)
        fit = replace(fit, arm=arm, values=found.values, solution=solution)
        if fit.passes == 1:
            return replace(fit, predicted=torques(arm, recordings, used))
        problem, predicted = linearised(arm, base, recordings, used)
        fit = replace(fit, problem=problem, predicted=predicted)
        if np.max(step, initial=0.0) < 0.02:  # standard deviations
            break
    return fit


def _by_instruments(
    problem: Sequence[Regression],
    instruments: Sequence[FloatArray],
    weights: FloatArray,
    limits: tuple[FloatArray, FloatArray] | None = None,
) -> _Instrumented:
    """
    Estimate theta by the instrumental-variable equation Z' (tau - W theta) = 0.

    The instruments Z of each stretch have the shape (M, n, r) of its columns W. The `weights`,
    (N, n), multiply the samples of both; `limits` are the bounds of physical values.

    """
    w, target = weighted_rows(problem, weights)
    rank = w.shape[1]
    z = (weights[:, :, np.newaxis] * np.concatenate(instruments)).reshape(-1, rank)
    scale = np.linalg.norm(w, axis=0)
    w, z = w / scale, z / scale
    (triangle,) = scipy.linalg.qr(w, mode='r', check_finite=False)
    triangle = triangle[:rank]
    try:
        inverse = scipy.linalg.inv(triangle)
        by_w, by_z = inverse @ inverse.T, scipy.linalg.inv(z.T @ w)
    except scipy.linalg.LinAlgError:
        raise IdentificationError(
            'method iv cannot fit: the smoothed motion does not excite every parameter; use '
            'method wls, or record a richer motion'
        ) from None
    free = values = by_z @ (z.T @ target)
    if limits is not None:
        values = within_bounds(free, triangle, (limits[0] * scale, limits[1] * scale))
    residual = (target - w @ values).reshape(weights.shape)
    scaled = [replace(part, columns=part.columns / scale) for part in problem]
    further = [columns / scale for columns in instruments]
    products = noise_products(scaled, residual, weights, inverse, further)
    apart = np.concatenate([-by_w, by_z], axis=1)
    units = np.outer(scale, scale)
    return _Instrumented(
        values=values / scale,
        covariance=sandwich(by_z, products[rank:, rank:]) / units,
        difference=(free - by_w @ (w.T @ target)) / scale,
        spread=apart @ products @ apart.T / units,
    )


def _smoothed(recordings: Sequence[Recording], used: Conditioning) -> list[Recording]:
    """Return recordings with positions low-passed far below the cut-off of the regressor."""
    calm = []
    for recording in recordings:
        # band of the instruments over that of the regressor, which is ten times the band of the
        # motion
        cutoff = 0.2 * used.cutoff_hz * recording.period * 2.0
        sections = signal.butter(4, min(0.9, cutoff), output='sos')
        q = recording.q.copy()
        for part in unbroken(recording, 1.0 / recording.period):
            # padding of scipy: three times the length of the filter of two second-order sections
            edge = min(15, len(part) - 1)
            q[part] = signal.sosfiltfilt(sections, recording.q[part], axis=0, padlen=edge)
        calm.append(replace(recording, q=q, dq=None))
    return calm


@dataclass(frozen=True)
class NoiseCheck:
    """
    Result of the test for a bias by encoder noise, and the estimated bias.

    Attributes
    ----------
    statistic : float
        Durbin-Wu-Hausman statistic.
    freedom : float
        Degrees of freedom, 1 or more: expected statistic without an effect of encoder noise.
    p_value : float
        Probability of a larger statistic without an effect of encoder noise.
    parameters : tuple of ParameterName
        Names of the r parameters.
    position_noise : ndarray, shape (n,)
        Standard deviation of the position noise [rad or m].
    bias : ndarray, shape (r,)
        Bias of the parameters by encoder noise.
    bias_std : ndarray, shape (r,)
        Standard error of the bias, from the number of simulations.
    std : ndarray, shape (r,)
        Standard deviations of the parameters, for comparison with the bias.

    """

    statistic: float
    freedom: float
    p_value: float
    parameters: tuple[ParameterName, ...]
    position_noise: FloatArray
    bias: FloatArray
    bias_std: FloatArray
    std: FloatArray

    @property
    def consistent(self) -> bool:
        """Whether the Durbin-Wu-Hausman test found no significant effect of encoder noise."""
        # significance of the test
        return self.p_value >= 0.05

    @property
    def relative_bias(self) -> FloatArray:
        """Bias of each parameter by encoder noise over the parameter's std, shape (r,)."""
        return np.asarray(self.bias / np.where(self.std > 0.0, self.std, np.inf))

    @property
    def harmless(self) -> bool:
        """Whether no bias significantly exceeds a quarter of a parameter's std."""
        # smallest bias that matters, in standard deviations: it reduces 95 % intervals to 94 %
        significant = np.maximum(np.abs(self.bias) - HALF_WIDTH * self.bias_std, 0.0)
        return bool(np.all(significant <= 0.25 * self.std))

    def findings(self) -> tuple[tuple[str, bool], tuple[str, bool]]:
        """
        Return a sentence on the test and a sentence on the bias, each with True if satisfactory.

        If the test is significant and the bias by noise is negligible, the two fits differ for
        another reason: a missing effect of the model changes the two fits differently.

        """
        found = 'no sign' if self.consistent else 'a sign'
        found += ' that encoder noise biases the parameters'
        if self.harmless and not self.consistent:
            found = (
                'a fit with instruments differs by more than encoder noise explains; an '
                'effect that the model lacks is the likelier cause'
            )
        worst = int(np.argmax(np.abs(self.relative_bias)))
        name = self.parameters[worst]
        words = replace(name, name=name.name.split(' ')[0]).words
        where = f'{words} of {name.joint}' if name.joint else words
        verdict = 'negligible' if self.harmless else 'it shifts the intervals'
        return (
            (
                f'Durbin-Wu-Hausman test: {found} (statistic {self.statistic:.1f}, '
                f'{self.freedom:.1f} degrees of freedom, p = {self.p_value:.2g})',
                self.consistent,
            ),
            (
                f'bias by the position noise: {verdict} (at most '
                f'{abs(self.relative_bias[worst]):.2g} standard deviations, in {where})',
                self.harmless,
            ),
        )


def check_noise(
    problem_of: Callable[[Sequence[Recording]], Sequence[Regression]],
    estimate: Estimate,
    method: Method,
    recordings: Sequence[Recording],
    used: Conditioning,
    *,
    rng: np.random.Generator,
    repeats: int = 6,
    progress: Callable[[float], None] = lambda share: None,
) -> NoiseCheck:
    """
    Test whether encoder noise biases an identification, and estimate the bias by simulation.

    Parameters
    ----------
    problem_of : callable
        Function that returns the linear problem of given recordings.
    estimate : Estimate
        Estimate of the identification.
    method : {'ols', 'wls', 'irls'}
        Weights of the fit.
    recordings : sequence of Recording
        Recordings of the fit.
    used : Conditioning
        Filters.
    rng : numpy.random.Generator
        Generator of the noise of the simulations.
    repeats : int
        Number of simulations, 2 or more.
    progress : callable, optional
        Called with the finished share, 0 to 1.

    """
    problem = problem_of(recordings)
    progress(1.0 / (repeats + 2))
    weights = solve(problem, method).weights
    calm = _smoothed(recordings, used)
    exact = problem_of(calm)
    progress(2.0 / (repeats + 2))
    found = _by_instruments(problem, [part.columns for part in exact], weights)
    unit = 1.0 / np.sqrt(np.diag(found.covariance))
    sizes, axes = np.linalg.eigh(found.spread * np.outer(unit, unit))
    # A difference of 0.1 standard deviations between the two fits is negligible. Without this
    # allowance, the test is too sensitive: two fits of the same data differ by a thousandth.
    counted = 1.0 / (sizes.clip(0.0) + 0.1**2)
    statistic = float(np.sum((axes.T @ (found.difference * unit)) ** 2 * counted))
    freedom = max(float(np.sum(sizes.clip(0.0) * counted)), 1.0)  # expected value of the statistic

    # A fit with noisy columns V to the torque W beta of exact columns yields M beta, M = V^+ W.
    # The estimate beta_hat is M times the truth, so its bias is beta_hat - M^-1 beta_hat. The bias
    # is therefore M^-1 V^+ times the difference of the torques of beta_hat along both motions.
    noise = np.sqrt(np.mean([position_noise(r) ** 2 for r in recordings], axis=0))
    values, std = estimate.values, estimate.std
    scale = np.where(std > 0.0, std, 1.0)
    w = weighted_rows(exact, weights)[0] * scale
    biases = []
    for k in range(repeats):
        noisy = problem_of([replace(r, q=r.q + noise * rng.normal(size=r.q.shape)) for r in calm])
        pairs = zip(exact, noisy, strict=True)
        lost = np.concatenate([one.torque(values) - other.torque(values) for one, other in pairs])
        both = np.column_stack([w, (weights * lost).ravel()])
        gain = np.linalg.lstsq(weighted_rows(noisy, weights)[0] * scale, both, rcond=None)[0]
        biases.append(np.linalg.solve(gain[:, :-1], gain[:, -1]))
        progress((k + 3.0) / (repeats + 2))
    return NoiseCheck(
        statistic=statistic,
        freedom=freedom,
        p_value=float(chi2.sf(statistic, freedom)),
        parameters=estimate.parameters,
        position_noise=noise,
        bias=scale * np.mean(biases, axis=0),
        bias_std=scale * np.std(biases, axis=0, ddof=1) / np.sqrt(repeats),
        std=std,
    )
