# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is asked of an arm: what of it is taken as given, and what is fitted beside every cause."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Trajectory
from armid_ros.diagnosis.data.prior import EXCITED, excited, Prior
from armid_ros.effects import CATALOGUE, Effect, Kind
from armid_ros.model import BaseParameters, group_columns
import numpy as np


@dataclass(frozen=True)
class Question:
    """
    What is asked of an arm.

    Attributes
    ----------
    arm : ArmModel
        The arm as given.
    base : BaseParameters or None
        What of it is free.
    nuisance_arm : ArmModel
        The arm with the friction of joints that nobody gave values of.
    nuisance_base : BaseParameters or None
        What of that is free.
    unknown : tuple of Effect
        That friction, joint by joint.
    most : int
        Causes that are looked for.
    prior, nuisance_prior : Prior or None
        What other data tell of what is free.
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

    def kinds(self, library: Sequence[Kind]) -> tuple[Kind, ...]:
        """Return what is looked for, of effects that may be named."""
        return tuple(kind.as_change() for kind in library) if self.since else tuple(library)


def as_given(
    arm: ArmModel, data: Sequence[Trajectory], most: int, library: Sequence[str]
) -> Question:
    """Ask what a model lacks whose values are right, as far as it has any."""
    nuisance_arm, unknown = with_friction(arm, library)
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
) -> Question:
    """
    Ask what a model lacks of which only the structure counts.

    Parameters
    ----------
    arm : ArmModel
        The arm.
    data : sequence of Trajectory
        The data.
    most : int
        Causes that are looked for.
    library : sequence of str
        Names that may be given.
    rng : numpy.random.Generator
        Draws states.
    held : sequence of int
        Parameters of the arm that stay as they are, so that a change of them is a cause.

    """
    nuisance_arm, unknown = with_friction(arm, library)
    bases = []
    for one in (arm, nuisance_arm):
        free = np.setdiff1d(np.arange(len(one.parameters)), held)
        bases.append(excited(one, one.base_parameters(rng, free), data)[0])
    return Question(arm, bases[0], nuisance_arm, bases[1], unknown, most)


def with_friction(arm: ArmModel, library: Sequence[str]) -> tuple[ArmModel, tuple[Effect, ...]]:
    """Return an arm with what every joint may be taken to have, and what was added."""
    there = {(effect.name, joint) for effect in arm.effects for joint in effect.joints}
    added: list[Effect] = []
    fuller = arm
    for kind in CATALOGUE.values():
        joints = tuple(j for j in arm.robot.joints if (kind.name, j) not in there)
        if kind.everywhere and kind.name in library and joints:
            fuller = fuller.with_effect(kind.on(arm.robot, joints))
            added += [kind.on(arm.robot, (joint,)) for joint in joints]
    return fuller, tuple(added)


def _without_values(arm: ArmModel, data: Sequence[Trajectory]) -> BaseParameters | None:
    """Return the parameters of effects that have no value yet, as far as data tell them."""
    rigid = len(arm.robot.rigid_parameters)
    names, theta = arm.parameters, arm.theta
    free = np.array([k for k in range(rigid, len(names)) if theta[k] == 0.0], dtype=np.intp)
    if not len(free):
        return None
    columns = [part.reduce(arm.effect_columns(part.motion)[:, :, free - rigid]) for part in data]
    stacked = np.concatenate([block.reshape(-1, len(free)) for block in columns])
    return group_columns(stacked, tuple(names[k] for k in free), EXCITED).among(names, free)
