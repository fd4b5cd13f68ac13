# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The pseudo-inertia matrix of a link, and the physical consistency of inertial parameters.

Ten inertial parameters belong to a body of positive density if and only if the 4x4 matrix P =
[[S, h], [h', m]] is positive definite. S is the second moment of the mass about the origin of
the joint frame, h the first moment, m the mass. This condition implies positive mass, positive
principal moments and their triangle inequalities.
Source: Wensing, Kim and Slotine 2018, eqs. 9 to 13.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray, read_only
from armid_ros.robots import NO_MASS
from armid_ros.robots.robot import PER_LINK
import numpy as np
import numpy.typing as npt
import pinocchio as pin

#: Pseudo-inertia of each unit parameter, since a pseudo-inertia is linear in the ten parameters.
BASIS = read_only(
    [pin.PseudoInertia.FromDynamicParameters(unit).toMatrix() for unit in np.eye(PER_LINK)]
)


def pseudo_inertia(parameters: npt.ArrayLike) -> FloatArray:
    """
    Return the 4 x 4 pseudo-inertia matrix of one or several links.

    Parameters
    ----------
    parameters : array_like, shape (..., 10)
        Mass [kg], first moments [kg m] and inertia about the joint frame [kg m^2], in the order
        of ``LINK_PARAMETERS``.

    Returns
    -------
    ndarray, shape (..., 4, 4)
        Second moments [kg m^2], first moments [kg m] and mass [kg].

    """
    return np.asarray(np.tensordot(np.asarray(parameters, dtype=float), BASIS, axes=(-1, 0)))


def link_parameters(matrix: npt.ArrayLike) -> FloatArray:
    """
    Return the ten inertial parameters of a pseudo-inertia; inverse of `pseudo_inertia`.

    Parameters
    ----------
    matrix : array_like, shape (..., 4, 4)
        Symmetric pseudo-inertias.

    Returns
    -------
    ndarray, shape (..., 10)

    """
    p = np.asarray(matrix, dtype=float)
    second = p[..., :3, :3]
    inertia = np.trace(second, axis1=-2, axis2=-1)[..., np.newaxis, np.newaxis] * np.eye(3)
    inertia = inertia - second
    rows, columns = [0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]
    return np.concatenate([p[..., 3, 3:], p[..., :3, 3], inertia[..., rows, columns]], axis=-1)


@dataclass(frozen=True)
class Consistency:
    """
    Mass properties of a link that show whether its parameters are physically consistent.

    Attributes
    ----------
    link : str
        Name of the link.
    eigenvalues : ndarray, shape (4,)
        Eigenvalues of the pseudo-inertia, ascending. Only their signs have a meaning, as the
        matrix has kg m^2 and kg.
    mass : float
        Mass [kg].
    center : ndarray, shape (3,)
        Centre of mass in the joint frame [m]; NaN without mass.
    moments : ndarray, shape (3,)
        Principal moments about the centre of mass, ascending [kg m^2]; NaN without mass.

    """

    link: str
    eigenvalues: FloatArray
    mass: float
    center: FloatArray
    moments: FloatArray

    @staticmethod
    def of(link: str, parameters: npt.ArrayLike) -> Consistency:
        """Compute the mass properties from the ten inertial parameters of a link."""
        matrix = pseudo_inertia(parameters)
        mass = float(matrix[3, 3])
        center = moments = np.full(3, np.nan)
        if abs(mass) >= NO_MASS:
            center = matrix[:3, 3] / mass
            second = matrix[:3, :3] - mass * np.outer(center, center)
            moments = np.asarray(np.linalg.eigvalsh(np.trace(second) * np.eye(3) - second))
        return Consistency(
            link, np.asarray(np.linalg.eigvalsh(matrix)), mass, np.asarray(center), moments
        )

    @property
    def consistent(self) -> bool:
        """Whether a body of positive density can have these inertial parameters."""
        return bool(self.eigenvalues[0] > 0.0)


def require_consistent(links: tuple[str, ...], parameters: npt.ArrayLike) -> None:
    """
    Raise ModelError if the inertial parameters of a link are not physically consistent.

    Parameters
    ----------
    links : tuple of str
        Names of the n links.
    parameters : array_like, shape (10 n,)
        Inertial parameters of the links.

    Raises
    ------
    ModelError
        If a link is not physically consistent; the message names the first such link.

    """
    for link, values in zip(links, np.reshape(parameters, (-1, PER_LINK)), strict=True):
        found = Consistency.of(link, values)
        if not found.consistent:
            raise ModelError(
                f"link '{link}': no body can have these inertial parameters (mass "
                f'{found.mass:.4g} kg, smallest eigenvalue of the pseudo-inertia '
                f'{found.eigenvalues[0]:.3g}); use identify(..., physical=True) or armid identify '
                '--physical'
            )
