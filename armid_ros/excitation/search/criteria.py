# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How much a motion tells about the parameters.

With W the regressor of the base parameters, every row divided by the standard deviation of its
joint's torque noise, the information matrix is W' W and its inverse the covariance of the
weighted least-squares estimate. Every criterion is a cost, a number to make small, and comes with
its gradient by the information matrix.

"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from armid_ros.errors import TrajectoryError
from armid_ros.estimate import ParameterName
from armid_ros.motion import FloatArray, read_only
import numpy as np

#: Criteria to design for, each with what it stands for.
CRITERIA = {
    'D': 'volume of the confidence ellipsoid, log det of the information',
    'A': 'mean variance of the parameters, each scaled to the torque it makes',
    'E': 'variance along the worst direction, parameters scaled to the torque they make',
    'condition': 'condition number of the weighted regressor',
    'T': 'torque that a rival model cannot explain',
}

#: The largest and the smallest eigenvalue have a kink where two of them cross. A search follows a
#: p-norm instead, which is at most r^(1/p) beyond them: 1.4-fold for 60 parameters.
_NORM = 12.0

#: A direction of the parameters, each scaled to unit information, is not seen below this.
_BLIND = 1e-13


@dataclass(frozen=True)
class Information:
    """
    What a motion tells about r parameters.

    Attributes
    ----------
    parameters : tuple of ParameterName
        r names.
    matrix : ndarray, shape (r, r)
        Information matrix, the inverse of the covariance of the estimate.
    scale : ndarray, shape (r,)
        Size of each parameter that makes a torque as large as the noise, over random motions;
        criteria A and E measure the parameters in it, so that units do not matter.

    """

    parameters: tuple[ParameterName, ...]
    matrix: FloatArray
    scale: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays and check their shapes."""
        count = len(self.parameters)
        for name, shape in (('matrix', (count, count)), ('scale', (count,))):
            object.__setattr__(self, name, read_only(getattr(self, name)))
            if getattr(self, name).shape != shape:
                raise TrajectoryError(
                    f'information: {name} of {count} parameters has shape '
                    f'{getattr(self, name).shape}, expected {shape}'
                )

    @property
    def log_det(self) -> float:
        """Natural logarithm of the determinant; -inf where some parameter is not seen."""
        sign, value = np.linalg.slogdet(self.matrix)
        return float(value) if sign > 0 else -np.inf

    @property
    def condition(self) -> float:
        """Condition number of the weighted regressor, not of its square."""
        values = np.linalg.eigvalsh(self.matrix)
        return float(np.sqrt(values[-1] / values[0])) if values[0] > 0 else np.inf

    @cached_property
    def std(self) -> FloatArray:
        """Predicted standard deviation of each parameter, shape (r,); inf where not seen."""
        diagonal = np.sqrt(np.diag(self.matrix))
        seen = diagonal > 0.0
        std = np.full(len(diagonal), np.inf)
        scaled = self.matrix[np.ix_(seen, seen)] / np.outer(diagonal[seen], diagonal[seen])
        values, vectors = np.linalg.eigh(scaled)
        visible = values > _BLIND
        variance = (vectors[:, visible] ** 2 / values[visible]).sum(axis=1)
        blind = (vectors[:, ~visible] ** 2).sum(axis=1) > np.sqrt(_BLIND)
        std[seen] = np.where(blind, np.inf, np.sqrt(variance)) / diagonal[seen]
        return read_only(std)


@dataclass(frozen=True)
class SpectralCriterion:
    """
    D, A, E or the condition number: a function of the eigenvalues of the information matrix.

    Attributes
    ----------
    name : str
        'D': -log det / r, plus ``balance`` times the log of the condition number of the weighted
        regressor. 'A': log of the mean variance in units of ``scale``. 'E': log of the
        largest variance in any direction, in the same units. 'condition': log of the condition
        number of the weighted regressor.
    scale : ndarray, shape (r,)
        See `Information`.
    balance : float
        Weight of the condition number in 'D'; 0 is D-optimality and nothing else.

    """

    name: str
    scale: FloatArray
    balance: float = 0.0

    def cost(self, matrix: FloatArray) -> float:
        """Return the cost of an information matrix, shape (r, r); inf where it is singular."""
        values = np.linalg.eigvalsh(self._scaled(matrix))
        if values[0] <= 0.0:
            return float(np.inf)
        if self.name == 'A':
            return float(np.log(np.mean(1.0 / values)))
        if self.name == 'E':
            return float(-np.log(values[0]))
        condition = float(0.5 * np.log(values[-1] / values[0]))
        if self.name == 'condition':
            return condition
        return float(-np.mean(np.log(values))) + self.balance * condition

    def smooth(self, matrix: FloatArray) -> tuple[float, FloatArray]:
        """
        Return a smooth stand-in for the cost and its gradient.

        Returns
        -------
        cost : float
            Equal to the cost for A and D without balance; inf where the matrix is singular.
        gradient : ndarray, shape (r, r)
            Derivative by the entries of the matrix.

        """
        values, vectors = np.linalg.eigh(self._scaled(matrix))
        if values[0] <= 0.0:
            return float(np.inf), np.zeros_like(matrix)
        count = len(values)
        if self.name == 'A':
            total = np.sum(1.0 / values)
            cost, slope = np.log(total / count), -1.0 / (values**2 * total)
        elif self.name == 'E':
            cost, slope = _smooth_largest(1.0 / values)
            slope = -slope / values**2
        else:
            small, by_small = _smooth_largest(1.0 / values)
            large, by_large = _smooth_largest(values)
            cost, slope = 0.5 * (small + large), 0.5 * (by_large - by_small / values**2)
            if self.name == 'D':
                cost = -np.mean(np.log(values)) + self.balance * cost
                slope = -1.0 / (count * values) + self.balance * slope
        gradient = (vectors * slope) @ vectors.T
        units = self._units()
        return float(cost), gradient * np.outer(units, units)

    def _units(self) -> FloatArray:
        return self.scale if self.name in 'AE' else np.ones_like(self.scale)

    def _scaled(self, matrix: FloatArray) -> FloatArray:
        units = self._units()
        return matrix * np.outer(units, units)


def _smooth_largest(values: FloatArray) -> tuple[float, FloatArray]:
    """Return the log of a p-norm of positive numbers, and its gradient."""
    powers = (values / values.max()) ** _NORM
    total = powers.sum()
    return float(np.log(values.max()) + np.log(total) / _NORM), powers / (total * values)


@dataclass(frozen=True)
class SubsetCriterion:
    """
    Ds-optimality: see some parameters, whatever the others are.

    Attributes
    ----------
    wanted : ndarray of bool, shape (r,)
        True for the parameters that count; the rest are nuisance.
    scale : ndarray, shape (r,)
        See `Information`.

    """

    wanted: FloatArray
    scale: FloatArray

    def cost(self, matrix: FloatArray) -> float:
        """Return - log det of the information about the wanted ones, the others being fitted."""
        return self.smooth(matrix)[0]

    def smooth(self, matrix: FloatArray) -> tuple[float, FloatArray]:
        """Return the cost and its gradient by the matrix."""
        count = int(np.count_nonzero(self.wanted))
        scaled = matrix * np.outer(self.scale, self.scale)
        sign, whole = np.linalg.slogdet(scaled)
        if sign <= 0:
            return float(np.inf), np.zeros_like(matrix)
        gradient = -np.linalg.inv(scaled)
        rest = np.flatnonzero(~np.asarray(self.wanted, dtype=bool))
        nuisance = 0.0
        if len(rest):
            block = scaled[np.ix_(rest, rest)]
            nuisance = float(np.linalg.slogdet(block)[1])
            gradient[np.ix_(rest, rest)] += np.linalg.inv(block)
        wanted_scale = self.scale[np.asarray(self.wanted, dtype=bool)]
        cost = (-(whole - nuisance) + 2.0 * np.sum(np.log(wanted_scale))) / count
        return float(cost), gradient * np.outer(self.scale, self.scale) / count


@dataclass(frozen=True)
class RivalCriterion:
    """
    T-optimality: make the torque that a rival model cannot explain as large as possible.

    The information matrix is over the columns of the rival and those of what it lacks.
    Source: Atkinson and Fedorov 1975, for models linear in their parameters.

    Attributes
    ----------
    rival : ndarray of bool, shape (r,)
        True for the columns that the rival can use.
    values : ndarray, shape (r,)
        Parameters of what the rival lacks; zero for its own columns.

    """

    rival: FloatArray
    values: FloatArray

    def cost(self, matrix: FloatArray) -> float:
        """Return - log of the sum of squares, in noise units, that the rival leaves."""
        return self.smooth(matrix)[0]

    def smooth(self, matrix: FloatArray) -> tuple[float, FloatArray]:
        """Return the cost and its gradient by the matrix."""
        own = np.flatnonzero(self.rival)
        direction = np.array(self.values, dtype=float)
        direction[own] -= _best_fit(matrix[np.ix_(own, own)], matrix[own] @ direction)
        power = float(direction @ matrix @ direction)
        if power <= 0.0:
            return float(np.inf), np.zeros_like(matrix)
        return float(-np.log(power)), -np.outer(direction, direction) / power


def _best_fit(block: FloatArray, reach: FloatArray) -> FloatArray:
    """
    Solve the normal equations, also where a motion does not tell all columns apart.

    An arm of one joint that moves with one frequency has fewer independent columns than others.

    """
    size = np.sqrt(np.maximum(np.diag(block), 0.0))
    unit = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
    values, vectors = np.linalg.eigh(block * np.outer(unit, unit))
    seen = values > _BLIND
    along = vectors[:, seen]
    return np.asarray(unit * (along @ ((along.T @ (unit * reach)) / values[seen])))


Criterion = SpectralCriterion | SubsetCriterion | RivalCriterion
