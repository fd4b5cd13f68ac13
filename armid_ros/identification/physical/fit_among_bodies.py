# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Least squares of torques, constrained to physically consistent links.

The constraints are part of the fit. A projection of an unconstrained estimate on the nearest
consistent parameters would increase the torque error. Parameters that the data do not determine
come from the description. The weight of the description is chosen by cross-validation with blocks
of the training data.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.estimate import ParameterName
from armid_ros.identification.fitting.identifiability import bounds
from armid_ros.identification.fitting.least_squares import informative_solution, Method, solve
from armid_ros.identification.fitting.nonlinear import agree, FittedValues, linearised, torques
from armid_ros.identification.physical.physical_program import Box, box_conditions, PhysicalProgram
from armid_ros.identification.rows.regression import weighted_rows
from armid_ros.identification.rows.signals import Conditioning, TORQUE_RESOLUTION
from armid_ros.model import BaseParameters
from armid_ros.model.pseudo_inertia import Consistency, link_parameters, pseudo_inertia
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.robots.robot import PER_LINK
import numpy as np
import scipy.linalg

#: Ratio of a pseudo-inertia to its prior in some direction below which a link is at the limit of
#: physical consistency; relative distance below which a link is at a wall of its box.
_ACTIVE_SHARE = 1e-3
#: Thickness of a link over its length, below which a described inertia is doubtful.
THINNEST = 0.05


@dataclass(frozen=True)
class PhysicalSettings:
    """
    Known masses and shapes of links, which constrain a physically consistent fit.

    Attributes
    ----------
    total_mass : float or None
        Total mass of the moving links [kg], from a scale for example.
    boxes : mapping of str to (sequence of float, sequence of float)
        Box that contains the link of a joint: two corners in the joint frame [m].
    mass_range : float or None
        Largest ratio between the mass of a link and the described one, above 1.

    """

    total_mass: float | None = None
    boxes: Mapping[str, tuple[Sequence[float], Sequence[float]]] = field(default_factory=dict)
    mass_range: float | None = None

    def __post_init__(self) -> None:
        """Raise an error for a total mass, mass ratio or box that no links can have."""
        if self.total_mass is not None and not 0.0 < self.total_mass < np.inf:
            raise IdentificationError(
                f'the total mass of the links, {self.total_mass} kg, has to be positive'
            )
        if self.mass_range is not None and not 1.0 < self.mass_range < np.inf:
            raise IdentificationError(
                f'the largest ratio of a mass to the described mass, {self.mass_range:g}, has to '
                'be a finite factor above 1'
            )
        for joint, (lower, upper) in self.boxes.items():
            if len(lower) != 3 or len(upper) != 3 or not np.all(np.less(lower, upper)):
                raise IdentificationError(
                    f"box of joint '{joint}': its lower corner {tuple(lower)} has to be below its "
                    f'upper corner {tuple(upper)} along x, y and z'
                )


@dataclass(frozen=True)
class PhysicalCertificate:
    """
    Proof of physically consistent links, and the torque error that the constraints add.

    Attributes
    ----------
    links : tuple of Consistency
        Eigenvalues of the pseudo-inertia, mass, centre and principal moments of each link.
    shares : ndarray, shape (n,)
        Smallest ratio of each pseudo-inertia to its prior, over all directions.
    at_bound : tuple of ParameterName
        Effect parameters at their bounds.
    at_wall : tuple of str
        Joints whose link is at the limit of its box, with the side.
    total_mass : float or None
        Given sum of the masses [kg].
    weight : float
        Weight of the prior.
    tried : tuple of (float, float)
        Compared weights of the prior, with held-out errors relative to unconstrained fits.
    misfit_ratio : float
        Weighted error on the training data, relative to the unconstrained fit's.
    notes : tuple of str
        Assumptions on links without a body in the description.
    at_mass : tuple of str
        Links at the lower or upper limit of their mass.

    """

    links: tuple[Consistency, ...]
    shares: FloatArray
    at_bound: tuple[ParameterName, ...]
    at_wall: tuple[str, ...]
    total_mass: float | None
    weight: float
    tried: tuple[tuple[float, float], ...]
    misfit_ratio: float
    notes: tuple[str, ...]
    at_mass: tuple[str, ...] = ()

    @property
    def consistent(self) -> bool:
        """Whether every link is physically consistent."""
        return all(link.consistent for link in self.links)

    @property
    def held_out_ratio(self) -> float:
        """Ratio of held-out torque errors: with constraints over without constraints."""
        return dict(self.tried)[self.weight]

    @property
    def cost(self) -> float:
        """Relative torque error added by constraints: the larger of training and held-out data."""
        return max(self.misfit_ratio, self.held_out_ratio) - 1.0

    @property
    def active(self) -> tuple[str, ...]:
        """Links that are at the limit of physical consistency."""
        near = self.shares < _ACTIVE_SHARE
        return tuple(link.link for link, at in zip(self.links, near, strict=True) if at)

    @property
    def constraint_notes(self) -> tuple[str, ...]:
        """Notes on constraints that change the fit or raise its torque error."""
        notes = []
        # held-out torque error, relative to an unconstrained fit, above which the constraints do
        # not fit the arm
        if self.held_out_ratio > 1.03:
            given = self.total_mass is not None or self.at_wall or self.at_mass
            notes.append(
                'the physical constraints increase the torque error on held-out blocks by '
                f'{100.0 * (self.held_out_ratio - 1.0):.1f} %: '
                f'{"a given mass or box is wrong, or " * bool(given)}the model lacks an effect'
            )
        if self.active:
            notes.append(
                f'links at the limit of physical consistency: {", ".join(self.active)}; the model '
                'lacks an effect there, or the data are poor'
            )
        if self.at_wall:
            notes.append(f'links at the limit of their box: {", ".join(self.at_wall)}')
        if self.at_mass:
            notes.append(f'links at the limit of their mass: {", ".join(self.at_mass)}')
        if self.total_mass is not None:
            notes.append(f'the masses add up to {self.total_mass:g} kg, as given')
        if self.at_bound:
            names = ', '.join(f'{p.words} of {p.joint}' for p in self.at_bound)
            notes.append(f'parameters at their bounds: {names}')
        return tuple(notes)

    def document(self) -> dict[str, Any]:
        """Return the certificate as written to identification.json."""
        return {
            'consistent': self.consistent,
            'links': [
                {
                    'link': link.link,
                    'eigenvalues': link.eigenvalues.tolist(),
                    'mass': link.mass,
                    'center': link.center.tolist(),
                    'principal_moments': link.moments.tolist(),
                    'share_of_prior': float(share),
                    'at_limit': link.link in self.active,
                }
                for link, share in zip(self.links, self.shares, strict=True)
            ],
            'at_bound': [{'name': p.name, 'joint': p.joint} for p in self.at_bound],
            'at_wall': list(self.at_wall),
            'at_mass': list(self.at_mass),
            'total_mass': self.total_mass,
            'prior_weight': self.weight,
            'tried': [{'weight': w, 'held_out_ratio': ratio} for w, ratio in self.tried],
            'training_ratio': self.misfit_ratio,
            'held_out_ratio': self.held_out_ratio,
        }


def fit_consistent_links(
    arm: ArmModel,
    free: FittedValues,
    recordings: Sequence[Recording],
    used: Conditioning,
    method: Method,
    settings: PhysicalSettings,
) -> tuple[FittedValues, PhysicalCertificate]:
    """
    Fit physically consistent links, starting from an unconstrained fit; return a certificate too.

    Parameters
    ----------
    arm : ArmModel
        Model as described, the prior of the links.
    free : FittedValues
        Fit without constraints.
    recordings : sequence of Recording
        Training data.
    used : Conditioning
        Filters.
    method : {'ols', 'wls', 'irls'}
        See ``solve``.
    settings : PhysicalSettings
        Known masses and shapes.

    Returns
    -------
    fit : FittedValues
        Fit with physically consistent links; the covariance is that of the data alone.
    certificate : PhysicalCertificate
        Evidence of physical consistency.

    """
    fit, certificate = _fit_links(arm, free, settings)
    if free.passes == 1:
        return fit, certificate
    for passes in range(1, 8):
        linear = tuple(part.torque(fit.values) for part in fit.problem)
        problem, predicted = linearised(fit.arm, fit.base, recordings, used)
        fit = replace(fit, predicted=predicted, passes=free.passes + passes)
        if agree(fit.problem, fit.solution.weights, linear, predicted):
            return replace(fit, converged=free.converged), certificate
        solution = solve(problem, method, bounds(fit.arm, fit.base))
        fit = replace(fit, problem=problem, solution=solution)
        fit, certificate = _fit_links(arm, fit, settings)
    predicted = torques(fit.arm, recordings, used)
    return replace(fit, predicted=predicted, converged=False), certificate


def _fit_links(
    arm: ArmModel, fit: FittedValues, settings: PhysicalSettings
) -> tuple[FittedValues, PhysicalCertificate]:
    """Fit physically consistent links to a fit's linear problem; return fit and certificate."""
    base, problem, weights = fit.base, fit.problem, fit.solution.weights
    program, notes = physical_program(arm, base, settings)
    # normal equations of blocks of successive samples, which are left out in turn
    n_blocks = 5
    ends = np.cumsum([len(part) for part in np.array_split(weights, n_blocks)])[:-1]
    columns, target = weighted_rows(problem, weights)
    rows = np.column_stack([columns, target])
    blocks = np.array([own.T @ own for own in np.split(rows, ends * weights.shape[1])])
    whole = blocks.sum(axis=0)
    smallest = TORQUE_RESOLUTION * float(np.sqrt(whole[-1, -1]))
    least = max(_misfit(whole, fit.solution.values), smallest)
    counted = np.array_split(np.count_nonzero(weights, axis=1), n_blocks)
    share = np.array([part.sum() for part in counted], dtype=float)
    # scaled to a mean square of one in the unconstrained fit
    counts = share / share.sum() * least**2

    tried = _held_out_errors(program, blocks, counts)
    best = min(error for _, error in tried)
    weight = max(w for w, error in tried if error <= (1.0 + 1e-3) * best)  # tolerance of 0.1 %
    theta = program.solve(whole, float(counts.sum()), weight)
    size = len(theta) - len(program.lower)
    rigid, effects = theta[:size].reshape(-1, PER_LINK), theta[size:]
    links = tuple(
        Consistency.of(link, values) for link, values in zip(arm.robot.links, rigid, strict=True)
    )
    scale = 1e-6 * np.maximum(np.abs(effects).max(initial=0.0), 1e-9)
    held = (effects - program.lower <= scale) | (program.upper - effects <= scale)
    values, described = base.values(theta), program.prior[:size].reshape(-1, PER_LINK)
    bound = (1.0 - 1e-3) * np.log(settings.mass_range or np.inf)  # up to rounding
    off = np.abs(np.log(rigid[:, 0] / described[:, 0])) > bound
    certificate = PhysicalCertificate(
        links=links,
        shares=np.array(
            [
                scipy.linalg.eigh(pseudo_inertia(own), pseudo_inertia(before))[0][0]
                for own, before in zip(rigid, described, strict=True)
            ]
        ),
        at_bound=tuple(arm.parameters[size + k] for k in np.flatnonzero(held)),
        at_wall=tuple(
            f'{arm.robot.joints[link]} at {wall}'
            for link, box in program.boxes.items()
            for wall in _walls_reached(rigid[link], box)
        ),
        total_mass=settings.total_mass,
        weight=weight,
        tried=tried,
        misfit_ratio=max(_misfit(whole, values) / least, 1.0),
        notes=notes,
        at_mass=tuple(arm.robot.links[k] for k in np.flatnonzero(off)),
    )
    predicted = tuple(part.torque(values) for part in problem)
    fit = replace(fit, arm=arm.with_theta(theta), values=values, predicted=predicted)
    return fit, certificate


def _walls_reached(parameters: FloatArray, box: Box) -> list[str]:
    """Return the sides of a link's bounding box that its mass distribution reaches."""
    width = box[1] - box[0]
    largest = np.concatenate([width, width, 0.25 * width**2]) * parameters[0]
    near = box_conditions(box) @ parameters < _ACTIVE_SHARE * largest
    walls = [f'{side} {axis}' for side in ('lower', 'upper', 'spread along') for axis in 'xyz']
    return [wall for wall, at in zip(walls, near, strict=True) if at]


def physical_program(
    arm: ArmModel, base: BaseParameters, settings: PhysicalSettings
) -> tuple[PhysicalProgram, tuple[str, ...]]:
    """Return the convex program for physically consistent links, and notes on its prior."""
    prior, notes = consistent_prior(arm)
    ends = [effect.bounds() for effect in arm.effects]
    lower, upper = (np.concatenate([np.empty(0), *(b[k] for b in ends)]) for k in (0, 1))
    boxes: dict[int, Box] = {
        arm.robot.tree.index(joint): (np.array(low, dtype=float), np.array(high, dtype=float))
        for joint, (low, high) in settings.boxes.items()
    }
    rigid = len(prior) - len(lower)
    prior[rigid:] = np.clip(prior[rigid:], lower, upper)
    given = settings.total_mass, boxes, settings.mass_range
    return PhysicalProgram(base, prior, lower, upper, *given), notes


def consistent_prior(arm: ArmModel) -> tuple[FloatArray, tuple[str, ...]]:
    """
    Return the described parameters of all links, made physically consistent.

    A link without mass becomes a ball with the mean mass of the other links. A link may be a
    point, thinner than a twentieth of its length, or have impossible moments. Its second moments
    are then at least those of a housing of 0.1 m in diameter.

    Returns
    -------
    theta : ndarray, shape (P,)
        Standard parameters; the pseudo-inertia of each link is positive definite.
    notes : tuple of str
        Assumptions on links.

    """
    theta = arm.theta.copy()
    masses = [float(m) for m in theta[: len(arm.robot.rigid_parameters) : PER_LINK] if m > 0.0]
    typical = float(np.mean(masses)) if masses else 1.0
    notes = []
    for index, link in enumerate(arm.robot.links):
        part = slice(PER_LINK * index, PER_LINK * (index + 1))
        matrix = pseudo_inertia(theta[part])
        mass = matrix[3, 3]
        if mass <= 1e-6 * typical:
            # assumed radius of gyration of 0.05 m
            ball = np.diag([0.05**2] * 3 + [1.0]) * typical
            theta[part] = link_parameters(ball)
            notes.append(
                f"link '{link}': the description has no mass; a ball of {typical:.3g} kg is the "
                'prior where the data do not determine it'
            )
            continue
        center = matrix[:3, 3] / mass
        second = matrix[:3, :3] - mass * np.outer(center, center)
        values, axes = np.linalg.eigh(second)
        if values[0] < mass * 0.00016**2 or values[0] < THINNEST**2 * values[2]:
            # 0.03 m: a housing of 0.1 m in diameter, between solid (25 mm) and hollow (35 mm)
            least = max(mass * 0.03**2, 1e-2 * values[2])
            second = (axes * np.maximum(values, least)) @ axes.T
            matrix[:3, :3] = second + mass * np.outer(center, center)
            theta[part] = link_parameters(matrix)
            fault = 'inertia is impossible' if values[0] < -1e-9 * values[2] else 'body is thin'
            notes.append(
                f"link '{link}': the described {fault}; the prior of the fit has a radius of "
                f'gyration of {1e3 * np.sqrt(least / mass):.2g} mm at least'
            )
    return theta, tuple(notes)


def _held_out_errors(
    program: PhysicalProgram,
    blocks: FloatArray,
    counts: FloatArray,
) -> tuple[tuple[float, float], ...]:
    """Return each prior weight with its held-out error relative to unconstrained fits."""
    # compared weights of the divergence. The term of the torques is a mean square of about one.
    candidates = tuple(float(w) for w in 10.0 ** np.arange(-7.0, 0.5))
    free = 0.0
    squares = dict.fromkeys(candidates, 0.0)
    for left_out, block in enumerate(blocks):
        others = np.delete(blocks, left_out, axis=0).sum(axis=0)
        count = float(counts.sum() - counts[left_out])
        free += _misfit(block, informative_solution(others[:-1, :-1], others[:-1, -1])) ** 2
        for weight in candidates:
            theta = program.solve(others, count, weight)
            squares[weight] += _misfit(block, program.base.values(theta)) ** 2
    floor = max(free, TORQUE_RESOLUTION**2 * float(blocks[:, -1, -1].sum()))
    return tuple((weight, float(np.sqrt(total / floor))) for weight, total in squares.items())


def _misfit(products: FloatArray, values: FloatArray) -> float:
    """Return the norm of the residual for given values, from inner products (r + 1, r + 1)."""
    ends = np.append(values, -1.0)
    return float(np.sqrt(max(ends @ products @ ends, 0.0)))
