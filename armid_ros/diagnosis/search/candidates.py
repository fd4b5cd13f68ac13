# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The candidates that may be named: every effect of the catalogue, per joint, pair or whole arm.

An effect with shape parameters is a family of candidates on a grid, of which the best is refined
later. The columns of all joints are computed at once and shared out.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.diagnosis.data.evidence import Trajectory
from armid_ros.diagnosis.data.rows import row_weights
from armid_ros.diagnosis.search.fit import Fitted
from armid_ros.diagnosis.search.trial import Candidate
from armid_ros.effects import Effect, Kind
from armid_ros.effects.gravity import with_exact_vector
from armid_ros.effects.unexplained import Unexplained
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np

#: Most combinations of shape values that a search starts from.
_MOST_SHAPES = 12


def candidate_effects(
    robot: Robot, kinds: Sequence[Kind]
) -> Iterator[tuple[Effect, list[Effect]]]:
    """Yield effects whose columns are computed together, with the candidates they belong to."""
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
    """Yield an effect and its candidates with every shape that a search starts from."""
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
        What may be named.
    columns : tuple of ndarray, each (M, n, C)
        Columns of all candidates, per trajectory, filtered and decimated.

    """

    candidates: tuple[Candidate, ...]
    columns: tuple[FloatArray, ...]


def candidates(
    fitted: Fitted,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
    kinds: Sequence[Kind],
) -> Candidates:
    """Compute the columns of every effect that was not named yet."""
    arm, left = memoized_arm(fitted.arm), _left(fitted, data, sigma)
    taken = {(own.effect.name, own.effect.joints) for own in fitted.named}
    candidates: list[Candidate] = []
    blocks: list[list[FloatArray]] = [[] for _ in data]
    start = 0
    for effect, members in candidate_effects(arm.robot, kinds):
        for whole, singles in shaped(effect, members, arm, left):
            for block, part in zip(blocks, data, strict=True):
                block.append(part.columns(arm, whole))
            for single in singles:
                size = len(single.parameters(arm.robot))
                if (single.name, single.joints) not in taken:
                    for kept in single.separate or (tuple(range(size)),):
                        span = slice(start + kept[0], start + kept[-1] + 1)
                        candidates.append(Candidate.of(single, span, kept, arm.robot))
                start += size
    return Candidates(tuple(candidates), tuple(np.concatenate(block, axis=2) for block in blocks))


def _left(fitted: Fitted, data: Sequence[Trajectory], sigma: Sequence[FloatArray]) -> Unexplained:
    """Return what a fitted arm leaves of the torque."""
    motions = [part.motion for part in data]
    arrays = (
        np.concatenate([getattr(motion, name) for motion in motions])
        for name in ('t', 'q', 'dq', 'ddq', 'tau')
    )
    return Unexplained(
        Motion(motions[0].joints, *arrays),
        np.concatenate([part.motion.q[part.rows] for part in data]),
        np.concatenate(fitted.residual),
        row_weights(data, sigma),
        np.concatenate(fitted.columns),
    )
