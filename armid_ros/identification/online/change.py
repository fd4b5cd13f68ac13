# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What may change about an arm while it works, as directions in its base parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.effects import CATALOGUE, Effect
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray, read_only
import numpy as np

#: Of a body that an arm picks up, what is reported: its mass and where it is. The torque of its
#: inertia about its own centre is small compared with theirs.
_REPORTED = 4
#: A direction of which others leave less than this share is not one of its own.
_INDEPENDENT = 1e-6


@dataclass(frozen=True, eq=False)
class ChangeCandidate:
    """
    One thing that may change.

    Attributes
    ----------
    name : str
        As in the catalogue of effects, or 'friction' for all friction of a joint at once.
    joint : str
        Where; empty for the whole arm.
    parameters : tuple of ParameterName
        Its p quantities.
    directions : ndarray, shape (P, p)
        What a unit of each adds to the base parameters.
    reopened : ndarray, shape (P, k)
        All that may have changed with them, independent directions.
    common : bool
        Whether it happens all day.

    """

    name: str
    joint: str
    parameters: tuple[ParameterName, ...]
    directions: FloatArray
    reopened: FloatArray
    common: bool = False

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ('directions', 'reopened'):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def label(self) -> str:
        """Return what changed where, such as 'payload at hand'."""
        text = self.name.replace('_', ' ')
        return f'{text} at {self.joint}' if self.joint else text

    def includes(self, other: ChangeCandidate) -> bool:
        """Whether all that the other one is about is among this one's."""
        return set(other.parameters) <= set(self.parameters)


@dataclass(frozen=True, eq=False)
class Change:
    """
    Something that has changed.

    Attributes
    ----------
    candidate : ChangeCandidate
        What explains the torques best.
    rivals : tuple of ChangeCandidate
        What explains them nearly as well.
    t : float
        When it changed, to a quarter of a second [s].
    size : Estimate
        By how much the quantities of the candidate changed, as far as it was known then; of those
        of which nothing was known the deviation is infinite.

    """

    candidate: ChangeCandidate
    rivals: tuple[ChangeCandidate, ...]
    t: float
    size: Estimate

    @property
    def reopened(self) -> FloatArray:
        """Independent directions of all that may have changed, shape (P, k)."""
        columns = np.hstack([c.reopened for c in (self.candidate, *self.rivals)])
        columns = columns / np.linalg.norm(columns, axis=0)
        left, size, _ = np.linalg.svd(columns, full_matrices=False)
        return np.asarray(left[:, size > _INDEPENDENT * size[0]])

    def __str__(self) -> str:
        """Say what changed, by how much, and what else it may have been."""
        sizes = ', '.join(
            f'{p.name} by {value:+.3g} {p.unit} ({lower:.3g} to {upper:.3g})'
            if 0.0 < upper - lower < np.inf
            else f'{p.name} by an amount that is not known until it moves'
            for p, value, (lower, upper) in zip(
                self.size.parameters, self.size.values, self.size.interval(), strict=True
            )
        )
        rivals = ''.join(f'; or {rival.label}' for rival in self.rivals)
        return f'{self.candidate.label} has changed: {sizes}{rivals}'


def change_candidates(arm: ArmModel, base: BaseParameters) -> tuple[ChangeCandidate, ...]:
    """
    List what may change: every effect on every joint, friction of a joint, what the arm holds.

    Parameters
    ----------
    arm : ArmModel
        What is identified.
    base : BaseParameters
        Its base parameters.

    """
    found, first = [], len(arm.robot.rigid_parameters)
    friction: dict[str, list[int]] = {}
    for effect in arm.effects:
        count = len(effect.quantities)
        for owner in effect.owners:
            columns = list(range(first, first + count))
            found.append(_candidate(effect.name, owner, columns, base))
            if effect.traits.friction:
                friction.setdefault(owner, []).extend(columns)
            first += count
    several = {joint: c for joint, c in friction.items() if len(c) > 1}
    found += [_candidate('friction', joint, c, base) for joint, c in several.items()]
    carried = [kind.on(arm.robot) for kind in CATALOGUE.values() if kind.traits.weighs]
    found += [_carried(effect, arm, base) for effect in carried if effect.adds_to(arm.robot)]
    return tuple(candidate for candidate in found if candidate.parameters)


def _candidate(
    name: str, joint: str, columns: Sequence[int], base: BaseParameters
) -> ChangeCandidate:
    kept = _independent(base.grouping[:, columns])
    directions = base.grouping[:, [columns[k] for k in kept]]
    return ChangeCandidate(
        name, joint, tuple(base.standard[columns[k]] for k in kept), directions, directions
    )


def _carried(effect: Effect, arm: ArmModel, base: BaseParameters) -> ChangeCandidate:
    """Return a body that a link may hold; its parameters add to the link's own."""
    names = effect.parameters(arm.robot)
    columns = base.grouping[:, list(effect.adds_to(arm.robot))]
    kept = [k for k in _independent(columns) if k < _REPORTED]
    return ChangeCandidate(
        effect.name,
        effect.joints[0],
        tuple(names[k] for k in kept),
        columns[:, kept],
        columns[:, _independent(columns)],
        common=True,
    )


def _independent(columns: FloatArray) -> list[int]:
    """Return the columns that those before them do not span."""
    basis = np.zeros((len(columns), 0))
    kept = []
    for k, column in enumerate(columns.T):
        length = np.linalg.norm(column)
        if not length > 0.0:
            continue
        rest = column / length
        rest = rest - basis @ (basis.T @ rest)
        if np.linalg.norm(rest) > _INDEPENDENT:
            basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
            kept.append(k)
    return kept
