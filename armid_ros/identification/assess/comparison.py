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
too: parameters that are hard to tell apart can differ together beyond doubt and none of them
alone. A change of the links is held against that of a load on one of them.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from armid_ros.errors import ModelError
from armid_ros.estimate import ParameterName
from armid_ros.identification.assess.comparable import nothing_shared, require_comparable
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.assess.load_change import find_load, LoadChange
from armid_ros.identification.assess.not_compared import NotCompared, only_in, without_deviation
from armid_ros.identification.assess.residual_change import residual_changes, ResidualChange
from armid_ros.identification.parameters_file import ParameterFile
from armid_ros.identification.rows.checks import NEAR
from armid_ros.motion import FloatArray
import numpy as np
from scipy.stats import chi2, f, norm, t

SCHEMA = 'armid/comparison/1'
#: Probability that the list of changes has a chance find in it.
CHANCE = 0.05
#: Directions of a covariance below this share of the largest, all scaled, are rounding, and so
#: are differences of a value below this share of it.
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
    changed: bool = False

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
        """Difference in its standard deviations; of exact values none, or infinitely many."""
        if self.std > 0.0:
            return self.difference / self.std
        return float(np.copysign(np.inf if self.changed else 0.0, self.difference))


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


#: Deviations from zero of a value that a ratio is taken of, how many there have to be, and the
#: share of them that has to agree.
_CLEAR, _FEWEST, _MOST = 5.0, 4, 0.8


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
    only_before, only_after : tuple of NotCompared
        What the other does not have.
    groups : tuple of GroupChange
        Effects of every joint and the rigid body as a whole; empty without covariances.
    load : LoadChange or None
        The load on one link that explains all changes of the rigid body.

    """

    before: ParameterFile
    after: ParameterFile
    changes: tuple[ParameterChange, ...]
    only_before: tuple[NotCompared, ...]
    only_after: tuple[NotCompared, ...]
    groups: tuple[GroupChange, ...] = ()
    load: LoadChange | None = None
    residuals: tuple[ResidualChange, ...] = ()
    left_out: tuple[NotCompared, ...] = ()

    @property
    def anything(self) -> bool:
        """Whether something changed: a parameter, several as a whole, or what is left."""
        return bool(self.changed or self.changed_residuals) or any(g.changed for g in self.groups)

    @property
    def unusable(self) -> tuple[ParameterFile, ...]:
        """Return which of the two does not describe its recordings."""
        both = self.before, self.after
        return tuple(one for one in both if one.fit is not None and one.fit.unusable)

    @property
    def factors(self) -> dict[str, float]:
        """Return by what one factor the torques of each joint changed; see ``unit_factors``."""
        return unit_factors(self.changes)

    @property
    def not_compared(self) -> tuple[NotCompared, ...]:
        """Return every parameter that either has and that was not compared."""
        return (*self.left_out, *self.only_before, *self.only_after)

    @property
    def changed_residuals(self) -> tuple[ResidualChange, ...]:
        """Return the joints of which a model leaves much more than the other one."""
        return tuple(one for one in self.residuals if one.changed)

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
            'factors': self.factors,
            'residuals': [one.document() for one in self.residuals],
            'unusable': [
                {'source': one.source, 'reason': one.fit.reason}
                for one in self.unusable
                if one.fit is not None
            ],
            'not_compared': len(self.not_compared),
            'left_out': [one.document() for one in self.left_out],
            'only_before': [one.document() for one in self.only_before],
            'only_after': [one.document() for one in self.only_after],
        }


def unit_factors(changes: Sequence[ParameterChange]) -> dict[str, float]:
    """
    Return by what one factor the values of each joint changed, where that is all that did.

    No load and no wear makes masses and friction of all joints several times what they were:
    torques of one of the two are in another unit, or are currents. Empty where none are.

    """
    clear = [
        (c.parameter.joint, c.after / c.before)
        for c in changes
        if abs(c.before) > _CLEAR * c.before_std and abs(c.after) > _CLEAR * c.after_std
    ]
    ratios = np.array([ratio for _, ratio in clear])
    if len(ratios) < _FEWEST or np.mean(ratios > 0.0) < _MOST:
        return {}
    common = float(np.median(ratios))
    near = np.abs(np.log(np.maximum(ratios / common, 1e-9))) < np.log(NEAR)
    if 1.0 / LIMITS.torque_factor < common < LIMITS.torque_factor or np.mean(near) < _MOST:
        return {}
    joints = dict.fromkeys(joint for joint, _ in clear if joint)
    return {
        joint: float(np.median([ratio for of, ratio in clear if of == joint])) for joint in joints
    }


def compare(before: ParameterFile, after: ParameterFile) -> Comparison:
    """
    Compare two identifications of one robot.

    Raises
    ------
    ModelError
        If they are of two robots, are the same, or have no parameter in common.

    """
    require_comparable(before, after)
    first, second = max(
        ((before.regrouped_as(after), after), (before, after.regrouped_as(before))),
        key=lambda pair: len(pair[0].values.keys() & pair[1].values.keys()),
    )
    shared = [name for name in first.values if name in second.values]
    if not shared:
        raise ModelError(nothing_shared(before, after))
    sides = [_Side.of(one, shared) for one in (first, second)]
    difference = sides[1].values - sides[0].values
    covariance = first.covariance_of(shared) + second.covariance_of(shared)
    scatter = np.concatenate([one.scatter for one in sides])
    joint = before.covariance is not None and after.covariance is not None
    groups = _groups(shared) if joint else []
    residuals = residual_changes(before.fit, after.fit)
    chance = CHANCE / sum((True, bool(groups), bool(residuals)))
    single = _beyond_chance(_single_chances(*sides), chance)
    freedom = sum(one.freedom for one in sides)
    together = [
        _group_chance(difference[g], covariance[np.ix_(g, g)], scatter[:, g], freedom)
        for g in groups
    ]
    rows = np.array([sides[0].values, sides[1].values, sides[0].std, sides[1].std]).T.tolist()
    changes = tuple(
        ParameterChange(name, row[0], row[1], row[2], row[3], sure)
        for name, row, sure in zip(shared, rows, single, strict=True)
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
        only_in(before, second),
        only_in(after, first),
        found,
        load,
        _judged(residuals, chance),
        without_deviation(before, after),
    )


def _judged(residuals: Sequence[ResidualChange], allowed: float) -> tuple[ResidualChange, ...]:
    """Tell which residuals differ by more than chance."""
    beyond = _beyond_chance([one.p_value for one in residuals], allowed)
    return tuple(replace(one, changed=sure) for one, sure in zip(residuals, beyond, strict=True))


def _groups(names: Sequence[ParameterName]) -> list[list[int]]:
    """Return the positions of the rigid body, and of the effects of each joint; two or more."""
    groups: dict[str, list[int]] = {}
    for position, name in enumerate(names):
        groups.setdefault('' if name.rigid else f'effects of {name.joint}', []).append(position)
    return [group for group in groups.values() if len(group) > 1]


@dataclass(frozen=True)
class _Side:
    """
    The parameters that two identifications share, in one of them.

    Attributes
    ----------
    values, std : ndarray, shape (p,)
        Values and their standard deviations: those of noise, and in each joint as many times as
        much as its values vary from recording to recording.
    scatter : ndarray, shape (K, p)
        Changes of the values without each recording.
    freedom : int
        Recordings less one.
    freedoms : ndarray, shape (p,)
        Degrees of freedom of each deviation: the mean of squares of n values with correlations R
        has n^2 over the sum of R^2 times those of one (Satterthwaite). Infinite for noise.

    """

    values: FloatArray
    std: FloatArray
    scatter: FloatArray
    freedom: int
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


def _single_chances(before: _Side, after: _Side) -> list[float]:
    """Return how likely each difference is by chance, with freedoms of a sum (Welch)."""
    size, std = np.abs(after.values - before.values), np.hypot(before.std, after.std)
    same = size <= _ROUNDING * np.abs(before.values)
    safe = np.where(std > 0.0, std, 1.0)
    shares = [((side.std / safe) ** 4) / side.freedoms for side in (before, after)]
    with np.errstate(over='ignore', divide='ignore'):  # infinitely many deviations have no chance
        missed, freedom = size / safe, 1.0 / (shares[0] + shares[1])
    known = np.isfinite(freedom)
    chances = 2.0 * np.where(known, t.sf(missed, np.where(known, freedom, 1.0)), norm.sf(missed))
    return [float(p) for p in np.where(std > 0.0, chances, same)]


def _group_chance(
    difference: FloatArray, covariance: FloatArray, scatter: FloatArray, freedom: int
) -> float:
    """Return how likely differences are by chance, all together."""
    if not np.all(np.diag(covariance) > 0.0):
        return 1.0
    squares, rank = _squares(difference[np.newaxis], covariance)
    inflation = _inflation(covariance, scatter)
    if inflation <= 1.0:
        return float(chi2.sf(squares, rank))
    return float(f.sf(squares / rank / inflation, rank, rank * freedom))


def _inflation(covariance: FloatArray, scatter: FloatArray) -> float:
    """Return how many times the squares that noise makes recordings show, at least one."""
    if not (len(scatter) and np.all(np.diag(covariance) > 0.0)):
        return 1.0
    squares, rank = _squares(scatter, covariance)
    return max(1.0, squares / rank)


def _squares(rows: FloatArray, covariance: FloatArray) -> tuple[float, int]:
    """Return the sum of the squares of rows (K, p) over a covariance, and its rank."""
    std = np.sqrt(np.diag(covariance))
    sizes, axes = np.linalg.eigh(covariance / np.outer(std, std))
    kept = sizes > _ROUNDING * sizes[-1]
    with np.errstate(over='ignore'):
        along = (rows / std) @ axes[:, kept]
        return float(np.sum(along**2 / sizes[kept])), int(kept.sum())


def _beyond_chance(chances: Sequence[float], allowed: float) -> list[bool]:
    """Tell which are beyond chance, with a probability of one chance find among all (Holm)."""
    beyond = [False] * len(chances)
    for tried, index in enumerate(np.argsort(chances)):
        if chances[index] > allowed / (len(chances) - tried):
            break
        beyond[int(index)] = True
    return beyond
