# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Loads that fit on either of two links, and refitted inertias that are physically impossible.

A load whose centre is on the axis of a revolute joint has equal torques on either of its links.

"""

from __future__ import annotations

from dataclasses import replace

from armid_ros.diagnosis.search.cause import NamedEffect
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.joint_fit import Fitted, JointFit, parameter_ranges
from armid_ros.diagnosis.search.ranking import CauseResult
from armid_ros.effects.quantities import MIN_Z_SCORE
from armid_ros.errors import IdentificationError
from armid_ros.identification.physical.fit_among_bodies import physical_program, PhysicalSettings
from armid_ros.identification.physical.physical_program import nearest_body
from armid_ros.model import LINK_PARAMETERS
from armid_ros.model.pseudo_inertia import pseudo_inertia
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np

#: Largest ratio of squared residuals at which physically consistent links fit as well.
_MAX_LOSS_RATIO = 1.05


def is_same_body(one: CauseResult, other: CauseResult, robot: Robot) -> bool:
    """
    Return whether two causes are one load, described on either link of a revolute joint.

    Both have the same mass, and the centre of the load on the outer link is on the joint axis,
    within three standard deviations.

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
    same_mass = abs(load[0] - same[0]) <= MIN_Z_SCORE * np.hypot(std[0], same_std[0])
    distance = np.linalg.norm(np.cross(axis, load[1:4]))
    return bool(same_mass and distance <= MIN_Z_SCORE * np.linalg.norm(std[1:4]))


def _values(trial: CauseResult) -> tuple[FloatArray, FloatArray]:
    """Return inertial values (10,) and standard deviations of a load; zero if not fitted."""
    values, std = np.zeros((2, len(LINK_PARAMETERS)))
    kept = list(trial.kept)
    values[kept], std[kept] = trial.values, trial.std
    return values, std


def on_outer_link(explanation: Explanation) -> Explanation:
    """Move a load to the outer link if it fits two links equally well, and refit."""
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


def as_possible_loads(explanation: Explanation) -> Explanation:
    """Replace a physically impossible load by the most likely load that a body can have."""
    fitted, named = explanation.fitted, list(explanation.fitted.named)
    values, covariance = fitted.estimate.values.copy(), fitted.estimate.covariance
    for k, (own, (kept, _)) in enumerate(zip(named, parameter_ranges(named), strict=True)):
        errors, sign = covariance[np.ix_(kept, kept)], np.sign(own.values[0])  # put down: negative
        if not own.effect.traits.weighs or len(kept) < 10 or not np.all(np.isfinite(errors)):
            continue
        if np.linalg.eigvalsh(sign * pseudo_inertia(own.values))[0] <= 0.0:
            values[list(kept)] = sign * nearest_body(sign * own.values, errors)
            named[k] = replace(own, values=values[list(kept)])
    if explanation.problem is not None:
        arm = explanation.problem.arm_at(named, fitted.means)
        estimate = replace(fitted.estimate, values=values)
        fitted = replace(fitted, arm=arm, named=tuple(named), estimate=estimate)
    return replace(explanation, fitted=fitted)


def as_bodies(explanation: Explanation) -> tuple[Explanation, tuple[str, ...]]:
    """
    Replace physically impossible inertias by possible inertias near the description.

    The links have to fit the data as well as before. If this is impossible, the explanation is
    unchanged.

    Returns
    -------
    explanation : Explanation
        The explanation with physically consistent links.
    notes : tuple of str
        A note if there are none.

    """
    problem, fitted = explanation.problem, explanation.fitted
    if problem is None or not explanation.refitted:
        return explanation, ()
    base, arm = problem.nuisance.base, problem.arm
    if not base.rank or base.independent.min() >= len(arm.robot.rigid_parameters):
        return explanation, ()
    known = len(arm.parameters)
    products, count = _products(problem, fitted)
    program, _ = physical_program(arm, base, PhysicalSettings())
    for weight in (1e-3, 1e-5, 1e-7):  # of the description: the largest one that fits as well
        try:
            theta = program.solve(products, count, weight)
        except IdentificationError:
            continue
        changed = fitted.arm.with_theta(np.concatenate([theta, fitted.arm.theta[known:]]))
        bodily = replace(explanation, fitted=replace(fitted, arm=changed))
        if np.all(
            bodily.chi2_per_row <= np.maximum(_MAX_LOSS_RATIO * explanation.chi2_per_row, 1.0)
        ):
            return bodily, ()
    if not explanation.steps:
        return explanation, ()
    return explanation, (
        'no physically consistent links explain the data as well: the fitted inertias contain a '
        'part of the cause, and a simulation with the patched model may fail',
    )


def _products(problem: JointFit, fitted: Fitted) -> tuple[FloatArray, float]:
    """Return inner products of the base parameters' columns and torque, and the row count."""
    nuisance, base = problem.nuisance, problem.nuisance.base
    rank = nuisance.base.rank
    then, now = (base.values(x.theta[: len(base.standard)]) for x in (problem.arm, fitted.arm))
    patched = problem.with_model(fitted.arm)
    products = np.zeros((rank + 1, rank + 1))
    for k, diagnosed in enumerate(nuisance.rows.diagnosed):
        values = now if diagnosed else then
        square = patched.column_products[0][k][:rank, :rank]
        residual = patched.column_products[1][k][:rank]
        target = residual + square @ values
        power = patched.power[k] + (residual + target) @ values
        products += np.block([[square, target[:, np.newaxis]], [target, power]])
    return products, float(nuisance.count.sum())
