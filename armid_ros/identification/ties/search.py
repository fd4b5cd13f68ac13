# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Whether two machines are tied at all, and where, from recordings of both.

Every segment gets a stiffness of its own; those that are surely above zero are named and fitted
again without the others, and what they explain is measured on a recording that was not used. The
inertias are free by default, so that a wrong mass is not taken for a spring.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.identification.ties.problem import Inertias, InteractionProblem
from armid_ros.identification.ties.recorded import recorded_interaction_problem
from armid_ros.identification.ties.stiffness import identify_interaction, Interaction
from armid_ros.model.spring_ties import Tie, TiedMachines
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

#: A stiffness so many standard deviations above zero is there: a chance of 3e-5 for each.
LEAST_Z = 4.0


@dataclass(frozen=True)
class InteractionFinding:
    """
    Where two machines are tied.

    Attributes
    ----------
    segments : tuple of str
        Segments that are tied; none means that no interaction is seen.
    interaction : Interaction or None
        Their stiffnesses, fitted without the other segments.
    everywhere : Interaction
        A stiffness for every segment.
    z : ndarray, shape (S,)
        Standard deviations that each is above zero.
    gap_before, gap_after : ndarray, shape (n,)
        Held-out residual of every joint without springs and with those found, root mean square
        [N m].
    gap_noise : ndarray, shape (n,)
        What noise of torques and angles makes of it with those found [N m].

    """

    segments: tuple[str, ...]
    interaction: Interaction | None
    everywhere: Interaction
    z: FloatArray
    gap_before: FloatArray
    gap_after: FloatArray
    gap_noise: FloatArray

    @property
    def closed_fraction(self) -> float:
        """Share of the held-out gap beyond the noise, as a mean square, that the springs close."""
        before, after = (
            float(np.sum(np.maximum(gap**2 - self.gap_noise**2, 0.0)))
            for gap in (self.gap_before, self.gap_after)
        )
        return 1.0 - after / before if before > 0.0 else 0.0


def find_interaction(
    robot: Robot,
    other: Robot,
    ties: Sequence[Tie],
    training: tuple[Recording, Recording],
    held_out: tuple[Recording, Recording],
    *,
    inertias: Inertias = 'free',
    least_z: float = LEAST_Z,
) -> InteractionFinding:
    """
    Look for springs between two machines.

    Parameters
    ----------
    robot, other : Robot
        The machine whose torques were measured, and the one it may be tied to.
    ties : sequence of Tie
        Where springs may be.
    training, held_out : (Recording, Recording)
        Of the machine and of the other one, at two occasions.
    inertias : {'free', 'known'}
        Whether the machine's inertias are estimated as well.
    least_z : float
        Standard deviations above zero that make a segment tied.

    """

    def problem(recordings: tuple[Recording, Recording]) -> InteractionProblem:
        own, far = recordings
        machines = TiedMachines(robot, other, ties)
        return recorded_interaction_problem(machines, own, far, inertias=inertias, separate=True)

    seen, unseen = problem(training), problem(held_out)
    everywhere = identify_interaction(seen)
    z = everywhere.stiffness / everywhere.std
    kept = np.flatnonzero(z > least_z)
    loose, aim = with_springs(seen, kept[:0]), with_springs(unseen, kept[:0])
    theta = _plain(loose)
    before = _gap(aim, theta)
    if not len(kept):
        return InteractionFinding((), None, everywhere, z, before, before, aim.deviation(theta))
    named = identify_interaction(with_springs(seen, kept))
    aim, theta = with_springs(unseen, kept), named.estimate.values
    return InteractionFinding(
        named.segments, named, everywhere, z, before, _gap(aim, theta), aim.deviation(theta)
    )


def with_springs(problem: InteractionProblem, kept: npt.NDArray[np.intp]) -> InteractionProblem:
    """Return a problem with some of its springs only."""
    springs = len(problem.segments)
    columns = [*kept.tolist(), *range(springs, problem.columns.shape[2])]
    return replace(
        problem,
        columns=problem.columns[:, :, columns],
        columns_by_motion=problem.columns_by_motion[:, :, columns],
        described=problem.described[columns],
        precision=problem.precision[np.ix_(columns, columns)],
        segments=tuple(problem.segments[k] for k in kept),
        spring_joints=tuple(problem.spring_joints[k] for k in kept),
    )


def _gap(problem: InteractionProblem, theta: FloatArray) -> FloatArray:
    """Return the residual of every joint, root mean square, shape (n,) [N m]."""
    return np.asarray(np.sqrt(np.mean(problem.residual(theta) ** 2, axis=0)))


def _plain(problem: InteractionProblem) -> FloatArray:
    """Fit inertias alone, if they are free, by least squares."""
    w = problem.columns.reshape(-1, problem.columns.shape[2])
    scale = np.linalg.norm(w, axis=0)
    aim = (problem.tau - problem.known).ravel()
    return np.asarray(np.linalg.lstsq(w / scale, aim, rcond=None)[0] / scale)
