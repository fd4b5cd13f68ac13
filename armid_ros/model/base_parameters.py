# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Base parameters: the identifiable combinations of standard parameters.

The columns of a regressor are linearly dependent. In a chosen order, each column in the span of
the kept columns is dropped, and its parameter is grouped with the parameters of these columns.
The results are the groupings of Gautier (1991), such as 'Ixx2 - Iyy2'. The method is a QR
factorisation; the length of each column outside the span of the kept columns reveals the rank.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
from string import digits

from armid_ros.estimate import ParameterName
from armid_ros.motion import FloatArray, read_only
from armid_ros.robots import NO_MASS, Robot
import numpy as np
import numpy.typing as npt

#: Length of a unit column outside the span of the kept columns, below which it is dependent.
#: Rounding gives dependent columns 1e-15 to 1e-13; independent columns rarely have below 1e-5.
RANK_TOLERANCE = 1e-9

#: Order in which the parameters of a link are kept: inertia first, mass last. Masses are then
#: grouped with moments, and moments of later links with those of earlier links.
_KEEP_ORDER = ('Ixx', 'Ixy', 'Ixz', 'Iyy', 'Iyz', 'Izz', 'mx', 'my', 'mz', 'm')


@dataclass(frozen=True)
class BaseParameters:
    """
    Identifiable linear combinations of the standard parameters, with expressions as names.

    Attributes
    ----------
    standard : tuple of ParameterName
        P standard parameters, the columns of the full regressor W.
    parameters : tuple of ParameterName
        r base parameters; the names are expressions such as 'Izz1 + Iyy2 + 0.12 (m3 + m4)'.
    independent : ndarray of int, shape (r,)
        Columns of W that are kept: W theta = W[:, independent] beta.
    grouping : ndarray, shape (r, P)
        Matrix from standard to base parameters: beta = grouping @ theta.

    """

    standard: tuple[ParameterName, ...]
    parameters: tuple[ParameterName, ...]
    independent: npt.NDArray[np.intp]
    grouping: FloatArray

    @property
    def rank(self) -> int:
        """Number r of base parameters."""
        return len(self.parameters)

    @property
    def terms(self) -> tuple[dict[str, float], ...]:
        """Factors of the standard parameters in each base parameter, as a mapping from names."""
        symbols = [symbol(parameter) for parameter in self.standard]
        return tuple(
            {symbols[column]: float(row[column]) for column in np.flatnonzero(row)}
            for row in self.grouping
        )

    def among(
        self, standard: tuple[ParameterName, ...], columns: npt.NDArray[np.intp]
    ) -> BaseParameters:
        """
        Express the base parameters in terms of a longer list of standard parameters.

        Parameters
        ----------
        standard : tuple of ParameterName
            The longer list; its added parameters have the factor 0.
        columns : ndarray of int, shape (P,)
            Positions of the present standard parameters in the longer list.

        """
        grouping = np.zeros((self.rank, len(standard)))
        grouping[:, columns] = self.grouping
        independent = columns[self.independent]
        return BaseParameters(standard, self.parameters, independent, read_only(grouping))

    def values(self, theta: npt.ArrayLike) -> FloatArray:
        """Compute the base parameters (r,) from standard parameters theta (P,)."""
        return np.asarray(self.grouping @ np.asarray(theta, dtype=float))

    def lift(self, beta: npt.ArrayLike, prior: npt.ArrayLike) -> FloatArray:
        """
        Return the standard parameters nearest to a prior, for given base parameters beta.

        Parameters
        ----------
        beta : array_like, shape (r,)
            Base parameters.
        prior : array_like, shape (P,)
            Standard parameters of the prior, such as those of the URDF.

        Returns
        -------
        ndarray, shape (P,)
            The minimum-norm correction of the prior; grouping @ result = beta.

        """
        prior = np.array(prior, dtype=float)
        masses = [parameter.name.rstrip(digits) == 'm' for parameter in self.standard]
        # assumed mass of a link without described mass, so that first moments are possible [kg]
        prior[masses & (np.abs(prior) < NO_MASS)] = 1e-6
        correction = np.linalg.pinv(self.grouping) @ (np.asarray(beta) - self.values(prior))
        return np.asarray(prior + correction)


def group_columns(
    w: FloatArray, standard: tuple[ParameterName, ...], tolerance: float = RANK_TOLERANCE
) -> BaseParameters:
    """
    Group linearly dependent columns of a regressor; return the base parameters.

    Parameters
    ----------
    w : ndarray, shape (M, P)
        Regressor over states that excite all parameters, M >= P.
    standard : tuple of ParameterName
        Names of the P columns. Earlier columns are kept in preference to later ones; within a
        link, inertia is kept first and mass last.
    tolerance : float
        Share of a column's length outside the span of the kept columns, below which the column is
        grouped.

    Returns
    -------
    BaseParameters
        Identifiable combinations.

    """
    order = []  # sorting key of each column
    for position, parameter in enumerate(standard):
        name = parameter.name.rstrip(digits)
        number = parameter.name[len(name) :]
        of_link = name in _KEEP_ORDER and number
        order.append(
            (int(number), _KEEP_ORDER.index(name)) if of_link else (len(standard), position)
        )
    scale = np.linalg.norm(w, axis=0)
    seen = scale > RANK_TOLERANCE * scale.max(initial=1e-300)
    candidates = sorted(np.flatnonzero(seen).tolist(), key=order.__getitem__)
    triangle = np.asarray(np.linalg.qr(w[:, candidates] / scale[candidates], mode='r'))

    basis = np.empty((len(triangle), 0))
    kept: list[int] = []
    for position in range(len(candidates)):
        rest = triangle[:, position]
        for _ in range(2):  # two passes give orthogonality to rounding errors (Kahan, Parlett)
            rest = rest - basis @ (basis.T @ rest)
        length = np.linalg.norm(rest)
        if length > tolerance:
            basis = np.column_stack([basis, rest / length])
            kept.append(position)
    rank = len(kept)
    dependent = [position for position in range(len(candidates)) if position not in kept]
    grouping = np.zeros((rank, len(standard)))
    independent = np.array([candidates[position] for position in kept], dtype=np.intp)
    grouping[np.arange(rank), independent] = 1.0
    if dependent and kept:
        coefficients = np.linalg.lstsq(triangle[:, kept], triangle[:, dependent], rcond=None)[0]
        columns = [candidates[position] for position in dependent]
        grouping[:, columns] = coefficients * scale[columns] / scale[independent][:, np.newaxis]
    return _named(standard, independent, grouping)


def regroup(theory: BaseParameters, data: BaseParameters) -> BaseParameters:
    """
    Return the base parameters identified by data, in terms of all standard parameters.

    Parameters
    ----------
    theory : BaseParameters
        Combinations that are identifiable with a suitable motion.
    data : BaseParameters
        Combinations of these combinations that the data identify. Its standard parameters are the
        parameters that `theory` keeps.

    """
    independent = theory.independent[data.independent]
    return _named(theory.standard, independent, data.grouping @ theory.grouping)


def _named(
    standard: tuple[ParameterName, ...], independent: npt.NDArray[np.intp], grouping: FloatArray
) -> BaseParameters:
    """Name the base parameters of a grouping matrix (r, P), and remove rounding errors."""
    grouping = np.where(np.abs(grouping) < RANK_TOLERANCE, 0.0, grouping)
    parameters = tuple(
        replace(standard[leader], name=_expression(row, leader, standard))
        for row, leader in zip(grouping, independent, strict=True)
    )
    return BaseParameters(standard, parameters, independent, read_only(grouping))


def levelled(robot: Robot) -> Robot:
    """
    Return the robot with gravity components below 0.2 % of gravity set to zero.

    Components of gravity below 0.2 %, across the axes of the first joint, become zero. A hanging
    base with a rounded angle of 3.1416 excites first moments by 7e-6 of their weight, far below
    the noise.

    """
    turn = robot.model.jointPlacements[1].rotation
    own = turn.T @ robot.gravity
    across = np.abs(own) < 2e-3 * np.linalg.norm(own)
    return robot.with_gravity(turn @ np.where(across, 0.0, own)) if np.any(own[across]) else robot


def symbol(parameter: ParameterName) -> str:
    """Return a parameter's name with link number or joint: 'm2', or 'torque_offset[elbow]'."""
    numbered = parameter.name[-1:].isdigit() or not parameter.joint
    return parameter.name if numbered else f'{parameter.name}[{parameter.joint}]'


def _expression(row: FloatArray, leader: int, standard: tuple[ParameterName, ...]) -> str:
    """Format a linear combination of parameters, such as 'Izz1 + 0.25 (m2 + m3)'."""
    text = standard[leader].name
    factors: dict[float, list[tuple[float, str]]] = {}
    # angles rounded to four digits make factors of 4e-6
    for column in np.flatnonzero(np.abs(row) >= 1e-5):
        if column != leader:
            factor = float(f'{abs(row[column]):.6g}')
            sign = float(np.sign(row[column]))
            factors.setdefault(factor, []).append((sign, symbol(standard[column])))
    for factor, terms in factors.items():
        if factor == 1.0:  # noqa: RUF069 - rounded to six digits
            text += ''.join(f' {"+" if sign > 0 else "-"} {name}' for sign, name in terms)
            continue
        lead = terms[0][0]
        inner = terms[0][1] + ''.join(
            f' {"+" if sign * lead > 0 else "-"} {name}' for sign, name in terms[1:]
        )
        inner = f'({inner})' if len(terms) > 1 else inner
        text += f' {"+" if lead > 0 else "-"} {factor:g} {inner}'
    return text
