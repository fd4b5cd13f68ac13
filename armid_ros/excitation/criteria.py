# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How much a motion tells about the parameters.

With W the regressor of the base parameters, every row divided by the standard deviation of its
joint's torque noise, the information matrix is W' W and its inverse the covariance of the
weighted least-squares estimate.

"""

from __future__ import annotations

from dataclasses import dataclass

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
}


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

    def plus(self, prior: FloatArray | None) -> Information:
        """Return the information with that of other motions, shape (r, r), added."""
        if prior is None:
            return self
        prior = np.asarray(prior, dtype=float)
        if prior.shape != self.matrix.shape:
            raise TrajectoryError(
                f'prior information of shape {prior.shape} for {len(self.parameters)} parameters; '
                f'it has to be {self.matrix.shape}, over the same base parameters'
            )
        return Information(self.parameters, self.matrix + prior, self.scale)

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

    @property
    def std(self) -> FloatArray:
        """Predicted standard deviation of each parameter, shape (r,); inf where not seen."""
        diagonal = np.sqrt(np.diag(self.matrix))
        seen = diagonal > 0.0
        std = np.full(len(diagonal), np.inf)
        scaled = self.matrix[np.ix_(seen, seen)] / np.outer(diagonal[seen], diagonal[seen])
        values, vectors = np.linalg.eigh(scaled)
        with np.errstate(divide='ignore', invalid='ignore'):
            variance = (vectors**2 / np.where(values > 1e-15, values, 0.0)).sum(axis=1)
        std[seen] = np.sqrt(np.nan_to_num(variance, nan=np.inf)) / diagonal[seen]
        return std

    def cost(self, criterion: str) -> float:
        """
        Return the number a design makes small.

        Parameters
        ----------
        criterion : str
            'D': -log det / r. 'A': log of the mean variance in units of ``scale``. 'E': log of
            the largest variance in any direction. 'condition': log of the condition number.

        """
        if criterion == 'D':
            return -self.log_det / len(self.parameters)
        if criterion == 'condition':
            return float(np.log(self.condition))
        scaled = self.matrix * np.outer(self.scale, self.scale)
        values = np.linalg.eigvalsh(scaled)
        if values[0] <= 0.0:
            return float(np.inf)
        if criterion == 'A':
            return float(np.log(np.mean(1.0 / values)))
        if criterion == 'E':
            return float(-np.log(values[0]))
        raise TrajectoryError(f"no criterion '{criterion}'; there are {', '.join(CRITERIA)}")
