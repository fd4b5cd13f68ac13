# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What is asked of an arm: which nuisance parameters it has, and which candidates are tried.

Candidates are every effect of the catalogue, per joint, pair or whole arm. An effect with shape
parameters is a family of candidates on a grid, of which the best is refined later by variable
projection (Golub and Pereyra 1973): values are fitted at each shape. The columns of an effect are
computed for all joints at once and divided among its candidates.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise, product

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.diagnosis.data.baseline import EXCITED, excited, Prior
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import make_problem, Problem, Projection
from armid_ros.diagnosis.data.trajectory import row_weights, Trajectory, Workspace
from armid_ros.diagnosis.search.fit import Fitted
from armid_ros.diagnosis.search.search_state import Nuisance
from armid_ros.diagnosis.search.trial import Candidate
from armid_ros.effects import CATALOGUE, Effect, Kind, Shape
from armid_ros.effects.friction import friction_level
from armid_ros.effects.gravity import with_exact_vector
from armid_ros.effects.unexplained import Unexplained
from armid_ros.errors import ModelError
from armid_ros.identification.fitting.normal_equations import NormalEquations
from armid_ros.model import BaseParameters, group_columns
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
from scipy import optimize

#: Most combinations of shape values that a search starts from.
_MOST_SHAPES = 12
#: Distance from a peak of a spectrum at which its side lobes may be, and its half width [1/rev].
_LOBES, _PEAK = 3.0, 0.2
#: Rounds of a refinement, and most evaluations of one line search.
_ROUNDS, _EVALUATIONS = 2, 9


@dataclass(frozen=True)
class Question:
    """
    What is asked of an arm.

    Attributes
    ----------
    arm : ArmModel
        The arm as given.
    base : BaseParameters or None
        Base parameters of it that are fitted; None where it stays as given.
    nuisance_arm : ArmModel
        The arm with friction and offsets also in joints for which none are given.
    nuisance_base : BaseParameters or None
        Base parameters of that which are fitted jointly with every candidate.
    unknown : tuple of Effect
        The friction and offsets that were added, joint by joint.
    most : int
        Most causes that are accepted.
    prior, nuisance_prior : Prior or None
        Information of the baseline about ``base`` and ``nuisance_base``.
    since : bool
        Whether what has changed is asked, and not what was always there.

    """

    arm: ArmModel
    base: BaseParameters | None
    nuisance_arm: ArmModel
    nuisance_base: BaseParameters | None
    unknown: tuple[Effect, ...]
    most: int
    prior: Prior | None = None
    nuisance_prior: Prior | None = None
    since: bool = False

    @property
    def body_is_free(self) -> bool:
        """Whether the rigid body is fitted anew, and not only effects without given values."""
        return frees_body(self.nuisance_base, self.arm)

    def kinds(self, library: Sequence[Kind]) -> tuple[Kind, ...]:
        """Return the effects to look for, of those that may be named."""
        if not self.since:
            return tuple(library)
        kinds = [kind.as_change() for kind in library]
        pairs = zip(self.arm.effects, self.arm.values, strict=True)
        kinds += friction_level(pairs, self.arm.robot, [kind.name for kind in library])
        return tuple(kinds)


def frees_body(base: BaseParameters | None, arm: ArmModel) -> bool:
    """Return whether any parameter of the rigid body is among those that are fitted."""
    return base is not None and bool(np.any(base.independent < len(arm.robot.rigid_parameters)))


def as_given(
    arm: ArmModel,
    data: Sequence[Trajectory],
    most: int,
    library: Sequence[str],
    beside: Sequence[Effect] = (),
) -> Question:
    """Ask what a model lacks whose given values are right; see `fitted_anew`."""
    arm, nuisance_arm, unknown = _arms(arm, library, beside)
    return Question(
        arm,
        _without_values(arm, data),
        nuisance_arm,
        _without_values(nuisance_arm, data),
        unknown,
        most,
    )


def fitted_anew(
    arm: ArmModel,
    data: Sequence[Trajectory],
    most: int,
    library: Sequence[str],
    rng: np.random.Generator,
    held: Sequence[int] = (),
    beside: Sequence[Effect] = (),
) -> Question:
    """
    Ask what a model lacks of which only the structure is believed: all values are fitted anew.

    Parameters
    ----------
    arm : ArmModel
        The arm.
    data : sequence of Trajectory
        The data.
    most : int
        Most causes that are accepted.
    library : sequence of str
        Names that may be given.
    rng : numpy.random.Generator
        Draws the states from which base parameters are found.
    held : sequence of int
        Parameters of the arm that stay as they are, so that a change of them is a candidate.
    beside : sequence of Effect
        What is fitted as well, with values of zero: only what is none of the others counts as it.

    """
    arm, nuisance_arm, unknown = _arms(arm, library, beside)
    base = _excited(arm, data, rng, held)
    nuisance_base = base if not unknown else _excited(nuisance_arm, data, rng, held)
    return Question(arm, base, nuisance_arm, nuisance_base, unknown, most)


def _arms(
    arm: ArmModel, library: Sequence[str], beside: Sequence[Effect]
) -> tuple[ArmModel, ArmModel, tuple[Effect, ...]]:
    """Return an arm with more effects, the same with unknown friction before them, and that."""
    fuller, unknown = with_friction(arm, library)
    if beside:
        arm, fuller = (
            memoized_arm(reduce(ArmModel.with_effect, beside, a)) for a in (arm, fuller)
        )
    return arm, fuller if unknown else arm, unknown


def _excited(
    arm: ArmModel, data: Sequence[Trajectory], rng: np.random.Generator, held: Sequence[int]
) -> BaseParameters:
    """Return the base parameters that data excite, without values that are held."""
    free = np.setdiff1d(np.arange(len(arm.parameters)), held)
    return excited(arm, arm.base_parameters(rng, free), data)[0]


def with_friction(arm: ArmModel, library: Sequence[str]) -> tuple[ArmModel, tuple[Effect, ...]]:
    """Return an arm with all effects that any joint may be taken to have, and those added."""
    there = {(effect.name, joint) for effect in arm.effects for joint in effect.joints}
    added: list[Effect] = []
    fuller = arm
    for kind in CATALOGUE.values():
        joints = tuple(j for j in arm.robot.joints if (kind.name, j) not in there)
        if kind.traits.everywhere and kind.name in library and joints:
            fuller = fuller.with_effect(kind.on(arm.robot, joints))
            added += [kind.on(arm.robot, (joint,)) for joint in joints]
    return fuller, tuple(added)


def _without_values(arm: ArmModel, data: Sequence[Trajectory]) -> BaseParameters | None:
    """Return the effect parameters with a value of zero, as far as the data determine them."""
    rigid = len(arm.robot.rigid_parameters)
    names, theta = arm.parameters, arm.theta
    free = np.array([k for k in range(rigid, len(names)) if theta[k] == 0.0], dtype=np.intp)  # noqa: RUF069 - an effect without a value
    if not len(free):
        return None
    columns = [part.reduce(arm.effect_columns(part.motion)[:, :, free - rigid]) for part in data]
    stacked = np.concatenate([block.reshape(-1, len(free)) for block in columns])
    return group_columns(stacked, tuple(names[k] for k in free), EXCITED).among(names, free)


def candidate_effects(
    robot: Robot, kinds: Sequence[Kind]
) -> Iterator[tuple[Effect, list[Effect]]]:
    """Yield effects whose columns are computed at once, and the single ones they consist of."""
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
            yield kind.on(robot, single), [kind.on(robot, (joint,)) for joint in single]


def shaped(
    effect: Effect, members: list[Effect], arm: ArmModel, unexplained: Unexplained
) -> Iterator[tuple[Effect, list[Effect]]]:
    """Yield an effect and its single ones with every shape from which a search starts."""
    if not effect.shapes:
        yield effect, members
        return
    grids = effect.shape_starts(unexplained, arm)
    counts = [grid.shape[1] for grid in grids]
    together = len(set(counts)) == 1 and int(np.prod(counts)) > _MOST_SHAPES
    chosen = (
        [(k,) * len(counts) for k in range(counts[0])]
        if together
        else list(product(*(range(count) for count in counts)))
    )
    for index in chosen:
        values = np.column_stack([grid[:, k] for grid, k in zip(grids, index, strict=True)])
        lower = np.array([s.lower for s in effect.shapes])
        upper = np.array([s.upper for s in effect.shapes])
        values = np.clip(values, lower, upper)
        rows = values if len(members) > 1 else [values.ravel()]
        whole = effect.with_shape(values)
        yield whole, [m.with_shape(row) for m, row in zip(members, rows, strict=True)]


@dataclass(frozen=True)
class Candidates:
    """
    All candidates with their columns in rows.

    Attributes
    ----------
    candidates : tuple of Candidate
        The candidates.
    columns : tuple of ndarray, each (M, n, C)
        Columns of all candidates, per trajectory, filtered and decimated.

    """

    candidates: tuple[Candidate, ...]
    columns: tuple[FloatArray, ...]


def candidates(
    fitted: Fitted,
    evidence: Evidence,
    kinds: Sequence[Kind],
) -> Candidates:
    """Compute the columns of every effect that was not named yet."""
    arm, data = memoized_arm(fitted.arm), evidence.data
    unexplained = _unexplained(fitted, evidence)
    taken = {(own.effect.name, own.effect.joints) for own in fitted.named}
    candidates: list[Candidate] = []
    blocks: list[list[FloatArray]] = [[] for _ in data]
    start = 0
    for effect, members in candidate_effects(arm.robot, kinds):
        for whole, singles in shaped(effect, members, arm, unexplained):
            for block, part in zip(blocks, data, strict=True):
                block.append(part.columns(arm, whole))
            for single in singles:
                size = len(single.parameters(arm.robot))
                if (single.name, single.joints) not in taken:
                    for kept in single.traits.separate or (tuple(range(size)),):
                        span = slice(start + kept[0], start + kept[-1] + 1)
                        candidates.append(Candidate(single, span, kept, arm.robot))
                start += size
    return Candidates(tuple(candidates), tuple(np.concatenate(block, axis=2) for block in blocks))


def _unexplained(fitted: Fitted, evidence: Evidence) -> Unexplained:
    """Return the residual of a fitted arm, with its motion, weights and nuisance columns."""
    data = evidence.data
    motions = [part.motion for part in data]
    arrays = (
        np.concatenate([getattr(motion, name) for motion in motions])
        for name in ('t', 'q', 'dq', 'ddq', 'tau')
    )
    return Unexplained(
        Motion(motions[0].joints, *arrays),
        np.concatenate([part.motion.q[part.rows] for part in data]),
        np.concatenate(fitted.residual),
        row_weights(data, evidence.sigma),
        np.concatenate(fitted.columns),
    )


def refine(
    problem: Problem,
    projection: Projection,
    candidate: Candidate,
    residual: FloatArray,
    work: Workspace,
) -> tuple[Candidate, FloatArray]:
    """
    Refine the shape of a candidate by variable projection; return it with its columns.

    The nuisance columns are projected out of the residual already.

    """
    effect, kept = candidate.effect, candidate.kept
    lower, upper = (bound[list(kept)] for bound in effect.bounds())
    cache: dict[tuple[float, ...], tuple[float, FloatArray]] = {}

    def gain(shape: FloatArray) -> float:
        key = tuple(shape.tolist())
        if key not in cache:
            try:
                columns = work.columns(effect.with_shape(shape), kept)
            except ModelError:
                return 0.0  # not possible: no gain
            weighted = (columns * problem.weight[:, :, np.newaxis]).reshape(-1, len(kept))
            own, aim = projection.products(weighted), weighted.T @ residual.ravel()
            values = np.linalg.lstsq(own, aim, rcond=1e-9)[0]
            if len(kept) == 1:  # an impossible value is no gain
                values = np.clip(values, lower, upper)
            cache[key] = float(2.0 * values @ aim - values @ own @ values), columns
        return cache[key][0]

    shape = np.array(effect.shape)
    gain(shape)
    for _ in range(_ROUNDS if len(shape) > 1 else 1):
        for index, kind in enumerate(effect.shapes):
            shape = _line_search(gain, shape, index, kind)
    best = max(cache, key=lambda key: cache[key][0])
    return replace(candidate, effect=effect.with_shape(best)), cache[best][1]


def _line_search(
    gain: Callable[[FloatArray], float], shape: FloatArray, index: int, kind: Shape
) -> FloatArray:
    """Search one shape near its present value, over its logarithm if positive (Brent 1973)."""
    value = float(shape[index])
    positive = kind.lower > 0.0 and value > 0.0 and kind.near is None and kind.unit != '1/rev'

    def at(x: float) -> FloatArray:
        moved = shape.copy()
        moved[index] = np.exp(x) if positive else x
        return moved

    if kind.unit == '1/rev':  # side lobes beside the peak are almost as high
        scan = value + np.linspace(-_LOBES, _LOBES, 25)
        value = max(scan[scan > kind.lower].tolist(), key=lambda x: gain(at(x)))
        low, high = value - _PEAK, value + _PEAK
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
        options={'maxiter': _EVALUATIONS},
    )
    return at(found.x) if -found.fun > gain(shape) else shape


def nuisance_of(
    found: Candidates, current: Fitted, evidence: Evidence
) -> tuple[Problem, Nuisance]:
    """
    Return the problem of all candidates, and its nuisance parameters, whose columns come last.

    The prior of the shapes of names is as precise as all data determine them: one fold alone may
    hardly determine where a strap is fixed, and would predict the others by that.

    """
    pairs = zip(found.columns, current.columns, strict=True)
    columns = [np.concatenate(pair, axis=2) for pair in pairs]
    problem = make_problem(evidence.data, evidence.sigma, current.residual, columns)
    size = problem.x.shape[2]
    free = tuple(range(size - current.columns[0].shape[2], size))
    shaped = np.zeros(len(free))
    first = len(free) - len(current.estimate.values)
    shapes = [first + k for _, own in current.places for k in own]
    shaped[shapes] = np.sum(problem.x[:, :, [free[k] for k in shapes]] ** 2, axis=(0, 1))
    held = NormalEquations(np.diag(shaped), np.zeros(len(shaped)))
    return problem, Nuisance(free, current.prior + held)
