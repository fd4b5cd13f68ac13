# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Gaussian process of the residual torque of a joint, on inducing points.

K-means divides the states into cells. An inducing point is the mean state of a cell, with the mean
residual torque. Length scales, amplitude and noise maximise the marginal likelihood. Source:
Rasmussen and Williams 2006, section 5.4; for inducing points Quinonero-Candela and Rasmussen 2005.

"""

from __future__ import annotations

from typing import NamedTuple
import warnings

from armid_ros.effects.learned import scaled_inputs, TorqueMap
from armid_ros.motion import FloatArray
from armid_ros.residual.rows import JointRows
import numpy as np
import numpy.typing as npt

#: Bounds of the length scales, as shares of the span of an input; an input at the upper bound is
#: irrelevant.
_LENGTHS = (0.02, 10.0)


class _Cells(NamedTuple):
    """M clusters of N samples: labels of the samples (N,), mean states (M, 3), torques (M,)."""

    labels: npt.NDArray[np.intp]
    points: FloatArray
    torque: FloatArray


def learn_map(rows: JointRows, rng: np.random.Generator) -> tuple[TorqueMap, FloatArray]:
    """
    Learn a map of a joint's residual torque; return the map and its cross-validated torques.

    Parameters
    ----------
    rows : JointRows
        Residual of the joint.
    rng : numpy.random.Generator
        Random numbers for the initial cells.

    Returns
    -------
    found : TorqueMap
        The map, learned from all rows.
    predicted : ndarray, shape (N,)
        Torque of each row, predicted by a map that was learned from the other blocks [N m].

    """
    from sklearn.cluster import MiniBatchKMeans

    everywhere = np.ones(len(rows), dtype=bool)
    best: tuple[float, _Scales, _Cells] | None = None
    # candidate knees, as shares of the largest velocity
    for share in (0.02, 1.0):
        knee = max(share * float(np.abs(rows.inputs[:, 1]).max()), 1e-9)
        # inducing points, with at least two rows for each
        count = max(1, min(200, len(rows) // 2))
        means = MiniBatchKMeans(
            count, n_init=1, random_state=int(rng.integers(2**31)), batch_size=1024
        )
        inputs = scaled_inputs(rows.inputs, knee)
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
    """Hyperparameters of the Gaussian process, and the velocity `knee` that scales its inputs."""

    noise: float
    lengths: FloatArray
    amplitude: float
    knee: float


def _span(inputs: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.ptp(inputs, axis=0), 1e-9))


def _cells(rows: JointRows, labels: npt.NDArray[np.intp], used: npt.NDArray[np.bool_]) -> _Cells:
    """Return mean state and mean residual of each cluster, over the samples in the mask `used`."""
    own, n = labels[used], int(labels.max()) + 1
    count = np.bincount(own, minlength=n)
    there = count > 0
    columns = np.column_stack([rows.inputs[used], rows.residual[used]])
    sums: FloatArray = np.array([np.bincount(own, x, n) for x in columns.T], dtype=np.float64)
    means = (sums[:, there] / count[there]).T
    return _Cells(labels, means[:, :3], means[:, 3])


def _fitted(cells: _Cells, knee: float) -> tuple[float, _Scales]:
    """Maximise the log likelihood; return its value per cluster, and the hyperparameters."""
    from sklearn.gaussian_process import GaussianProcessRegressor, kernels

    size = max(float(np.sqrt(np.mean(cells.torque**2))), 1e-12)
    # bounds relative to the residual; the upper one limits the torque outside the data
    amplitudes = tuple(one**2 for one in (0.1, 2.0))
    smooth = kernels.ConstantKernel(1.0, amplitudes) * kernels.RBF([0.3, 0.3, 1.0], _LENGTHS)
    # bounds of the noise variance of a cell, over the mean square of the residual
    regressor = GaussianProcessRegressor(smooth + kernels.WhiteKernel(0.1, (1e-6, 2.0)))
    points = scaled_inputs(cells.points, knee)
    span = _span(points)
    # a hundred points suffice for the scales; the order of cells is arbitrary
    some = slice(None, None, max(1, len(points) // 100))
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')  # with a length scale at its bound, an input is irrelevant
        regressor.fit((points / span)[some], cells.torque[some] / size)
    found, white = regressor.kernel_.k1, regressor.kernel_.k2
    lengths = np.asarray(found.k2.length_scale, dtype=float)
    lengths = np.where(lengths > 0.9 * _LENGTHS[1], np.inf, lengths * span)
    amplitude = float(size * np.sqrt(found.k1.constant_value))
    # per cell and in units of torque, so fits with different knees are comparable
    evidence = float(regressor.log_marginal_likelihood_value_) / len(cells.torque[some])
    noise = float(size * np.sqrt(white.noise_level))
    return evidence - float(np.log(size)), _Scales(noise, lengths, amplitude, knee)


def _posterior(cells: _Cells, scales: _Scales) -> TorqueMap:
    none = np.zeros(len(cells.torque))
    noise = np.full_like(none, scales.noise)
    return TorqueMap(cells.points, none, noise, *scales[1:]).fitted_to(cells.torque)
