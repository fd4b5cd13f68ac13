# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Test whether encoder noise biases an identification, and estimate the bias.

Least squares takes the regressor as known, but it is computed from noisy positions. Two checks:

- The Durbin-Wu-Hausman test compares the fit with one by instruments, which is unbiased if the
  instruments do not share the regressor's noise. They are the regressor of the same motion,
  smoothed to a fifth of the band, which leaves 1/3000 of the noise of accelerations.
- The bias itself comes from a simulation: the arm follows the smoothed motion, noise as in the
  recorded positions is added to its positions, and it is identified again.

Source: Hausman 1978; Janot, Vandanjon and Gautier 2014 for robots, with instruments of a simulated
arm; Cook and Stefanski 1994 for the simulation.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from armid_ros.estimate import Estimate
from armid_ros.identification.fitting.instruments import by_instruments, linear_problem, smoothed
from armid_ros.identification.fitting.least_squares import solve
from armid_ros.identification.identify import Identification
from armid_ros.identification.rows.regression import Regression, weighted_rows
from armid_ros.identification.rows.signals import even_positions, mean_spectrum
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
from scipy.stats import chi2


@dataclass(frozen=True)
class NoiseCheck:
    """
    The effect of encoder noise on an identification.

    Attributes
    ----------
    statistic : float
        Durbin-Wu-Hausman statistic.
    freedom : float
        Degrees of freedom, 1 or more: expected statistic without an effect of encoder noise.
    p_value : float
        Probability of a larger statistic without an effect of encoder noise.
    instrumental : Estimate
        The fit with instruments.
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
    instrumental: Estimate
    position_noise: FloatArray
    bias: FloatArray
    bias_std: FloatArray
    std: FloatArray

    @property
    def consistent(self) -> bool:
        """Whether the test is not significant."""
        # significance of the test
        return self.p_value >= 0.05

    @property
    def relative_bias(self) -> FloatArray:
        """Bias in standard deviations of each parameter, shape (r,)."""
        return np.asarray(self.bias / np.where(self.std > 0.0, self.std, np.inf))

    @property
    def harmless(self) -> bool:
        """Whether the bias of every parameter is negligible against its standard deviation."""
        # smallest bias that matters, in standard deviations: it reduces 95 % intervals to 94 %
        return bool(np.max(np.abs(self.relative_bias), initial=0.0) < 0.25)

    def findings(self) -> tuple[tuple[str, bool], tuple[str, bool]]:
        """
        Return a sentence per finding, and whether the finding is satisfactory.

        If the test is significant and the bias by noise is negligible, the two fits differ for
        another reason: a missing effect of the model changes them differently.

        """
        found = 'no sign' if self.consistent else 'a sign'
        found += ' that encoder noise biases the parameters'
        if self.harmless and not self.consistent:
            found = (
                'a fit with instruments differs by more than encoder noise explains; an '
                'effect that the model lacks is the likelier cause'
            )
        worst = int(np.argmax(np.abs(self.relative_bias)))
        name = self.instrumental.parameters[worst]
        leader = name.name.split(' ')[0]
        where = f'{leader} of {name.joint}' if name.joint else leader
        low, high = self.position_noise.min(), self.position_noise.max()
        verdict = 'negligible' if self.harmless else 'the intervals are shifted by the bias'
        return (
            (
                f'Durbin-Wu-Hausman test: {found} (statistic {self.statistic:.1f}, '
                f'{self.freedom:.1f} degrees of freedom, p = {self.p_value:.2g})',
                self.consistent,
            ),
            (
                f'position noise {low:.2g} to {high:.2g} rad (or m): {verdict} (bias at most '
                f'{abs(self.relative_bias[worst]):.2g} standard deviations, in {where})',
                self.harmless,
            ),
        )


def check_noise(
    result: Identification,
    recordings: Sequence[Recording],
    *,
    rng: np.random.Generator,
    repeats: int = 6,
    progress: Callable[[float], None] = lambda share: None,
) -> NoiseCheck:
    """
    Test an identification for the effect of encoder noise and estimate its bias.

    Parameters
    ----------
    result : Identification
        The identification.
    recordings : sequence of Recording
        Recordings of the fit.
    rng : numpy.random.Generator
        Generator of the noise of the simulations.
    repeats : int
        Number of simulations, 2 or more.
    progress : callable, optional
        Called with the finished share, 0 to 1.

    """
    about = partial(
        linear_problem, result.arm, result.base, used=result.used, linear=result.passes == 1
    )
    problem = about(recordings)
    progress(1.0 / (repeats + 2))
    weights = solve(problem, result.settings.least_squares).weights
    calm = smoothed(recordings, result.used)
    exact = about(calm)
    progress(2.0 / (repeats + 2))
    found = by_instruments(problem, [part.columns for part in exact], weights)
    unit = 1.0 / np.sqrt(np.diag(found.covariance))
    sizes, axes = np.linalg.eigh(found.spread * np.outer(unit, unit))
    # negligible difference between the two fits, in standard deviations. Without it, the test is
    # too sensitive: two fits of the same data are distinguishable to a thousandth.
    counted = 1.0 / (sizes.clip(0.0) + 0.1**2)
    statistic = float(np.sum((axes.T @ (found.difference * unit)) ** 2 * counted))
    freedom = max(float(np.sum(sizes.clip(0.0) * counted)), 1.0)  # expected value of the statistic

    # A fit with noisy columns V to the torque W beta of exact columns yields M beta, M = V^+ W.
    # The estimate beta_hat is M times the truth, so its bias is beta_hat - M^-1 beta_hat. This
    # is M^-1 V^+ times the difference of its torques along the exact and the noisy motion.
    noise = np.sqrt(np.mean([position_noise(r) ** 2 for r in recordings], axis=0))
    values, std = result.estimate.values, result.estimate.std
    scale = np.where(std > 0.0, std, 1.0)

    def torque(problem: Sequence[Regression]) -> FloatArray:
        """Return the weighted torque of linear models, shape (N n,)."""
        return np.asarray((weights * np.concatenate([p.torque(values) for p in problem])).ravel())

    w, exact_torque = weighted_rows(exact, weights)[0] * scale, torque(exact)
    biases = []
    for k in range(repeats):
        noisy = about([replace(r, q=r.q + noise * rng.normal(size=r.q.shape)) for r in calm])
        both = np.column_stack([w, exact_torque - torque(noisy)])
        gain = np.linalg.lstsq(weighted_rows(noisy, weights)[0] * scale, both, rcond=None)[0]
        biases.append(np.linalg.solve(gain[:, :-1], gain[:, -1]))
        progress((k + 3.0) / (repeats + 2))
    return NoiseCheck(
        statistic=statistic,
        freedom=freedom,
        p_value=float(chi2.sf(statistic, freedom)),
        instrumental=Estimate(result.base.parameters, found.values, found.covariance),
        position_noise=noise,
        bias=scale * np.mean(biases, axis=0),
        bias_std=scale * np.std(biases, axis=0, ddof=1) / np.sqrt(repeats),
        std=std,
    )


def position_noise(recording: Recording) -> FloatArray:
    """
    Return the standard deviation of white position noise, shape (n,) [rad or m].

    It follows from the upper end of the spectrum. Jumps across gaps are no noise.

    """
    rate = 1.0 / recording.period
    frequency, power = mean_spectrum(even_positions(recording), rate, detrend='linear')
    # share of the sampling rate above which the spectrum of positions is noise
    level = np.mean(power[frequency > 0.3 * rate], axis=0)
    return np.asarray(np.sqrt(level * 0.5 * rate))
