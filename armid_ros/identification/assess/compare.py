# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Comparison of two identifications: significant changes of parameters, payload and residuals.

With dozens of parameters, one in twenty is outside its 95 % interval by chance. Differences are
therefore corrected for their number (Holm 1979): with 95 % probability, the list of changes
contains no false one.

A model has errors in every motion, and other motions give other values. The scatter of values
between recordings widens the deviations of each joint, if the files contain it. Few recordings
determine the scatter badly, so tests use Student's distribution, and Fisher's for groups.

The effects of each joint and the links are tested as groups too: strongly correlated parameters
can differ significantly as a group although no single one does. The
residuals of the two models in each joint are compared (Fisher's F), because a change that
neither model describes appears in no parameter.

A body that is fixed to link k adds its ten parameters p to those of the link. Base parameters then
change by G_k p, with the factors G_k of the parameters of link k in them. If ten numbers p
explain dozens of changes within their uncertainty, they are a load; the first number is its mass.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
import re

from armid_ros.changes.statistic import beyond_chance, tail
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
    Find the significant changes of parameters between two identifications of one robot.

    Raises
    ------
    ModelError
        If they are of two robots, are equal, or have no parameter in common.

    """
    _check_comparable(before, after)
    first, second = max(
        ((before.regrouped_as(after), after), (before, after.regrouped_as(before))),
        key=lambda pair: len(pair[0].values.keys() & pair[1].values.keys()),
    )
    shared = [name for name in first.values if name in second.values]
    if not shared:
        raise ModelError(
            f'{before.source} and {after.source} have no identified parameter in common; '
            'name two results of one robot, with one gravity'
        )
    grouped: dict[tuple[bool, str], list[ParameterName]] = {}
    for name in shared:
        grouped.setdefault((name.rigid, '' if name.rigid else name.joint), []).append(name)
    members = {group: tuple(own) for group, own in grouped.items() if len(own) > 1}
    residuals = residual_changes(before.fit, after.fit)
    # probability that the list of changes contains a false change
    chance = 0.05 / sum((True, bool(members), bool(residuals)))
    values, std, p_values = _single_changes(first, second, shared)
    numbers = *values.tolist(), *std.tolist(), beyond_chance(p_values, chance)
    changes = tuple(map(ParameterChange, shared, *numbers))
    chances = [_common_change(first, second, own)[2] for own in members.values()]
    joints, significant = [name for _, name in members], beyond_chance(chances, chance)
    groups = tuple(map(GroupChange, joints, members.values(), chances, significant))
    load = None
    rigid = [change for change in changes if change.parameter.rigid]
    body_changed = any(one.changed for one in rigid)
    if body_changed or any(one.changed for one in groups if not one.joint):
        names = [change.parameter for change in rigid]
        terms = [first.terms.get(name, {}) for name in names]
        load = _find_load(terms, *_common_change(first, second, names)[:2])
    significant = beyond_chance([one.p_value for one in residuals], chance)
    return Comparison(
        before,
        after,
        changes,
        tuple(_only_in(before, second)),
        tuple(_only_in(after, first)),
        groups,
        load,
        tuple(replace(one, changed=so) for one, so in zip(residuals, significant, strict=True)),
    )


def _check_comparable(before: ParameterFile, after: ParameterFile) -> None:
    """Raise an error unless two results are of one robot, differ, and have covariances."""
    for file in (before, after):
        if file.covariance is None:
            raise ModelError(
                f'{file.source} has no covariance of its parameters, so changes cannot be tested; '
                'name the folder that armid identify wrote'
            )
    if before.kinematics and after.kinematics and before.kinematics != after.kinematics:
        apart = set(before.joints).symmetric_difference(after.joints)
        difference = (
            f'only one of them has {", ".join(sorted(apart))}'
            if apart
            else 'their joints have the same names, but other positions'
        )
        raise ModelError(
            f'{before.source} and {after.source} are of different robots, {before.robot} and '
            f'{after.robot}: {difference}; name two results of one robot'
        )
    if before.values == after.values and before.values:
        raise ModelError(
            f'{before.source} and {after.source} have equal parameters; name results of two '
            'different recordings'
        )


def _only_in(one: ParameterFile, other: ParameterFile) -> Iterator[NotCompared]:
    """Yield the parameters of `one` that `other` does not have, with the reasons."""
    for name in one.values:
        if name in other.values:
            continue
        if (name.name, name.joint) in other.not_shown:
            yield NotCompared(name, 'motion')
        else:
            yield NotCompared(name, 'grouping' if name.rigid else 'effect')


def _single_changes(
    before: ParameterFile, after: ParameterFile, names: Sequence[ParameterName]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return values and standard deviations of parameters in two results, p-values of no change.

    The shapes are (2, p), (2, p) and (p,). Standard deviations are those of noise. If the scatter
    between recordings exceeds the noise of a joint, they are multiplied by the ratio.

    """
    known = np.array([[one.values[name] for name in names] for one in (before, after)])
    values, std = known[..., 0], known[..., 1].copy()
    # degrees of freedom of each standard deviation, infinite for noise
    freedom = np.full(std.shape, np.inf)
    for one, own_std, own_freedom in zip((before, after), std, freedom, strict=True):
        scatter = one.scatter_of(names)
        if len(scatter) < 2 or not np.all(own_std > 0.0):
            continue
        squares = np.sum((scatter / own_std) ** 2, axis=0)
        correlation = one.covariance_of(names) / np.outer(own_std, own_std)
        for joint in {name.joint for name in names}:
            own = [k for k, name in enumerate(names) if name.joint == joint]
            inflation = float(np.mean(squares[own]))
            if inflation > 1.0:
                own_std[own] *= np.sqrt(inflation)
                # a mean square of n values with correlations R has n^2 / sum(R^2) times the
                # degrees of one value (Satterthwaite)
                times = len(own) ** 2 / np.sum(correlation[np.ix_(own, own)] ** 2)
                own_freedom[own] = (len(scatter) - 1) * times
    change, of_change = values[1] - values[0], np.hypot(*std)
    same = np.abs(change) <= _ROUNDING * np.abs(values[0])
    safe = np.where(of_change > 0.0, of_change, 1.0)
    shares = np.sum((std / safe) ** 4 / freedom, axis=0)
    with np.errstate(over='ignore', divide='ignore'):  # an infinite z-score has p-value 0
        p_values = tail((change / safe) ** 2, 1, 1.0 / shares)  # degrees of freedom by Welch
    return values, std, np.where(of_change > 0.0, p_values, same)


def _common_change(
    before: ParameterFile, after: ParameterFile, names: Sequence[ParameterName]
) -> tuple[FloatArray, FloatArray, float]:
    """Return parameter changes, their covariance, and the p-value of no change."""
    files = before, after
    difference = np.array([after.values[name][0] - before.values[name][0] for name in names])
    covariance = sum((one.covariance_of(names) for one in files), np.zeros(()))
    std = np.sqrt(np.diag(covariance))
    if not np.all(std > 0.0):
        return difference, covariance, 1.0
    sizes, axes = np.linalg.eigh(covariance / np.outer(std, std))
    kept = sizes > _ROUNDING * sizes[-1]
    white = axes[:, kept] / np.sqrt(sizes[kept]) / std[:, np.newaxis]
    rank = int(kept.sum())
    scatters = [one.scatter_of(names) for one in files]
    freedom = sum(max(len(scatter) - 1, 0) for scatter in scatters)
    with np.errstate(over='ignore'):
        # the covariance of noise is multiplied by the excess scatter between recordings
        excess = float(np.sum((np.concatenate(scatters) @ white) ** 2)) / rank
        square = float(np.sum((difference @ white) ** 2))
    inflation = max(1.0, excess)
    known = np.inf if excess <= 1.0 else rank * freedom
    return difference, inflation * covariance, float(tail(square / inflation, rank, known))


def _find_load(
    terms: Sequence[Mapping[str, float]], difference: FloatArray, covariance: FloatArray
) -> LoadChange | None:
    """Return the payload that explains all changes, on the outermost possible link, or None."""
    std = np.sqrt(np.diag(covariance))
    if not len(std) or not np.all(std > 0.0):
        return None
    root = np.linalg.cholesky(covariance / np.outer(std, std) + 1e-12 * np.eye(len(std)))
    white = scipy.linalg.solve_triangular(root, difference / std, lower=True)
    numbers = {int(found[1]) for row in terms for key in row if (found := _NUMBERED.match(key))}
    loads: list[LoadChange] = []
    for link in sorted(numbers):
        keys = [f'{symbol}{link}' for symbol in LINK_PARAMETERS]
        factors = np.array([[row.get(key, 0.0) for key in keys] for row in terms])
        columns = scipy.linalg.solve_triangular(root, factors / std[:, np.newaxis], lower=True)
        lengths = np.linalg.norm(columns, axis=0)
        scale = np.where(lengths > 0.0, lengths, 1.0)
        left, sizes, right = np.linalg.svd(columns / scale, full_matrices=False)
        # directions with smaller singular values are not identifiable
        seen = sizes > 1e-9 * sizes[0]
        left, sizes, right = left[:, seen], sizes[seen], right[seen]
        along = left.T @ white
        freedom = len(white) - len(sizes)
        unexplained = float(white @ white - along @ along)
        p_value = float(tail(unexplained, freedom)) if freedom > 0 else 0.0
        # significance at which a load is rejected as the explanation of the changes
        if p_value < 0.01 or np.linalg.norm(right[:, 0]) < 1.0 - 1e-6:
            continue
        values = (right.T @ (along / sizes)) / scale
        mass, mass_std = float(values[0]), float(np.linalg.norm(right[:, 0] / sizes) / scale[0])
        if abs(mass) < HALF_WIDTH * mass_std:  # a mass not different from zero is no load
            continue
        moments_known = np.all(np.linalg.norm(right[:, 1:4], axis=0) > 1.0 - 1e-6)
        center = values[1:4] / mass if moments_known else None
        loads.append(LoadChange(link, mass, mass_std, center, p_value))
    if not loads:
        return None
    # arms hold loads at the outermost link
    return replace(loads[-1], rivals=tuple(load.link for load in loads[:-1]))


def residual_changes(
    before: KnownFit | None, after: KnownFit | None
) -> tuple[ResidualChange, ...]:
    """
    Return the change of each joint's root mean square residual between two models.

    Empty if a file has no residuals. Model errors vary slowly, so even many samples contain few
    independent values of them.

    """
    if before is None or after is None:
        return ()
    freedoms = FREEDOM * after.recordings, FREEDOM * before.recordings
    found = []
    for joint in (one for one in before.misfit.rms if one in after.misfit.rms):
        left = [one.misfit.rms[joint] for one in (before, after)]
        torques = [(one.misfit.torque_rms or {}).get(joint, 0.0) for one in (before, after)]
        # a residual below this share of the torque of a joint is caused by filters, not by the arm
        first, second = (
            max(rms, 1e-3 * torque) for rms, torque in zip(left, torques, strict=True)
        )
        # the residual of a model grows with the torque
        growth = torques[1] / torques[0] if min(torques) > 0.0 else 1.0
        ratio = 1.0 if first == second else second / first if first > 0.0 else np.inf
        ratio = float(ratio / np.clip(ratio, min(growth, 1.0), max(growth, 1.0)))
        with np.errstate(over='ignore'):
            square = np.square(ratio)
        p_value = 2.0 * min(stats.f.sf(square, *freedoms), stats.f.cdf(square, *freedoms))
        before_error, after_error = (
            100.0 * rms / torque if torque else None
            for rms, torque in zip(left, torques, strict=True)
        )
        found.append(
            ResidualChange(
                joint, left[0], left[1], before_error, after_error, ratio, min(float(p_value), 1.0)
            )
        )
    return tuple(found)
