# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Generation of the candidate causes: each effect of the catalogue, per joint, pair or whole arm.

An effect with shapes gives one cause per point of a grid of shapes; the shape of the best cause is
optimised later. The columns of an effect are computed for all joints at once.

"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise, product
from math import comb
from types import MappingProxyType

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.trajectory import Trajectory
from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.hyperparameters import NuisancePosterior
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.odds import CauseInformation, fit_causes
from armid_ros.diagnosis.settings import HOW_OFTEN, log_prior
from armid_ros.effects import Effect, Shape
from armid_ros.effects.base import Unexplained
from armid_ros.effects.gravity import with_exact_vector
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
from scipy import optimize

#: Smallest share of samples in which an effect with slack has no torque: a strap that is taut in
#: all samples fits as a spring.
_MIN_SHARE_AT_REST = 0.1
#: Reference temperatures where none is measured.
_NO_REFERENCE: Mapping[str, float] = MappingProxyType({})
#: Largest mass [1], first moments [m] and inertias [m^2] of a body, divided by its mass.
_BODY_SIZES = np.array([1.0, *3 * [0.1], *6 * [0.01]])


@dataclass(frozen=True)
class Causes:
    """
    Candidate causes of a residual, with their regressor columns.

    Attributes
    ----------
    kinds : tuple of type of Effect
        Classes of effects that may be named.
    nuisance : Nuisance
        Regression problem without accepted causes.
    changed : bool
        Whether causes are changes since a baseline, and not permanent errors of the model.
    fitted : frozenset of (str, tuple of str)
        Names and joints of the effects that are nuisance parameters.
    prior : mapping of str to str
        Frequency of effects by name, chosen by the user; see `HOW_OFTEN`.
    reference : mapping of str to float
        Reference temperatures of the joints [degC].

    """

    kinds: tuple[type[Effect], ...]
    nuisance: Nuisance
    changed: bool
    fitted: frozenset[tuple[str, tuple[str, ...]]]
    prior: Mapping[str, str] = field(default_factory=dict)
    reference: Mapping[str, float] = field(default_factory=dict)
    _known: dict[tuple[str, tuple[int, ...]], Cause | None] = field(
        default_factory=dict, compare=False
    )

    def causes(self, nuisance: Nuisance, posterior: NuisancePosterior) -> list[Cause]:
        """Return the causes not accepted yet, at all start values of shape parameters."""
        arm, result, families = nuisance.arm, list[Cause](), list[Cause]()
        there = [one.effect for one in nuisance.accepted]
        taken = {(one.name, place) for one in there for place in (one.joints, *zip(one.joints))}
        bodies = {one.adds_to(arm.robot) for one in there} - {()}
        unexplained = _unexplained(nuisance, posterior)
        for whole, members in candidate_effects(arm.robot, self.kinds, self.reference):
            for effect, singles in with_starting_shapes(whole, members, arm, unexplained):
                singly = [
                    cause
                    for cause in self._single_causes(effect, singles)
                    if (cause.effect.name, cause.effect.joints) not in taken | self.fitted
                    and cause.effect.adds_to(arm.robot) not in bodies
                ]
                result += singly
                # One cause, such as temperature or grease, changes the friction of several joints
                # (Bittencourt and Gunnarsson 2012).
                common = effect.traits.usual or effect.lasting
                if effect.traits.friction and common and len(singly) > 1:
                    families += self._family(singly, nuisance, posterior)
        counts = Counter(cause.key for cause in result)
        result = [replace(cause, shapes=counts[cause.key]) for cause in result]
        return [*result, *families]

    def _family(
        self, singles: Sequence[Cause], nuisance: Nuisance, posterior: NuisancePosterior
    ) -> Iterator[Cause]:
        """
        Yield a friction law on the set of at least two joints that fits best (Bayes factor).

        Values of joints are independent, with one prior; all numbers of joints are equally likely.

        """
        first, count = singles[0].effect, len(singles)
        size = len(first.quantities)
        whole = replace(first, joints=tuple(one.effect.joints[0] for one in singles))
        (every,) = self._single_causes(whole, [whole])
        known = CauseInformation.of([every], nuisance, posterior, pooled=True)

        def among(members: tuple[int, ...]) -> tuple[float, Cause]:
            values = np.add.outer(size * np.array(members), np.arange(size)).ravel()
            effect = replace(first, joints=tuple(whole.joints[k] for k in members))
            cause = every.among(effect, values, comb(count, len(members)))
            (fit,) = fit_causes([cause], nuisance, known.among(values))
            return fit.factor + cause.prior, cause

        chosen = tuple(range(count))
        best, found = among(chosen)
        while len(chosen) > 1:
            fewer = [chosen[:k] + chosen[k + 1 :] for k in range(len(chosen))]
            tried = [among(members) for members in fewer]
            k = max(range(len(tried)), key=lambda k: tried[k][0])
            if tried[k][0] <= best:
                yield found
                return
            (best, found), chosen = tried[k], fewer[k]

    @property
    def effects(self) -> Iterator[Effect]:
        """Yield the effect of each candidate cause: on a joint, a pair of joints, or the arm."""
        for _, members in candidate_effects(self.nuisance.arm.robot, self.kinds):
            yield from (one for one in members if (one.name, one.joints) not in self.fitted)

    def _single_causes(self, effect: Effect, singles: Sequence[Effect]) -> Iterator[Cause]:
        """Yield a cause for each single-joint effect, from one effect on all joints."""
        robot, start = self.nuisance.arm.robot, 0
        places: list[tuple[Effect, tuple[int, ...], list[int]]] = []
        for one in singles:
            size = len(one.parameters(robot))
            for kept in one.traits.separate or (tuple(range(size)),):
                places.append((one, kept, [start + k for k in kept]))
            start += size
        keys = [(repr(one), kept) for one, kept, _ in places]
        if not all(key in self._known for key in keys):
            try:
                columns = self._columns(effect)
            except ModelError:
                return
            for key, (one, kept, span) in zip(keys, places, strict=True):
                self._known[key] = self.candidate(one, kept, [x[:, :, span] for x in columns])
        yield from filter(None, (self._known[key] for key in keys))

    @cached_property
    def _predicted(self) -> list[Trajectory]:
        """Return the trajectories with modelled instead of measured torque."""
        # columns that contain the measured torque would explain any residual
        arm, data = self.nuisance.arm, self.nuisance.rows.data
        return [replace(x, motion=x.motion.with_torque(arm.torque(x.motion))) for x in data]

    def _columns(self, effect: Effect) -> list[FloatArray]:
        """Return the regressor columns of an effect in each trajectory, (M, n, p)."""
        return [part.columns(self.nuisance.arm, effect) for part in self._predicted]

    def reshaped(self, cause: Cause, shape: FloatArray) -> Cause | None:
        """Return the cause with other shape parameters; None if impossible or without torque."""
        try:
            effect = cause.effect.with_shape(shape)
            columns = self._columns(effect)
        except ModelError:
            return None
        other = self.candidate(effect, cause.kept, [x[:, :, list(cause.kept)] for x in columns])
        if other is None or other.kept != cause.kept:
            return None
        return replace(other, shapes=cause.shapes)

    def candidate(
        self, effect: Effect, kept: tuple[int, ...], columns: Sequence[FloatArray]
    ) -> Cause | None:
        """
        Return the cause with given regressor columns (M, n, p); None if they are zero.

        Columns are zero in diagnosed recordings without any torque of the effect. None as well for
        a strap that is taut in all samples: it equals a spring.

        """
        rows, robot = self.nuisance.rows, self.nuisance.arm.robot
        torque = rows.rms_of_diagnosed(columns)
        seen = torque.any(axis=0)
        resting = [~columns[k].any(axis=(1, 2)) for k in rows.diagnosed_parts]
        taut = float(np.mean(np.concatenate(resting))) < _MIN_SHARE_AT_REST
        if not seen.any() or (effect.traits.rests and taut):
            return None
        return cause_of(
            self.nuisance,
            effect,
            tuple(kept[k] for k in np.flatnonzero(seen).tolist()),
            [x[:, :, seen] for x in columns],
            value_unit(self.nuisance, effect, kept, torque)[seen],
            log_prior(effect, robot, self.changed)
            + HOW_OFTEN[self.prior.get(effect.name, 'usual')],
            torque[:, seen],
        )


def value_unit(
    nuisance: Nuisance, effect: Effect, kept: Sequence[int], torque: FloatArray
) -> FloatArray:
    """
    Return the parameter values (p,) at which an effect's torque equals the joint torque.

    A scale is at most the largest plausible value. The torque per unit value is the root mean
    square in the diagnosed recordings, (n, p) [N m].

    """
    rows, robot = nuisance.rows, nuisance.arm.robot
    spread = effect.spread(robot)
    if len(spread) == len(effect.owners) * len(effect.quantities):
        most = [q.largest(owner, robot) for owner in effect.owners for q in effect.quantities]
        spread = np.where(np.isinf(spread), most, spread)
    spread = spread[list(kept)]
    if effect.adds_to(robot):  # a load and a link error have the same columns
        spread = (float(robot.rigid_parameters[::10].sum()) * _BODY_SIZES)[list(kept)]
    largest = 1.0 / np.maximum(np.max(torque / rows.torque[:, np.newaxis], axis=0), 1e-12)
    return np.asarray(np.minimum(largest, np.where(spread > 0.0, spread, np.inf)))


def cause_of(
    nuisance: Nuisance,
    effect: Effect,
    kept: tuple[int, ...],
    columns: Sequence[FloatArray],
    unit: FloatArray,
    prior: float = 0.0,
    torque: FloatArray | None = None,
) -> Cause:
    """
    Weight the columns of an effect, and compute their inner products with other columns.

    Parameters
    ----------
    nuisance : Nuisance
        Regression problem with rows and nuisance columns.
    effect : Effect
        The effect, with its joints and shape.
    kept : tuple of int
        Indices of its parameters that are fitted.
    columns : sequence of ndarray, each (M, n, p)
        Columns in each trajectory.
    unit : ndarray, shape (p,)
        Scale of each value.
    prior : float
        Prior log odds.
    torque : ndarray, shape (n, p), optional
        Torque per unit value in the diagnosed recordings [N m].

    """
    joints = np.flatnonzero(np.any([x.any(axis=(0, 2)) for x in columns], axis=0)).tolist()
    weighted = nuisance.rows.weighted(columns, joints)
    products, aim, squares = [], [], []
    for k, (y, z) in enumerate(zip(nuisance.residual, weighted, strict=True)):
        product = np.zeros((nuisance.columns[k].shape[2], len(unit)))
        for joint, own_rows in zip(joints, z, strict=True):
            place, columns_of_joint = nuisance.acting[k][joint]
            product[place] += columns_of_joint.T @ own_rows
        products.append(product)
        flat = z.reshape(-1, len(unit))
        aim.append(flat.T @ y[joints].ravel())
        squares.append(flat.T @ flat)
    return Cause(
        effect,
        kept,
        unit,
        prior,
        tuple(joints),
        tuple(weighted),
        np.array(products),
        np.array(squares),
        np.array(aim),
        np.zeros((len(nuisance.rows.torque), len(unit))) if torque is None else torque,
    )


def _unexplained(nuisance: Nuisance, posterior: NuisancePosterior) -> Unexplained:
    """Return motion, residual and nuisance columns, with which effects choose start values."""
    rows = nuisance.rows
    values = nuisance.means(posterior)
    motions = [part.motion for part in rows.data]
    arrays = (
        np.concatenate([getattr(motion, name) for motion in motions])
        for name in ('t', 'q', 'dq', 'ddq', 'tau')
    )
    weight = np.concatenate(rows.weight)
    scale = np.where(weight > 0.0, weight, 1.0)
    residual = np.concatenate(
        [nuisance.residual_at(values, k) for k in range(len(rows.diagnosed))], axis=1
    ).T
    columns = np.concatenate([x[:, :, : nuisance.base.rank] for x in nuisance.columns], axis=1)
    diagnosed = np.concatenate([np.full(len(p.rows), rows.diagnosed[p.fold]) for p in rows.data])
    return Unexplained(
        Motion(motions[0].joints, *arrays),
        np.concatenate([part.at_rows.q for part in rows.data]),
        residual / scale,
        weight * diagnosed[:, np.newaxis],
        columns.swapaxes(0, 1) / scale[:, :, np.newaxis],
    )


def candidate_effects(
    robot: Robot, kinds: Sequence[type[Effect]], reference: Mapping[str, float] = _NO_REFERENCE
) -> Iterator[tuple[Effect, list[Effect]]]:
    """Yield each effect on all joints, with its copies on one joint, a pair, or the arm."""
    for kind in with_exact_vector(kinds):
        try:
            places = kind.places(robot)
        except ModelError:
            continue
        single = tuple(place[0] for place in places if len(place) == 1)
        for place in places:
            if len(place) != 1:
                effect = kind.on(robot, place)
                yield effect, [effect]
        if single:
            groups = (single, *((joint,) for joint in single))
            whole, *members = (kind.on(robot, one).referred_to(reference) for one in groups)
            yield whole, members


def with_starting_shapes(
    effect: Effect, members: list[Effect], arm: ArmModel, unexplained: Unexplained
) -> Iterator[tuple[Effect, list[Effect]]]:
    """Yield an effect and its single-joint copies for each start value of shape parameters."""
    if not effect.shapes:
        yield effect, members
        return
    grids = effect.shape_starts(unexplained, arm)
    counts = [grid.shape[1] for grid in grids]
    indices = list(product(*(range(count) for count in counts)))
    if len(indices) > 12 and len(set(counts)) == 1:  # too many: only the diagonal of the grid
        indices = [(k,) * len(counts) for k in range(counts[0])]
    lower, upper = ([getattr(s, end) for s in effect.shapes] for end in ('lower', 'upper'))
    for index in indices:
        values = np.column_stack([grid[:, k] for grid, k in zip(grids, index, strict=True)])
        values = np.clip(values, lower, upper)
        rows = values if len(members) > 1 else [values.ravel()]
        whole = effect.with_shape(values)
        yield whole, [m.with_shape(row) for m, row in zip(members, rows, strict=True)]


def line_search(
    gain: Callable[[FloatArray], float], shape: FloatArray, index: int, kind: Shape
) -> FloatArray:
    """Move one shape parameter to the maximum of `gain` by Brent's method (1973)."""
    value = float(shape[index])
    positive = kind.lower > 0.0 and value > 0.0 and kind.near is None and kind.unit != '1/rev'

    def at(x: float) -> FloatArray:
        moved = shape.copy()
        moved[index] = np.exp(x) if positive else x
        return moved

    if kind.unit == '1/rev':  # a peak is 0.4 wide; its side lobes are almost as high
        scan = value + np.linspace(-3.0, 3.0, 25)
        value = max(scan[scan > kind.lower].tolist(), key=lambda x: gain(at(x)))
        low, high = value - 0.2, value + 0.2
    elif positive:
        ratio = max([b / a for a, b in pairwise(sorted(kind.grid)) if a > 0.0] or [3.0])
        ratio = min(ratio, 3.5)
        low = np.log(max(kind.lower, value / ratio))
        high = np.log(min(kind.upper, value * ratio))
    else:
        apart = max([b - a for a, b in pairwise(sorted(kind.grid))] or [0.0])
        near = kind.near or max(0.15, apart / max(abs(value), 1e-300))
        reach = max(near * abs(value), 1e-3)
        low, high = max(kind.lower, value - reach), min(kind.upper, value + reach)
    found = optimize.minimize_scalar(
        lambda x: -gain(at(x)),
        bounds=(low, high),
        method='bounded',
        options={'maxiter': 9},
    )
    return at(found.x) if -found.fun > gain(shape) else shape
