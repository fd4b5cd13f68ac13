# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Comparison of two identifications: changes beyond their uncertainty.

With dozens of parameters, one in twenty is outside its 95 % interval by chance. Differences are
therefore corrected for their number (Holm 1979): with 95 % probability, the list of changes
contains no false one.

A model has errors in every motion, and other motions give other values. The scatter of values
between recordings widens the deviations of each joint, if the files contain it. Few recordings
determine the scatter badly, so tests use Student's distribution, and Fisher's for groups.

If both files have a covariance, the effects of each joint and the links are tested as groups too:
strongly correlated parameters can differ significantly as a group although no single one does. The
residuals of the two models in each joint are compared (Fisher's F), because a change that
neither model describes appears in no parameter.

A body that is fixed to link k adds its ten parameters p to those of the link. Base parameters then
change by G_k p, with the factors G_k of the parameters of link k in them. If ten numbers p
explain dozens of changes within their uncertainty, they are a load; the first number is its mass.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
import re

from armid_ros.changes.statistic import beyond_chance, quadratic_form, tail
from armid_ros.errors import ModelError
from armid_ros.estimate import ParameterName
from armid_ros.identification.assess.comparison import (
    Comparison,
    GroupChange,
    LoadChange,
    NotCompared,
    ParameterChange,
    ResidualChange,
)
from armid_ros.identification.assess.grade_limits import FREEDOM
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.identification.parameters_file import KnownFit, ParameterFile
from armid_ros.model import LINK_PARAMETERS
from armid_ros.motion import FloatArray
import numpy as np
from scipy import stats
import scipy.linalg

#: Eigenvalues of a scaled covariance below this share of the largest are rounding errors, as are
#: differences of a value below this share of it.
_ROUNDING = 1e-10
#: Name of a link parameter in the terms of base parameters, with the number of the link.
_NUMBERED = re.compile(r'(?:m[xyz]?|I[xyz]{2})(\d+)$')


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
    joint = before.covariance is not None and after.covariance is not None
    groups: dict[str, list[int]] = {}
    for position, name in enumerate(shared if joint else ()):
        groups.setdefault('' if name.rigid else f'effects of {name.joint}', []).append(position)
    places = [group for group in groups.values() if len(group) > 1]
    residuals = residual_changes(before.fit, after.fit)
    # probability that the list of changes contains a false change
    chance = 0.05 / sum((True, bool(places), bool(residuals)))
    chances = [_whole(sides, (first, second), shared, group)[2] for group in places]
    numbers = [*(side.values for side in sides), *(side.std for side in sides)]
    sure = beyond_chance(_single_chances(*sides), chance)
    changes = tuple(map(ParameterChange, shared, *(one.tolist() for one in numbers), sure))
    members = [tuple(shared[k] for k in group) for group in places]
    joints = ['' if own[0].rigid else own[0].joint for own in members]
    found = tuple(map(GroupChange, joints, members, chances, beyond_chance(chances, chance)))
    rigid = [k for k, name in enumerate(shared) if name.rigid]
    load = None
    moved = any(changes[k].changed for k in rigid) or any(g.changed and not g.joint for g in found)
    if joint and moved:
        terms = [first.terms.get(shared[k], {}) for k in rigid]
        load = _find_load(terms, *_whole(sides, (first, second), shared, rigid)[:2])
    left = beyond_chance([one.p_value for one in residuals], chance)
    return Comparison(
        before,
        after,
        changes,
        tuple(_only_in(before, second)),
        tuple(_only_in(after, first)),
        found,
        load,
        tuple(replace(one, changed=sure) for one, sure in zip(residuals, left, strict=True)),
        tuple(
            NotCompared(name, 'deviation')
            for name in dict.fromkeys((*before.without_std, *after.without_std))
        ),
    )


def _require_two_of_one_robot(before: ParameterFile, after: ParameterFile) -> None:
    """Raise an error if the joints differ, or if both results are the same."""
    if before.kinematics and after.kinematics and before.kinematics != after.kinematics:
        apart = set(before.joints).symmetric_difference(after.joints)
        how = (
            f'only one of them has {", ".join(sorted(apart))}'
            if apart
            else 'their joints have the same names, but other positions'
        )
        raise ModelError(
            f'{before.source} and {after.source} are of different robots, {before.robot} and '
            f'{after.robot}: {how}; name two results of one robot'
        )
    same = before.values == after.values and before.without_std == after.without_std
    if same and (before.values or before.without_std):
        copy = '' if before.source == after.source else f' (is {before.source})'
        raise ModelError(
            f'given twice: {after.source}{copy}; name results of two different recordings'
        )


def _nothing_shared(before: ParameterFile, after: ParameterFile) -> str:
    """Return the error message on two files that cannot be compared."""
    for one in (before, after):
        if not one.values and one.without_std:
            return (
                f'{one.source} has no standard deviation of any parameter, so changes cannot be '
                'tested; name a result of identify'
            )
    return (
        f'{before.source} and {after.source} have no identified parameter in common; '
        'are they of one robot, with one gravity?'
    )


def _only_in(one: ParameterFile, other: ParameterFile) -> Iterator[NotCompared]:
    """Yield the parameters that only one of two results has."""
    for name in one.values:
        if name in other.values or name in other.without_std:
            continue
        if (name.name, name.joint) in other.not_shown:
            yield NotCompared(name, 'motion')
        elif not name.rigid:
            yield NotCompared(name, 'effect')
        else:
            yield NotCompared(name, 'deviation' if other.without_std else 'grouping')


@dataclass(frozen=True)
class _Side:
    """Values, standard deviations and scatter of the shared parameters in one result."""

    values: FloatArray  # (p,)
    #: Standard deviations due to noise. If the scatter between recordings exceeds the noise of a
    #: joint, they are multiplied by the ratio.
    std: FloatArray
    scatter: FloatArray  # changes of the values without each recording, (K, p)
    #: Degrees of freedom of each standard deviation, infinite for noise. A mean square of n
    #: values with correlations R has n^2 / sum(R^2) times the degrees of one value
    #: (Satterthwaite).
    freedoms: FloatArray

    @classmethod
    def of(cls, known: ParameterFile, names: Sequence[ParameterName]) -> _Side:
        """Return the values of one file."""
        values, std = np.array([known.values[name] for name in names]).T
        scatter = known.scatter_of(names)
        freedoms = np.full(len(names), np.inf)
        if len(scatter) > 1 and np.all(std > 0.0):
            squares = np.sum((scatter / std) ** 2, axis=0)
            alike = (known.covariance_of(names) / np.outer(std, std)) ** 2
            std = std.copy()
            for joint in {name.joint for name in names}:
                own = [k for k, name in enumerate(names) if name.joint == joint]
                inflation = float(np.mean(squares[own]))
                if inflation > 1.0:
                    std[own] *= np.sqrt(inflation)
                    together = len(own) ** 2 / np.sum(alike[np.ix_(own, own)])
                    freedoms[own] = (len(scatter) - 1) * together
        return cls(values, std, scatter, freedoms)


def _single_chances(before: _Side, after: _Side) -> FloatArray:
    """Return the p-value of each difference, with degrees of freedom by Welch."""
    size, std = np.abs(after.values - before.values), np.hypot(before.std, after.std)
    same = size <= _ROUNDING * np.abs(before.values)
    safe = np.where(std > 0.0, std, 1.0)
    shares = [((side.std / safe) ** 4) / side.freedoms for side in (before, after)]
    with np.errstate(over='ignore', divide='ignore'):  # an infinite z-score has p-value 0
        chances = tail((size / safe) ** 2, 1, 1.0 / (shares[0] + shares[1]))
    return np.where(std > 0.0, chances, same)


def _whole(
    sides: Sequence[_Side],
    files: Sequence[ParameterFile],
    names: Sequence[ParameterName],
    group: Sequence[int],
) -> tuple[FloatArray, FloatArray, float]:
    """Return the differences of some parameters, their covariance and overall p-value."""
    own = [names[k] for k in group]
    difference = (sides[1].values - sides[0].values)[list(group)]
    covariance = files[0].covariance_of(own) + files[1].covariance_of(own)
    if not np.all(np.diag(covariance) > 0.0):
        return difference, covariance, 1.0
    # the covariance of noise is multiplied by the excess scatter between recordings
    scatter = np.concatenate([side.scatter[:, list(group)] for side in sides])
    inflation = 1.0
    if len(scatter):
        squares, rank = _squares(scatter, covariance)
        inflation = max(1.0, squares / rank)
    squares, rank = _squares(difference[np.newaxis], covariance)
    freedom = sum(max(len(side.scatter) - 1, 0) for side in sides)
    known = np.inf if inflation <= 1.0 else rank * freedom
    return difference, inflation * covariance, float(tail(squares / inflation, rank, known))


def _squares(rows: FloatArray, covariance: FloatArray) -> tuple[float, int]:
    """Return the summed squared Mahalanobis distances of rows (K, p), and the rank."""
    std = np.sqrt(np.diag(covariance))
    with np.errstate(over='ignore'):
        squares, rank = quadratic_form(rows / std, covariance / np.outer(std, std), _ROUNDING)
        return float(squares.sum()), int(rank.max())


def _find_load(
    terms: Sequence[Mapping[str, float]], difference: FloatArray, covariance: FloatArray
) -> LoadChange | None:
    """Return the load that explains the changes, on the outermost possible link, or None."""
    # arms hold loads at the outermost link; a mass not different from zero is no load
    std = np.sqrt(np.diag(covariance))
    if not len(std) or not np.all(std > 0.0):
        return None
    root = np.linalg.cholesky(covariance / np.outer(std, std) + 1e-12 * np.eye(len(std)))
    white = scipy.linalg.solve_triangular(root, difference / std, lower=True)
    numbers = {int(found[1]) for row in terms for key in row if (found := _NUMBERED.match(key))}
    loads = []
    for link in sorted(numbers):
        keys = [f'{symbol}{link}' for symbol in LINK_PARAMETERS]
        factors = np.array([[row.get(key, 0.0) for key in keys] for row in terms])
        columns = scipy.linalg.solve_triangular(root, factors / std[:, np.newaxis], lower=True)
        load = _load(link, columns, white)
        if load is not None:
            loads.append(load)
    if not loads:
        return None
    return replace(loads[-1], rivals=tuple(load.link for load in loads[:-1]))


def _load(link: int, columns: FloatArray, white: FloatArray) -> LoadChange | None:
    """Fit a load on one link to whitened changes of base parameters; None if it is rejected."""
    lengths = np.linalg.norm(columns, axis=0)
    scale = np.where(lengths > 0.0, lengths, 1.0)
    left, sizes, right = np.linalg.svd(columns / scale, full_matrices=False)
    # directions with smaller singular values are not identifiable
    seen = sizes > 1e-9 * sizes[0]
    left, sizes, right = left[:, seen], sizes[seen], right[seen]
    along = left.T @ white
    rest = float(white @ white - along @ along)
    freedom = len(white) - len(sizes)
    p_value = float(tail(rest, freedom)) if freedom > 0 else 0.0
    # significance at which a load is rejected as the explanation of the changes
    if p_value < 0.01 or np.linalg.norm(right[:, 0]) < 1.0 - 1e-6:
        return None
    values = (right.T @ (along / sizes)) / scale
    mass, std = float(values[0]), float(np.linalg.norm(right[:, 0] / sizes) / scale[0])
    if abs(mass) < HALF_WIDTH * std:
        return None
    whole = np.all(np.linalg.norm(right[:, 1:4], axis=0) > 1.0 - 1e-6)
    return LoadChange(link, mass, std, values[1:4] / mass if whole else None, p_value)


def residual_changes(
    before: KnownFit | None, after: KnownFit | None
) -> tuple[ResidualChange, ...]:
    """
    Compare the residuals of two models for each joint.

    Empty if the residuals are not comparable: the misfit of model.yaml and the residual of
    identification.json come from different rows. Model errors vary slowly, so even many rows
    contain few independent values of them.

    """
    if before is None or after is None or before.as_diagnosed != after.as_diagnosed:
        return ()
    freedoms = FREEDOM * after.recordings, FREEDOM * before.recordings
    found = []
    for joint in (one for one in before.rms if one in after.rms):
        torques = [one.torque(joint) for one in (before, after)]
        # residual of a joint, as a share of its torque, below which filters rather than the arm
        # cause it
        first, second = (
            max(one.rms[joint], 1e-3 * torque)
            for one, torque in zip((before, after), torques, strict=True)
        )
        # the residual of a model grows with the torque
        growth = torques[1] / torques[0] if min(torques) > 0.0 else 1.0
        ratio = 1.0 if first == second else second / first if first > 0.0 else np.inf
        ratio = float(ratio / np.clip(ratio, min(growth, 1.0), max(growth, 1.0)))
        with np.errstate(over='ignore'):
            square = np.square(ratio)
        p_value = 2.0 * min(stats.f.sf(square, *freedoms), stats.f.cdf(square, *freedoms))
        errors = before.errors.get(joint), after.errors.get(joint)
        left = before.rms[joint], after.rms[joint]
        found.append(ResidualChange(joint, *left, *errors, ratio, min(float(p_value), 1.0)))
    return tuple(found)
