# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Convex program of a physically consistent fit.

    minimise  |A theta - z|^2 / (2 N)  +  sum over links of  (w D(P || P0) + c (m / m0 - 1)^2 / 2)

over standard parameters theta with every link's pseudo-inertia P positive definite, effects
within their bounds, and known limits of masses and shapes. P0 and m0 are the prior pseudo-inertia
and mass of a link. D is the divergence of the log-determinant,

    D(P || P0) = log det P0 - log det P + tr(P0^-1 P) - 4,

which is convex in the parameters and grows without bounds towards impossible inertias. It does not
depend on frames or units, so masses and moments of inertia need no relative weights.
Source: Lee, Wensing and Park 2020, section IV; the pseudo-inertia, Wensing, Kim and Slotine 2018.
The solver is an interior-point method in coordinates in which every P0 is the identity.

"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Any

from armid_ros.errors import IdentificationError
from armid_ros.estimate import ParameterName
from armid_ros.model import BaseParameters, LINK_PARAMETERS
from armid_ros.model.pseudo_inertia import link_parameters, pseudo_inertia
from armid_ros.motion import FloatArray
from armid_ros.robots.robot import PER_LINK
import clarabel
import numpy as np
from scipy import sparse

#: Numbers of variables of a log-determinant: a triangle, then the logarithms of its diagonal.
_TRIANGLE, _DIAGONAL = 10, 4
_LOG_DETERMINANT = _TRIANGLE + _DIAGONAL

Box = tuple[FloatArray, FloatArray]


@dataclass(frozen=True)
class PhysicalProgram:
    """
    Convex program for physically consistent links: constraints and prior, without data.

    Attributes
    ----------
    base : BaseParameters
        Grouping of P standard parameters, 10 n rigid ones first.
    prior : ndarray, shape (P,)
        Standard parameters of the description, with physically consistent links.
    lower, upper : ndarray, shape (P - 10 n,)
        Bounds of the effects.
    total_mass : float or None
        Mass of all links together [kg].
    boxes : mapping of int to (ndarray, ndarray)
        Box that contains a link (0 is the first): two corners in the joint frame [m].
    mass_range : float or None
        Largest ratio between the mass of a link and its prior mass.

    """

    base: BaseParameters
    prior: FloatArray
    lower: FloatArray
    upper: FloatArray
    total_mass: float | None
    boxes: Mapping[int, Box]
    mass_range: float | None = None

    @property
    def n_links(self) -> int:
        """Return the number of links n."""
        return (len(self.prior) - len(self.lower)) // PER_LINK

    def solve(self, products: FloatArray, count: float, weight: float) -> FloatArray:
        """
        Return the standard parameters that minimise the cost under the constraints.

        Parameters
        ----------
        products : ndarray, shape (r + 1, r + 1)
            Products of the weighted base columns and torque with each other.
        count : float
            Number N of weighted rows in the products.
        weight : float
            Weight w of the divergence, positive.

        Returns
        -------
        ndarray, shape (P,)
            Standard parameters.

        Raises
        ------
        IdentificationError
            If no parameters satisfy the constraints.

        """
        # weight c of the prior mass of a link: a mass three times as large must reduce the squared
        # residual by 0.2 %
        mass_weight = 1e-3
        rank, size, rigid = self.base.rank, len(self.prior), len(self.prior) - len(self.lower)
        information = self.base.grouping.T @ (products[:rank, :rank] / count) @ self.base.grouping
        lengths = np.sqrt(np.diag(information)[rigid:])
        # linear map to theta from symmetric matrices (the identity is the prior) and effects
        change = np.diag(
            np.concatenate([np.zeros(rigid), 1.0 / np.where(lengths > 0.0, lengths, 1.0)])
        )
        change[:rigid, :rigid] = self._whitened_links
        origin = np.concatenate([np.zeros(rigid), self.prior[rigid:]])
        aim = self.base.grouping.T @ products[:rank, rank] / count - information @ origin

        variables = size + _LOG_DETERMINANT * self.n_links
        hessian = np.zeros((variables, variables))
        hessian[:size, :size] = change.T @ information @ change
        # prior of effects in directions without data
        hessian[range(rigid, size), range(rigid, size)] += 1e-9
        identity = [float(i == j) for j in range(4) for i in range(j + 1)]
        gradient = np.zeros(variables)
        gradient[:size] = -change.T @ aim
        gradient[:rigid] += weight * np.tile(identity, self.n_links)
        for link in range(self.n_links):
            first = size + _LOG_DETERMINANT * link  # variable of the link's log-determinant
            gradient[first + _TRIANGLE : first + _LOG_DETERMINANT] = -weight
            mass = change[PER_LINK * link] / self.prior[PER_LINK * link]  # relative to the prior
            hessian[:size, :size] += mass_weight * np.outer(mass, mass)
            gradient[:size] -= mass_weight * mass
        rows, offsets, cones = self._constraints(change, origin)
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        solution = clarabel.DefaultSolver(
            sparse.triu(hessian, format='csc'), gradient, rows, offsets, cones, settings
        ).solve()
        if str(solution.status) not in ('Solved', 'AlmostSolved'):
            raise IdentificationError(
                f'no physically consistent links fit: the solver ended with {solution.status}; '
                'check whether total mass and --box of the links contradict each other'
            )
        theta = origin + change @ np.array(solution.x[:size])
        theta[rigid:] = np.clip(theta[rigid:], self.lower, self.upper)
        return np.asarray(theta)

    @cached_property
    def _whitened_links(self) -> FloatArray:
        """Linear map to inertial parameters from coordinates in which priors are identity."""
        blocks = []
        for link in range(self.n_links):
            values = self.prior[PER_LINK * link : PER_LINK * (link + 1)]
            root = np.linalg.cholesky(pseudo_inertia(values))
            # symmetric matrices of a stacked triangle, off-diagonals times sqrt 2
            units = np.zeros((PER_LINK, 4, 4))
            for i, j in combinations_with_replacement(range(4), 2):
                share = 1.0 if i == j else np.sqrt(0.5)
                units[_packed(i, j), i, j] = units[_packed(i, j), j, i] = share
            blocks.append(link_parameters(root @ units @ root.T).T)
        return np.asarray(sparse.block_diag(blocks).toarray())

    def _constraints(
        self, change: FloatArray, origin: FloatArray
    ) -> tuple[sparse.csc_matrix, FloatArray, list[Any]]:
        """Return the constraints b - A x in K: matrix A, vector b and cones K."""
        size, rigid = len(self.prior), len(self.prior) - len(self.lower)
        unit = np.eye(size)
        # conditions on theta: the vector normal @ theta + offset is inside a cone
        conditions: list[tuple[Any, FloatArray, FloatArray]] = []
        if self.total_mass is not None:
            masses = unit[:rigid:PER_LINK].sum(axis=0, keepdims=True)
            conditions.append((clarabel.ZeroConeT, masses, np.array([-self.total_mass])))
        for sign, bound in ((1.0, self.lower), (-1.0, self.upper)):
            finite = np.isfinite(bound)
            normal, offset = sign * unit[rigid:][finite], -sign * bound[finite]
            conditions.append((clarabel.NonnegativeConeT, normal, offset))
        if self.mass_range is not None:
            mass, described = unit[:rigid:PER_LINK], self.prior[:rigid:PER_LINK]
            conditions += [
                (clarabel.NonnegativeConeT, mass, -described / self.mass_range),
                (clarabel.NonnegativeConeT, -mass, described * self.mass_range),
            ]
        for link, box in self.boxes.items():
            normal = np.zeros((9, size))
            normal[:, PER_LINK * link : PER_LINK * (link + 1)] = box_conditions(box)
            conditions.append((clarabel.NonnegativeConeT, normal, np.zeros(9)))
        rows, offset, others = self._log_determinants
        blocks, offsets, cones = [], [], []
        for cone, normal, own in conditions:
            if len(normal):
                side = sparse.csr_matrix((len(normal), _LOG_DETERMINANT * self.n_links))
                blocks.append(sparse.hstack([-sparse.csr_matrix(normal @ change), side]))
                offsets.append(normal @ origin + own)
                cones.append(cone(len(normal)))
        matrix = sparse.vstack([*blocks, rows], format='csc')
        return matrix, np.concatenate([*offsets, offset]), [*cones, *others]

    @cached_property
    def _log_determinants(self) -> tuple[sparse.spmatrix, FloatArray, list[Any]]:
        """Constraints sum(u) <= log det X on variables u and links' whitened pseudo-inertias X."""
        # X >= Z diag(Z)^-1 Z' for a lower triangle Z, and u <= log of its diagonal (Ben-Tal and
        # Nemirovski 2001, section 4.2): 36 rows of a matrix, then an exponential per diagonal
        height = 36 + 3 * _DIAGONAL
        inertia, triangle = np.zeros((height, PER_LINK)), np.zeros((height, _LOG_DETERMINANT))
        np.fill_diagonal(inertia, -1.0)
        lower = [(i, j) for j in range(4) for i in range(j, 4)]
        for index, (i, j) in enumerate(lower):
            triangle[_packed(i, 4 + j), index] = -np.sqrt(2.0)
            if i == j:
                triangle[_packed(4 + j, 4 + j), index] = -1.0
                triangle[36 + 3 * j + 2, index] = -1.0
                triangle[36 + 3 * j, _TRIANGLE + j] = -1.0
        links, effects = (
            sparse.eye(self.n_links),
            np.zeros((height * self.n_links, len(self.lower))),
        )
        parts = [sparse.kron(links, inertia), effects, sparse.kron(links, triangle)]
        offset = np.concatenate([np.zeros(36), np.tile([0.0, 1.0, 0.0], _DIAGONAL)])
        cones = [clarabel.PSDTriangleConeT(8), *[clarabel.ExponentialConeT()] * _DIAGONAL]
        return sparse.hstack(parts), np.tile(offset, self.n_links), cones * self.n_links


def nearest_body(values: FloatArray, covariance: FloatArray) -> FloatArray:
    """
    Return the most likely inertial parameters (10,) of a body of positive density.

    Parameters
    ----------
    values : ndarray, shape (10,)
        Estimated inertial parameters, with a positive mass.
    covariance : ndarray, shape (10, 10)
        Their covariance.

    """
    mass, center = values[0], values[1:4] / values[0]
    ball = np.diag([0.05**2] * 3 + [1.0])  # prior with a radius of gyration of 0.05 m
    ball[:3, :3] += np.outer(center, center)
    ball[:3, 3] = ball[3, :3] = center
    none, names = np.empty(0), tuple(ParameterName(name, '', '') for name in LINK_PARAMETERS)
    base = BaseParameters(names, names, np.arange(PER_LINK), np.eye(PER_LINK))
    program = PhysicalProgram(base, link_parameters(mass * ball), none, none, None, {})
    precision = np.linalg.inv(covariance)
    products = np.column_stack([precision, precision @ values])
    # the divergence has a hundredth of the weight of a squared standardised error
    return program.solve(products, 1.0, 0.01)


def box_conditions(box: Box) -> FloatArray:
    """
    Return linear conditions on a link's ten inertial parameters: its mass is inside a box.

    The centre of mass and all mass are between the corners: along every axis, the integral of
    (x - lower) (upper - x) dm is not negative.

    Returns
    -------
    ndarray, shape (9, 10)
        Matrix whose product with the inertial parameters is not negative.

    """
    lower, upper = box
    rows = np.zeros((9, PER_LINK))
    units = pseudo_inertia(np.eye(PER_LINK))
    mass, moments = units[:, 3, 3], units[:, :3, 3]
    for axis in range(3):
        rows[axis] = moments[:, axis] - lower[axis] * mass
        rows[3 + axis] = upper[axis] * mass - moments[:, axis]
        rows[6 + axis] = (
            (lower[axis] + upper[axis]) * moments[:, axis]
            - lower[axis] * upper[axis] * mass
            - units[:, axis, axis]
        )
    return rows


def _packed(i: int, j: int) -> int:
    """Return the index of entry (i, j) of an upper triangle whose columns are stacked."""
    return j * (j + 1) // 2 + i
