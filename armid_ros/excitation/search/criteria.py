# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Information of a motion on the parameters, and optimality criteria.

W is the regressor of the base parameters, with every row divided by the standard deviation of
its joint's torque noise. The information matrix is W' W. Its inverse is the covariance of the
weighted least-squares estimate. Every criterion is a cost to minimise, with a gradient with
respect to the information matrix.

"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from armid_ros.estimate import ParameterName
from armid_ros.motion import FloatArray, freeze, read_only
import numpy as np
import numpy.typing as npt

#: Optimality criteria, each with its meaning.
CRITERIA = {
    'D': 'volume of the confidence ellipsoid, log det of the information',
    'A': 'mean variance of the parameters, each scaled to its torque',
    'E': 'variance along the worst direction, with parameters scaled to their torque',
    'condition': 'condition number of the weighted regressor',
    'T': 'torque that a rival model cannot explain',
}


#: Smallest eigenvalue of an identifiable direction, with parameters scaled to unit information.
_MIN_EIGENVALUE = 1e-13


@dataclass(frozen=True)
class Information:
    """
    Fisher information of a recorded motion on r parameters.

    Attributes
    ----------
    parameters : tuple of ParameterName
        r names.
    matrix : ndarray, shape (r, r)
        Information matrix, the inverse of the covariance of the estimate.
    scale : ndarray, shape (r,)
        Size of each parameter whose torque equals the noise in random motions. Criteria A and E
        use it as the unit of the parameter, so that physical units do not matter.

    """

    parameters: tuple[ParameterName, ...]
    matrix: FloatArray
    scale: FloatArray

    def __post_init__(self) -> None:
        """Freeze the information matrix and the sizes of the parameters."""
        freeze(self, 'matrix', 'scale')

    @property
    def log_det(self) -> float:
        """Logarithm of the determinant of the information matrix; -inf if it is singular."""
        sign, value = np.linalg.slogdet(self.matrix)
        return float(value) if sign > 0 else -np.inf

    @property
    def condition(self) -> float:
        """Condition number of the weighted regressor."""
        values = np.linalg.eigvalsh(self.matrix)
        return float(np.sqrt(values[-1] / values[0])) if values[0] > 0 else np.inf

    @cached_property
    def std(self) -> FloatArray:
        """Predicted standard deviation of each parameter, shape (r,); inf if not identifiable."""
        diagonal = np.sqrt(np.diag(self.matrix))
        seen = diagonal > 0.0
        std = np.full(len(diagonal), np.inf)
        scaled = self.matrix[np.ix_(seen, seen)] / np.outer(diagonal[seen], diagonal[seen])
        values, vectors = np.linalg.eigh(scaled)
        visible = values > _MIN_EIGENVALUE
        variance = (vectors[:, visible] ** 2 / values[visible]).sum(axis=1)
        blind = (vectors[:, ~visible] ** 2).sum(axis=1) > np.sqrt(_MIN_EIGENVALUE)
        std[seen] = np.where(blind, np.inf, np.sqrt(variance)) / diagonal[seen]
        return read_only(std)


@dataclass(frozen=True)
class Criterion:
    """
    Optimality criterion: cost of an information matrix (r, r), to be minimised.

    All parameters outside the target are nuisance parameters, which are fitted too. The cost
    depends on the Schur complement S = M_ww - M_wn M_nn^+ M_nw of their block.

    Attributes
    ----------
    name : str
        A function of the eigenvalues of S. 'D': -log det / r, plus ``balance`` times the log of
        the condition number of the weighted regressor. 'A': log of the mean variance in units of
        ``scale``. 'E': log of the largest variance in any direction, in the same units.
        'condition': log of the condition number of the weighted regressor. Or 'T': -log of the sum
        of squared residuals, in noise units, of a rival without the wanted parameters. Source of
        'T': Atkinson and Fedorov 1975, for models linear in their parameters.
    scale : ndarray, shape (r,)
        See `Information`.
    wanted : ndarray of bool, shape (r,)
        The wanted parameters.
    values : ndarray, shape (r,)
        Values of the parameters, for 'T'.
    balance : float
        Weight of the condition number in 'D'; 0: D-optimality only.

    """

    name: str
    scale: FloatArray
    wanted: npt.NDArray[np.bool_]
    values: FloatArray
    balance: float = 0.0

    def cost(self, matrix: FloatArray) -> float:
        """Return the cost of an information matrix, shape (r, r); inf if singular."""
        return self._evaluated(matrix, np.inf)[0]

    def smooth(self, matrix: FloatArray) -> tuple[float, FloatArray]:
        """
        Return a smooth approximation of the cost of an information matrix, and its gradient.

        Returns
        -------
        cost : float
            Equal to the cost for A, T, and D without balance; inf if the matrix is singular.
        gradient : ndarray, shape (r, r)
            Derivative by the entries of the matrix.

        """
        # The largest and the smallest eigenvalue are not differentiable where two eigenvalues
        # cross. The search uses a p-norm instead, which is larger by a factor of at most r^(1/p):
        # 1.4 for 60 parameters.
        return self._evaluated(matrix, 12.0)

    def _evaluated(self, matrix: FloatArray, norm: float) -> tuple[float, FloatArray]:
        wanted, nuisance = np.flatnonzero(self.wanted), np.flatnonzero(~self.wanted)
        projection = np.eye(len(matrix))[wanted]  # S = P M P'
        if len(nuisance):
            block, reach = matrix[np.ix_(nuisance, nuisance)], matrix[np.ix_(nuisance, wanted)]
            # least squares by the normal equations, which allows linearly dependent columns
            size = np.sqrt(np.maximum(np.diag(block), 0.0))
            unit = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
            shares, axes = np.linalg.eigh(block * np.outer(unit, unit))
            directions = unit[:, np.newaxis] * axes[:, shares > _MIN_EIGENVALUE]
            projection[:, nuisance] = (
                -(reach.T @ directions / shares[shares > _MIN_EIGENVALUE]) @ directions.T
            )
        units = self.scale[wanted] if self.name in 'AE' else np.ones(len(wanted))
        projection *= units[:, np.newaxis]
        schur = projection @ matrix @ projection.T
        if self.name == 'T':
            direction = projection.T @ self.values[wanted]
            power = float(self.values[wanted] @ schur @ self.values[wanted])
            if power <= 0.0:
                return float(np.inf), np.zeros_like(matrix)
            return float(-np.log(power)), -np.outer(direction, direction) / power
        values, vectors = np.linalg.eigh(schur)
        if values[0] <= 0.0:
            return float(np.inf), np.zeros_like(matrix)
        cost, slope = self._of_eigenvalues(values, norm)
        vectors = projection.T @ vectors
        return cost, (vectors * slope) @ vectors.T

    def _of_eigenvalues(self, values: FloatArray, norm: float) -> tuple[float, FloatArray]:
        """Return the cost and its derivatives by the eigenvalues, which are in ascending order."""
        if self.name == 'A':
            total = np.sum(1.0 / values)
            return float(np.log(total / len(values))), -1.0 / (values**2 * total)
        variance, slope = _log_norm(1.0 / values, norm)
        slope = -slope / values**2
        if self.name == 'E':
            return variance, slope
        largest, by_largest = _log_norm(values, norm)
        condition, slope = 0.5 * (variance + largest), 0.5 * (slope + by_largest)
        if self.name == 'condition':
            return condition, slope
        cost = float(-np.mean(np.log(values))) + self.balance * condition
        return cost, -1.0 / (len(values) * values) + self.balance * slope


def _log_norm(values: FloatArray, norm: float) -> tuple[float, FloatArray]:
    """Return the logarithm of the p-norm of positive values, and its gradient; p is `norm`."""
    powers = (values / values.max()) ** norm
    total = powers.sum()
    return float(np.log(values.max()) + np.log(total) / norm), powers / (total * values)
