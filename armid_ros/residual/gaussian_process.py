# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A Gaussian process of what is left of a joint, on inducing points.

The inducing points are the means of cells of the state, found by k-means, with the mean torque of
their rows. Length scales, amplitude and the noise of these means are those of the greatest
marginal likelihood.
Source: Rasmussen and Williams 2006, section 5.4; for inducing points Quinonero-Candela and
Rasmussen 2005.

"""

from __future__ import annotations

from typing import NamedTuple
import warnings

from armid_ros.effects.learned import counted, TorqueMap
from armid_ros.motion import FloatArray
from armid_ros.residual.rows import JointRows
import numpy as np
import numpy.typing as npt

#: Inducing points of a joint at most, and rows for each at least.
_POINTS, _ROWS = 200, 2
#: As many of them are enough to find length scales and noise.
_FOR_SCALES = 100
#: Knees that are looked at, over the largest velocity.
_KNEES = (0.02, 1.0)
#: Length scales that are looked at, over the span of an input; one at the end does not matter.
_LENGTHS = (0.02, 10.0)
#: Amplitudes that are tried, relative to the root mean square of the residual: where there are no
#: data, the torque is taken to be no larger than where there are some.
_AMPLITUDES = (0.1, 2.0)
#: Variances of the noise of a cell that are looked at, over the same.
_NOISES = (1e-6, 2.0)


class _Cells(NamedTuple):
    """Cell of each row, (N,), and mean state (M, 3) and torque (M,) of each cell."""

    labels: npt.NDArray[np.intp]
    points: FloatArray
    torque: FloatArray


def learn_map(rows: JointRows, rng: np.random.Generator) -> tuple[TorqueMap, FloatArray]:
    """
    Learn the map of a joint.

    Parameters
    ----------
    rows : JointRows
        Its residual.
    rng : numpy.random.Generator
        Draws the first cells.

    Returns
    -------
    found : TorqueMap
        Learned from all rows.
    predicted : ndarray, shape (N,)
        Torque of each row by maps that were learned from other blocks [N m].

    """
    from sklearn.cluster import MiniBatchKMeans

    everywhere = np.ones(len(rows), dtype=bool)
    best: tuple[float, _Scales, _Cells] | None = None
    for share in _KNEES:
        knee = max(share * float(np.abs(rows.inputs[:, 1]).max()), 1e-9)
        count = max(1, min(_POINTS, len(rows) // _ROWS))
        means = MiniBatchKMeans(
            count, n_init=1, random_state=int(rng.integers(2**31)), batch_size=1024
        )
        inputs = counted(rows.inputs, knee)
        labels = np.asarray(means.fit_predict(inputs / _span(inputs)), dtype=np.intp)
        cells = _cells(rows, labels, everywhere)
        evidence, scales = _fitted(cells, knee)
        if best is None or evidence > best[0]:
            best = evidence, scales, cells
    assert best is not None
    _, scales, cells = best
    predicted = np.zeros(len(rows))
    for others in rows.folds():
        own = _posterior(_cells(rows, cells.labels, others), scales)
        predicted[~others] = own.torque(rows.inputs[~others])
    return _posterior(cells, scales), predicted


class _Scales(NamedTuple):
    """Noise of the points, length scales, amplitude and knee of a map."""

    noise: float
    lengths: FloatArray
    amplitude: float
    knee: float


def _span(inputs: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.ptp(inputs, axis=0), 1e-9))


def _cells(rows: JointRows, labels: npt.NDArray[np.intp], used: npt.NDArray[np.bool_]) -> _Cells:
    """Return means of the cells over some rows; cells without any are left out."""
    own, n = labels[used], int(labels.max()) + 1
    count = np.bincount(own, minlength=n)
    there = count > 0
    columns = np.column_stack([rows.inputs[used], rows.left[used]])
    sums: FloatArray = np.array([np.bincount(own, x, n) for x in columns.T], dtype=np.float64)
    means = (sums[:, there] / count[there]).T
    return _Cells(labels, means[:, :3], means[:, 3])


def _fitted(cells: _Cells, knee: float) -> tuple[float, _Scales]:
    """Return the greatest marginal likelihood, as a logarithm, and what has it."""
    from sklearn.gaussian_process import GaussianProcessRegressor, kernels

    size = max(float(np.sqrt(np.mean(cells.torque**2))), 1e-12)
    amplitudes = tuple(one**2 for one in _AMPLITUDES)
    smooth = kernels.ConstantKernel(1.0, amplitudes) * kernels.RBF([0.3, 0.3, 1.0], _LENGTHS)
    regressor = GaussianProcessRegressor(smooth + kernels.WhiteKernel(0.1, _NOISES))
    points = counted(cells.points, knee)
    span = _span(points)
    some = slice(None, None, max(1, len(points) // _FOR_SCALES))  # cells are in no order
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')  # a length scale at its bound: an input is irrelevant
        regressor.fit((points / span)[some], cells.torque[some] / size)
    found, white = regressor.kernel_.k1, regressor.kernel_.k2
    lengths = np.asarray(found.k2.length_scale, dtype=float)
    lengths = np.where(lengths > 0.9 * _LENGTHS[1], np.inf, lengths * span)
    amplitude = float(size * np.sqrt(found.k1.constant_value))
    # each cell in units of its own size: comparable between cells of different knees
    evidence = float(regressor.log_marginal_likelihood_value_) / len(cells.torque[some])
    noise = float(size * np.sqrt(white.noise_level))
    return evidence - float(np.log(size)), _Scales(noise, lengths, amplitude, knee)


def _posterior(cells: _Cells, scales: _Scales) -> TorqueMap:
    none = np.zeros(len(cells.torque))
    noise = np.full_like(none, scales.noise)
    return TorqueMap(cells.points, none, noise, *scales[1:]).given(cells.torque)
