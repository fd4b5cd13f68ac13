# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Evidence that an identified arm is physically consistent, and its active constraints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from armid_ros.estimate import ParameterName
from armid_ros.identification.physical.physical_program import Box, box_conditions
from armid_ros.model.pseudo_inertia import Consistency
from armid_ros.motion import FloatArray
import numpy as np

#: Relative size of a pseudo-inertia in any direction, up to which it is at the limit of physical
#: consistency; relative distance to a wall of a box, up to which it is at the wall.
ACTIVE_SHARE = 1e-3


@dataclass(frozen=True)
class PhysicalCertificate:
    """
    Evidence of physical consistency, and increase of the torque error by the constraints.

    Attributes
    ----------
    links : tuple of Consistency
        Eigenvalues of every pseudo-inertia, mass, centre, principal moments.
    shares : ndarray, shape (n,)
        Smallest size of each pseudo-inertia relative to the prior's, over all directions.
    at_bound : tuple of ParameterName
        Effect parameters at their bounds.
    at_wall : tuple of str
        Joints whose link is at the limit of its box, with the side.
    total_mass : float or None
        Given sum of the masses [kg].
    weight : float
        Weight of the prior.
    tried : tuple of (float, float)
        Compared weights, with held-out errors relative to those of unconstrained fits.
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
        """Error on held-out blocks with the chosen weight, relative to unconstrained fits."""
        return dict(self.tried)[self.weight]

    @property
    def cost(self) -> float:
        """Relative increase of training or held-out error by the constraints, the larger one."""
        return max(self.misfit_ratio, self.held_out_ratio) - 1.0

    @property
    def active(self) -> tuple[str, ...]:
        """Links at the limit of physical consistency."""
        near = self.shares < ACTIVE_SHARE
        return tuple(link.link for link, at in zip(self.links, near, strict=True) if at)

    @property
    def activity(self) -> tuple[str, ...]:
        """Return notes on active constraints and their cost; empty if none is active."""
        notes = []
        # held-out torque error, relative to an unconstrained fit, above which the constraints do
        # not fit the arm
        if self.held_out_ratio > 1.03:
            notes.append(
                f'constraints cost {100.0 * (self.held_out_ratio - 1.0):.1f} % of torque error on '
                'blocks left out: a given mass or box is wrong, or the model lacks an effect'
            )
        if self.active:
            notes.append(
                f'at the limit of what a body can be: {", ".join(self.active)}; '
                'the model lacks an effect there, or the data are poor'
            )
        if self.at_wall:
            notes.append(f'at the limit of the box: {", ".join(self.at_wall)}')
        if self.at_mass:
            notes.append(f'as light or heavy as they may be: {", ".join(self.at_mass)}')
        if self.total_mass is not None:
            notes.append(f'the masses add up to {self.total_mass:g} kg, as given')
        if self.at_bound:
            names = ', '.join(f'{p.name} of {p.joint}' for p in self.at_bound)
            notes.append(f'held by their bounds: {names}')
        return tuple(notes)

    def sentences(self) -> tuple[str, ...]:
        """Return the findings as sentences."""
        least = min(self.links, key=lambda link: float(link.eigenvalues[0]))
        verdict = 'every link is a body' if self.consistent else 'not every link is a body'
        return (
            f'{verdict}: the smallest eigenvalue of a pseudo-inertia is '
            f'{least.eigenvalues[0]:.3g} ({least.link})',
            f'constraints cost {100.0 * (self.misfit_ratio - 1.0):.2f} % of torque error on the '
            f'training data and {100.0 * (self.held_out_ratio - 1.0):+.2f} % on blocks left out; '
            f'weight of the description {self.weight:g}',
            *(self.activity or ('no constraint is active',)),
            *self.notes,
        )

    def document(self) -> dict[str, Any]:
        """Return the certificate as a document."""
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


def walls_reached(parameters: FloatArray, box: Box) -> tuple[str, ...]:
    """
    Return the active limits of the box of a link.

    Parameters
    ----------
    parameters : ndarray, shape (10,)
        Inertial parameters of the link.
    box : tuple of two ndarray, each of shape (3,)
        Lower and upper corner of the box [m].

    """
    width = box[1] - box[0]
    largest = np.concatenate([width, width, 0.25 * width**2]) * parameters[0]
    near = box_conditions(box) @ parameters < ACTIVE_SHARE * largest
    walls = [f'{side} {axis}' for side in ('lower', 'upper', 'spread along') for axis in 'xyz']
    return tuple(wall for wall, at in zip(walls, near, strict=True) if at)
