# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Possible and detected changes of an arm during online identification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.effects import CATALOGUE
from armid_ros.estimate import Estimate, name_in_words, ParameterName
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray, read_only
import numpy as np

#: Relative singular value below which directions count as linearly dependent [-].
_MIN_SINGULAR_VALUE = 1e-6


@dataclass(frozen=True, eq=False)
class ChangeCandidate:
    """
    Possible change of an arm, such as a payload, as directions of the base parameters.

    Attributes
    ----------
    name : str
        Name of an effect in the catalogue, or 'friction' for all friction of a joint at once.
    joint : str
        Joint of the change; empty for a change of the entire arm.
    parameters : tuple of ParameterName
        The p physical quantities that change.
    directions : ndarray, shape (P, p)
        Change of the base parameters per unit of each quantity.
    changed_directions : ndarray, shape (P, k)
        Independent directions of the base parameters that may have changed.
    common : bool
        Whether such changes are frequent, as changes of the payload are.

    """

    name: str
    joint: str
    parameters: tuple[ParameterName, ...]
    directions: FloatArray
    changed_directions: FloatArray
    common: bool = False

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for name in ('directions', 'changed_directions'):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def label(self) -> str:
        """Return the name and joint of the change, such as 'payload at hand'."""
        text = name_in_words(self.name)
        return f'{text} at {self.joint}' if self.joint else text

    def includes(self, other: ChangeCandidate) -> bool:
        """Whether this change covers all parameters of another change."""
        return set(other.parameters) <= set(self.parameters)


@dataclass(frozen=True, eq=False)
class Change:
    """
    Detected change of an arm: cause, time and size.

    Attributes
    ----------
    candidate : ChangeCandidate
        Candidate that explains the torques best.
    rivals : tuple of ChangeCandidate
        Candidates that explain the torques nearly as well.
    t : float
        Time of the change, to a quarter of a second [s].
    size : Estimate
        Change of each quantity of the candidate, estimated at the detection. The standard
        deviation of a quantity without data is infinite.

    """

    candidate: ChangeCandidate
    rivals: tuple[ChangeCandidate, ...]
    t: float
    size: Estimate

    @property
    def changed_directions(self) -> FloatArray:
        """Return independent directions (P, k) in which base parameters may have changed."""
        columns = np.hstack([c.changed_directions for c in (self.candidate, *self.rivals)])
        columns = columns / np.linalg.norm(columns, axis=0)
        directions, size, _ = np.linalg.svd(columns, full_matrices=False)
        return np.asarray(directions[:, size > _MIN_SINGULAR_VALUE * size[0]])

    def __str__(self) -> str:
        """Return a sentence with the cause of the change, its size, and rival causes."""
        sizes = ', '.join(
            f'{p.name} by {value:+.3g} {p.unit} ({lower:.3g} to {upper:.3g})'
            if 0.0 < upper - lower < np.inf
            else f'{p.name} by an amount that is unknown until the joint moves'
            for p, value, (lower, upper) in zip(
                self.size.parameters, self.size.values, self.size.interval(), strict=True
            )
        )
        rivals = ''.join(f'; or {rival.label}' for rival in self.rivals)
        return f'{self.candidate.label} has changed: {sizes}{rivals}'


def change_candidates(arm: ArmModel, base: BaseParameters) -> tuple[ChangeCandidate, ...]:
    """
    Return possible changes of an arm: effects, all friction of a joint, payloads.

    Parameters
    ----------
    arm : ArmModel
        The arm to identify.
    base : BaseParameters
        Base parameters of the arm.

    """
    found, first = [], len(arm.robot.rigid_parameters)
    friction: dict[str, list[int]] = {}
    for effect in arm.effects:
        count = len(effect.quantities)
        for owner in effect.owners:
            columns = list(range(first, first + count))
            found.append(_candidate(effect.name, owner, base, columns))
            if effect.traits.friction:
                friction.setdefault(owner, []).extend(columns)
            first += count
    several = {joint: columns for joint, columns in friction.items() if len(columns) > 1}
    found += [_candidate('friction', joint, base, columns) for joint, columns in several.items()]
    # a load on a link; its parameters add to the parameters of the link
    for body in (kind.on(arm.robot) for kind in CATALOGUE.values() if kind.traits.weighs):
        columns, names = list(body.adds_to(arm.robot)), body.parameters(arm.robot)
        if columns:
            found.append(_candidate(body.name, body.joints[0], base, columns, names))
    return tuple(candidate for candidate in found if candidate.parameters)


def _candidate(
    name: str,
    joint: str,
    base: BaseParameters,
    added_to: Sequence[int],
    names: Sequence[ParameterName] = (),
) -> ChangeCandidate:
    """Return a candidate: the change of an effect on a joint, or of a payload on a link."""
    columns = base.grouping[:, added_to]
    # a maximal set of linearly independent columns, in their order
    lengths = np.linalg.norm(columns, axis=0)
    unit = columns / np.where(lengths > 0.0, lengths, 1.0)
    ranks = [
        np.linalg.matrix_rank(unit[:, :k], _MIN_SINGULAR_VALUE) for k in range(len(lengths) + 1)
    ]
    independent = np.flatnonzero(np.diff(ranks)).tolist()
    # Mass and first moments of a load are reported. The torque of its inertia about its centre is
    # comparatively small.
    kept = [k for k in independent if not names or k < 4]
    parameters = names or [base.standard[k] for k in added_to]
    return ChangeCandidate(
        name,
        joint,
        tuple(parameters[k] for k in kept),
        columns[:, kept],
        columns[:, independent],
        common=bool(names),
    )
