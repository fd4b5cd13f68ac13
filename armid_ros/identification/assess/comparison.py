# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Two identifications side by side: what changed beyond its uncertainty.

With dozens of parameters one in twenty is outside its 95 % interval by chance, so differences are
held against each other (Holm 1979): a change is called one if the whole list of changes is free of
chance finds with 95 % probability.

Where both have their covariance, the effects of each joint and the links are looked at as a whole
too: parameters that are hard to tell apart can differ together beyond doubt and none of them
alone. A change of the links is held against that of a load on one of them.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from armid_ros.errors import ModelError
from armid_ros.estimate import ParameterName
from armid_ros.identification.assess.load_change import find_load, LoadChange
from armid_ros.identification.parameters_file import ParameterFile
from armid_ros.motion import FloatArray
import numpy as np
from scipy.special import erfc
from scipy.stats import chi2

SCHEMA = 'armid/comparison/1'
#: Probability that the list of changes has a chance find in it.
CHANCE = 0.05
#: Directions of a covariance below this share of the largest, all scaled, are rounding.
_ROUNDING = 1e-10


@dataclass(frozen=True)
class ParameterChange:
    """
    One parameter in both.

    Attributes
    ----------
    parameter : ParameterName
        Which.
    before, after : float
        Values.
    before_std, after_std : float
        Standard deviations.
    changed : bool
        Whether it differs by more than chance.

    """

    parameter: ParameterName
    before: float
    after: float
    before_std: float
    after_std: float
    changed: bool

    @property
    def difference(self) -> float:
        """Return what it grew by."""
        return self.after - self.before

    @property
    def std(self) -> float:
        """Return the standard deviation of the difference."""
        return float(np.hypot(self.before_std, self.after_std))

    @property
    def deviations(self) -> float:
        """Difference in its standard deviations."""
        return (
            self.difference / self.std if self.std > 0.0 else np.copysign(np.inf, self.difference)
        )


@dataclass(frozen=True)
class GroupChange:
    """
    Parameters that are looked at as a whole.

    Attributes
    ----------
    joint : str
        Whose effects; empty for the rigid body.
    parameters : tuple of ParameterName
        What is in it, two or more.
    p_value : float
        Probability that chance alone makes them differ as much.
    changed : bool
        Whether they differ by more than chance.

    """

    joint: str
    parameters: tuple[ParameterName, ...]
    p_value: float
    changed: bool


@dataclass(frozen=True)
class Comparison:
    """
    Two identifications.

    Attributes
    ----------
    before, after : ParameterFile
        What was compared.
    changes : tuple of ParameterChange
        Every parameter that both have, in the order of the first.
    only_before, only_after : tuple of ParameterName
        What the other does not have.
    groups : tuple of GroupChange
        Effects of every joint and the rigid body as a whole; empty without covariances.
    load : LoadChange or None
        The load on one link that explains all changes of the rigid body.

    """

    before: ParameterFile
    after: ParameterFile
    changes: tuple[ParameterChange, ...]
    only_before: tuple[ParameterName, ...]
    only_after: tuple[ParameterName, ...]
    groups: tuple[GroupChange, ...] = ()
    load: LoadChange | None = None

    @property
    def anything(self) -> bool:
        """Whether something changed, alone or as a whole."""
        return any(c.changed for c in self.changes) or any(g.changed for g in self.groups)

    @property
    def changed_together(self) -> tuple[GroupChange, ...]:
        """Return the groups that changed though none of their parameters did beyond doubt."""
        sure = {change.parameter for change in self.changed}
        return tuple(g for g in self.groups if g.changed and not sure.intersection(g.parameters))

    @property
    def changed(self) -> tuple[ParameterChange, ...]:
        """Return what changed, the surest first."""
        found = [change for change in self.changes if change.changed]
        return tuple(sorted(found, key=lambda change: -abs(change.deviations)))

    def document(self) -> dict[str, Any]:
        """Return the comparison for programs to read (schema armid/comparison/1)."""
        return {
            'schema': SCHEMA,
            'before': self.before.source,
            'after': self.after.source,
            'parameters': [
                {
                    'name': c.parameter.name,
                    'joint': c.parameter.joint,
                    'unit': c.parameter.unit,
                    'before': c.before,
                    'before_std': c.before_std,
                    'after': c.after,
                    'after_std': c.after_std,
                    'changed': c.changed,
                }
                for c in self.changes
            ],
            'groups': [
                {
                    'joint': g.joint,
                    'parameters': [p.name for p in g.parameters],
                    'p_value': g.p_value,
                    'changed': g.changed,
                }
                for g in self.groups
            ],
            'load': None if self.load is None else self.load.document(),
            'only_before': [{'name': p.name, 'joint': p.joint} for p in self.only_before],
            'only_after': [{'name': p.name, 'joint': p.joint} for p in self.only_after],
        }


def compare(before: ParameterFile, after: ParameterFile) -> Comparison:
    """
    Compare two identifications of one robot.

    Raises
    ------
    ModelError
        If they are of two robots, or have no parameter in common.

    """
    _require_one_robot(before, after)
    first, second = max(
        ((before.regrouped_as(after), after), (before, after.regrouped_as(before))),
        key=lambda pair: len(pair[0].values.keys() & pair[1].values.keys()),
    )
    shared = [name for name in first.values if name in second.values]
    if not shared:
        raise ModelError(
            f'{before.source} and {after.source} have no identified parameter in common; '
            'are they of one robot, in one gravity?'
        )
    pairs = np.array([(*first.values[name], *second.values[name]) for name in shared])
    difference = pairs[:, 2] - pairs[:, 0]
    covariance = first.covariance_of(shared) + second.covariance_of(shared)
    joint = before.covariance is not None and after.covariance is not None
    groups = _groups(shared) if joint else []
    chance = CHANCE / 2.0 if groups else CHANCE
    single = _beyond_chance(_single_chances(pairs), chance)
    together = [_group_chance(difference[g], covariance[np.ix_(g, g)]) for g in groups]
    changes = tuple(
        ParameterChange(name, pair[0], pair[2], pair[1], pair[3], sure)
        for name, pair, sure in zip(shared, pairs.tolist(), single, strict=True)
    )
    found = tuple(
        GroupChange(
            '' if shared[group[0]].rigid else shared[group[0]].joint,
            tuple(shared[k] for k in group),
            p_value,
            sure,
        )
        for group, p_value, sure in zip(
            groups, together, _beyond_chance(together, chance), strict=True
        )
    )
    rigid = [k for k, name in enumerate(shared) if name.rigid]
    moved = any(changes[k].changed for k in rigid) or any(g.changed and not g.joint for g in found)
    load = None
    if joint and moved:
        load = find_load(
            [first.terms.get(shared[k], {}) for k in rigid],
            difference[rigid],
            covariance[np.ix_(rigid, rigid)],
        )
    return Comparison(
        before,
        after,
        changes,
        tuple(name for name in before.values if name not in second.values),
        tuple(name for name in after.values if name not in first.values),
        found,
        load,
    )


def _require_one_robot(before: ParameterFile, after: ParameterFile) -> None:
    """Refuse robots whose joints differ, wherever their files are."""
    known = before.kinematics and after.kinematics
    if not known or before.kinematics == after.kinematics:
        return
    apart = set(before.joints).symmetric_difference(after.joints)
    how = (
        f'only one of them has {", ".join(sorted(apart))}'
        if apart
        else ('their joints are of the same names, and in other places')
    )
    raise ModelError(
        f'{before.source} and {after.source} are of different robots, {before.robot} and '
        f'{after.robot}: {how}; what changed can be said of one robot only'
    )


def _groups(names: Sequence[ParameterName]) -> list[list[int]]:
    """Return the positions of the rigid body, and of the effects of each joint; two or more."""
    groups: dict[str, list[int]] = {}
    for position, name in enumerate(names):
        groups.setdefault('' if name.rigid else f'effects of {name.joint}', []).append(position)
    return [group for group in groups.values() if len(group) > 1]


def _single_chances(pairs: FloatArray) -> list[float]:
    """Return how likely each difference is by chance; rows are value, std, value, std."""
    std = np.hypot(pairs[:, 1], pairs[:, 3])
    size = np.abs(pairs[:, 2] - pairs[:, 0])
    safe = np.where(std > 0.0, std, 1.0)
    with np.errstate(over='ignore'):  # infinitely many deviations have no chance
        missed = size / safe / np.sqrt(2.0)
    chances = np.where(std > 0.0, erfc(missed), (size == 0.0).astype(float))
    return [float(chance) for chance in chances]


def _group_chance(difference: FloatArray, covariance: FloatArray) -> float:
    """Return how likely differences are by chance, all together."""
    std = np.sqrt(np.diag(covariance))
    if not np.all(std > 0.0):
        return 1.0
    sizes, axes = np.linalg.eigh(covariance / np.outer(std, std))
    kept = sizes > _ROUNDING * sizes[-1]
    with np.errstate(over='ignore'):
        along = axes[:, kept].T @ (difference / std)
        squares = float(np.sum(along**2 / sizes[kept]))
    return float(chi2.sf(squares, int(kept.sum())))


def _beyond_chance(chances: Sequence[float], allowed: float) -> list[bool]:
    """Tell which are beyond chance, with a probability of one chance find among all (Holm)."""
    beyond = [False] * len(chances)
    for tried, index in enumerate(np.argsort(chances)):
        if chances[index] > allowed / (len(chances) - tried):
            break
        beyond[int(index)] = True
    return beyond
