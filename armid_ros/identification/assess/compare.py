# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Two identifications side by side: what changed beyond its uncertainty.

With dozens of parameters one in twenty is outside its 95 % interval by chance, so differences are
held against each other (Holm 1979): a change is called one if the whole list of changes is free of
chance finds with 95 % probability.

A model gets something wrong of every motion, and other motions give other values. What values vary
by from recording to recording widens the deviations of each joint, where the files have it. Few
recordings show that badly: Student's distribution holds then, and that of Fisher for groups.

What a model leaves of the torque of a joint is held against what the other leaves: no parameter
has a change that neither model describes.

Where both have their covariance, the effects of each joint and the links are looked at as a whole
too: parameters that are strongly correlated can differ together beyond doubt and none of them
alone. A change of the links is held against that of a load on one of them.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from armid_ros.changes.statistic import beyond_chance, quadratic_form, tail
from armid_ros.errors import ModelError
from armid_ros.estimate import ParameterName
from armid_ros.identification.assess.comparison import (
    Comparison,
    GroupChange,
    NotCompared,
    ParameterChange,
)
from armid_ros.identification.assess.load_change import find_load, residual_changes
from armid_ros.identification.parameters_file import ParameterFile
from armid_ros.motion import FloatArray
import numpy as np

#: Probability that the list of changes has a chance find in it.
CHANCE = 0.05
#: Directions of a covariance below this share of the largest, all scaled, are rounding, and so
#: are differences of a value below this share of it.
_ROUNDING = 1e-10


def compare(before: ParameterFile, after: ParameterFile) -> Comparison:
    """
    Compare two identifications of one robot.

    Raises
    ------
    ModelError
        If they are of two robots, are the same, or have no parameter in common.

    """
    _require_two_of_one_robot(before, after)
    first, second = max(
        ((before.regrouped_as(after), after), (before, after.regrouped_as(before))),
        key=lambda pair: len(pair[0].values.keys() & pair[1].values.keys()),
    )
    shared = [name for name in first.values if name in second.values]
    if not shared:
        raise ModelError(_nothing_shared(before, after))
    sides = [_Side.of(one, shared) for one in (first, second)]
    difference = sides[1].values - sides[0].values
    covariance = first.covariance_of(shared) + second.covariance_of(shared)
    scatter = np.concatenate([one.scatter for one in sides])
    joint = before.covariance is not None and after.covariance is not None
    groups = _groups(shared) if joint else []
    residuals = residual_changes(before.fit, after.fit)
    chance = CHANCE / sum((True, bool(groups), bool(residuals)))
    single = beyond_chance(_single_chances(*sides), chance)
    freedom = sum(one.freedom for one in sides)
    together = [
        _group_chance(difference[g], covariance[np.ix_(g, g)], scatter[:, g], freedom)
        for g in groups
    ]
    rows = np.array([sides[0].values, sides[1].values, sides[0].std, sides[1].std]).T.tolist()
    changes = tuple(
        ParameterChange(name, row[0], row[1], row[2], row[3], one)
        for name, row, one in zip(shared, rows, single, strict=True)
    )
    sure = beyond_chance(together, chance)
    found = tuple(
        GroupChange('' if own[0].rigid else own[0].joint, own, p_value, one)
        for own, p_value, one in zip(
            [tuple(shared[k] for k in group) for group in groups], together, sure, strict=True
        )
    )
    rigid = [k for k, name in enumerate(shared) if name.rigid]
    moved = any(changes[k].changed for k in rigid) or any(g.changed and not g.joint for g in found)
    left = beyond_chance([one.p_value for one in residuals], chance)
    without = dict.fromkeys((*before.without_std, *after.without_std))
    load = None
    if joint and moved:
        noise = covariance[np.ix_(rigid, rigid)]
        load = find_load(
            [first.terms.get(shared[k], {}) for k in rigid],
            difference[rigid],
            _inflation(noise, scatter[:, rigid]) * noise,
        )
    return Comparison(
        before,
        after,
        changes,
        tuple(_only_in(before, second)),
        tuple(_only_in(after, first)),
        found,
        load,
        tuple(replace(one, changed=sure) for one, sure in zip(residuals, left, strict=True)),
        tuple(NotCompared(name, 'deviation') for name in without),
    )


def _require_two_of_one_robot(before: ParameterFile, after: ParameterFile) -> None:
    """Refuse robots whose joints differ, wherever their files are, and one result given twice."""
    if before.kinematics and after.kinematics and before.kinematics != after.kinematics:
        apart = set(before.joints).symmetric_difference(after.joints)
        how = (
            f'only one of them has {", ".join(sorted(apart))}'
            if apart
            else 'their joints are of the same names, and in other places'
        )
        raise ModelError(
            f'{before.source} and {after.source} are of different robots, {before.robot} and '
            f'{after.robot}: {how}; name two results of one robot'
        )
    same = before.values == after.values and before.without_std == after.without_std
    if same and (before.values or before.without_std):
        copy = '' if before.source == after.source else f' (is {before.source})'
        raise ModelError(
            f'given twice: {after.source}{copy}; name two results, of recordings of their own'
        )


def _nothing_shared(before: ParameterFile, after: ParameterFile) -> str:
    """Say why two files cannot be compared."""
    for one in (before, after):
        if not one.values and one.without_std:
            return (
                f'{one.source} has no standard deviation of any parameter, so changes cannot be '
                'tested; name a result of identify'
            )
    return (
        f'{before.source} and {after.source} have no identified parameter in common; '
        'are they of one robot, in one gravity?'
    )


def _only_in(one: ParameterFile, other: ParameterFile) -> Iterator[NotCompared]:
    """Yield what one has of its own, where the other has no value of it."""
    for name in one.values:
        if name in other.values or name in other.without_std:
            continue
        if (name.name, name.joint) in other.not_shown:
            yield NotCompared(name, 'motion')
        elif not name.rigid:
            yield NotCompared(name, 'effect')
        else:
            yield NotCompared(name, 'deviation' if other.without_std else 'grouping')


def _groups(names: Sequence[ParameterName]) -> list[list[int]]:
    """Return the positions of the rigid body, and of the effects of each joint; two or more."""
    groups: dict[str, list[int]] = {}
    for position, name in enumerate(names):
        groups.setdefault('' if name.rigid else f'effects of {name.joint}', []).append(position)
    return [group for group in groups.values() if len(group) > 1]


@dataclass(frozen=True)
class _Side:
    """The parameters that two identifications share, in one of them."""

    values: FloatArray  # (p,)
    #: Standard deviations: those of noise, and in each joint as many times as much as its values
    #: vary from recording to recording.
    std: FloatArray
    scatter: FloatArray  # changes of the values without each recording, (K, p)
    freedom: int  # recordings less one
    #: Degrees of freedom of each deviation: the mean of squares of n values with correlations R
    #: has n^2 over the sum of R^2 times those of one (Satterthwaite). Infinite for noise.
    freedoms: FloatArray

    @classmethod
    def of(cls, known: ParameterFile, names: Sequence[ParameterName]) -> _Side:
        """Return the values of one file."""
        values, std = np.array([known.values[name] for name in names]).T
        scatter = known.scatter_of(names)
        freedom = max(len(scatter) - 1, 0)
        freedoms = np.full(len(names), np.inf)
        if freedom and np.all(std > 0.0):
            squares = np.sum((scatter / std) ** 2, axis=0)
            alike = (known.covariance_of(names) / np.outer(std, std)) ** 2
            std = std.copy()
            for joint in {name.joint for name in names}:
                own = [k for k, name in enumerate(names) if name.joint == joint]
                inflation = float(np.mean(squares[own]))
                if inflation > 1.0:
                    std[own] *= np.sqrt(inflation)
                    freedoms[own] = freedom * len(own) ** 2 / np.sum(alike[np.ix_(own, own)])
        return cls(values, std, scatter, freedom, freedoms)


def _single_chances(before: _Side, after: _Side) -> FloatArray:
    """Return how likely each difference is by chance, with freedoms of a sum (Welch)."""
    size, std = np.abs(after.values - before.values), np.hypot(before.std, after.std)
    same = size <= _ROUNDING * np.abs(before.values)
    safe = np.where(std > 0.0, std, 1.0)
    shares = [((side.std / safe) ** 4) / side.freedoms for side in (before, after)]
    with np.errstate(over='ignore', divide='ignore'):  # infinitely many deviations have no chance
        chances = tail((size / safe) ** 2, 1, 1.0 / (shares[0] + shares[1]))
    return np.where(std > 0.0, chances, same)


def _group_chance(
    difference: FloatArray, covariance: FloatArray, scatter: FloatArray, freedom: int
) -> float:
    """Return how likely differences are by chance, all together."""
    if not np.all(np.diag(covariance) > 0.0):
        return 1.0
    squares, rank = _squares(difference[np.newaxis], covariance)
    inflation = _inflation(covariance, scatter)
    return float(tail(squares / inflation, rank, np.inf if inflation <= 1.0 else rank * freedom))


def _inflation(covariance: FloatArray, scatter: FloatArray) -> float:
    """Return how many times the squares that noise makes recordings show, at least one."""
    if not (len(scatter) and np.all(np.diag(covariance) > 0.0)):
        return 1.0
    squares, rank = _squares(scatter, covariance)
    return max(1.0, squares / rank)


def _squares(rows: FloatArray, covariance: FloatArray) -> tuple[float, int]:
    """Return the sum of the squares of rows (K, p) over a covariance, and its rank."""
    std = np.sqrt(np.diag(covariance))
    with np.errstate(over='ignore'):
        squares, rank = quadratic_form(rows / std, covariance / np.outer(std, std), _ROUNDING)
        return float(squares.sum()), int(rank.max())
