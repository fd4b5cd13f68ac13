# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A load that the torque assigns to neither of two links.

A body centred on the axis of a turning joint loads every joint alike on either link.

"""

from __future__ import annotations

from dataclasses import replace

from armid_ros.diagnosis.search.cause import NamedEffect
from armid_ros.diagnosis.search.explanation import as_bodies, Explanation
from armid_ros.diagnosis.search.trial import Trial
from armid_ros.effects.quantities import MIN_Z_SCORE
from armid_ros.model import LINK_PARAMETERS
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np


def is_same_body(one: Trial, other: Trial, robot: Robot) -> bool:
    """
    Return whether two causes are one load, on the link before or after a turning joint.

    Both have the same mass, and the centre of the load of the outer link is on the axis, within
    three standard deviations.

    """
    own = one.effect
    if own.name != other.effect.name or not own.traits.weighs or not own.joints:
        return False
    tree = robot.tree
    inner, outer = sorted((one, other), key=lambda trial: tree.index(trial.effect.joints[0]))
    before, after = (tree.index(trial.effect.joints[0]) for trial in (inner, outer))
    axis = np.array(tree.geometry[after].turn)
    if tree.model.parents[after + 1] != before + 1 or not axis.any():
        return False
    (load, std), (same, same_std) = (_values(trial) for trial in (outer, inner))
    alike = abs(load[0] - same[0]) <= MIN_Z_SCORE * np.hypot(std[0], same_std[0])
    aside = np.linalg.norm(np.cross(axis, load[1:4]))
    return bool(alike and aside <= MIN_Z_SCORE * np.linalg.norm(std[1:4]))


def _values(trial: Trial) -> tuple[FloatArray, FloatArray]:
    """Return all values of a load, and their deviations, zero where they are not fitted."""
    values, std = np.zeros((2, len(LINK_PARAMETERS)))
    kept = list(trial.kept)
    values[kept], std[kept] = trial.values, trial.std
    return values, std


def as_placed_bodies(explanation: Explanation) -> tuple[Explanation, tuple[str, ...]]:
    """Return the explanation with loads on outer links and possible bodies, and notes on names."""
    found, notes = as_bodies(on_outer_link(explanation))
    return found, notes if found.steps else ()


def on_outer_link(explanation: Explanation) -> Explanation:
    """Return the explanation with each load on the outer one of two links that it may be on."""
    if explanation.problem is None:
        return explanation
    robot, steps, fitted = explanation.given.robot, explanation.steps, explanation.fitted
    for k, trial in enumerate(steps):
        for rival in trial.rivals:
            if not is_same_body(trial, rival, robot) or rival.key in [one.key for one in steps]:
                continue
            if robot.tree.index(rival.effect.joints[0]) < robot.tree.index(trial.effect.joints[0]):
                continue
            others = tuple(one for one in trial.rivals if one is not rival)
            moved = replace(rival, rivals=(replace(trial, rivals=()), *others))
            outer = NamedEffect(rival.effect, rival.kept, _values(rival)[0])
            again = explanation.problem.fit([*fitted.named[:k], outer, *fitted.named[k + 1 :]])
            found = replace(explanation, fitted=again, steps=(*steps[:k], moved, *steps[k + 1 :]))
            return on_outer_link(found)
    return explanation
