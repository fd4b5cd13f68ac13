# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is asked of an arm: which of its values stay, and which are fitted with any cause."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.diagnosis.data.baseline import EXCITED, excited, Prior
from armid_ros.diagnosis.data.trajectory import Trajectory
from armid_ros.effects import CATALOGUE, Effect
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
        Base parameters of it that are fitted; None where it stays as given.
    prior : Prior or None
        CauseInformation of the baseline about these.

    """

    arm: ArmModel
    base: BaseParameters | None
    prior: Prior | None = None


def frees_body(base: BaseParameters | None, arm: ArmModel) -> bool:
    """Return whether any parameter of the rigid body is among those that are fitted."""
    return base is not None and bool(np.any(base.independent < len(arm.robot.rigid_parameters)))


def as_given(arm: ArmModel, data: Sequence[Trajectory], beside: Sequence[Effect] = ()) -> Question:
    """Ask what a model lacks whose given values are right; see `fitted_anew`."""
    arm = _with(arm, beside)
    return Question(arm, _without_values(arm, data))


def fitted_anew(
    arm: ArmModel,
    data: Sequence[Trajectory],
    rng: np.random.Generator,
    beside: Sequence[Effect] = (),
    held: Sequence[int] = (),
) -> Question:
    """
    Ask what a model lacks of which only the structure is believed: all values are fitted anew.

    Parameters
    ----------
    arm : ArmModel
        The arm.
    data : sequence of Trajectory
        The data.
    rng : numpy.random.Generator
        Draws the states from which base parameters are found.
    beside : sequence of Effect
        What is fitted as well, with values of zero: only what is none of the others counts as it.
    held : sequence of int
        Parameters of the arm that stay as they are, as a change of them is a cause.

    """
    arm = _with(arm, beside)
    free = np.setdiff1d(np.arange(len(arm.parameters)), held)
    return Question(arm, excited(arm, arm.base_parameters(rng, free), data)[0])


def _with(arm: ArmModel, beside: Sequence[Effect]) -> ArmModel:
    return memoized_arm(reduce(ArmModel.with_effect, beside, arm)) if beside else arm


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
