# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Stiffnesses of ties that were named, without what noisy angles take away from them.

A search compares least squares of all causes, in which springs are too soft by a little. What is
named at last is identified as ``armid exo`` does.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.evidence import Trajectory
from armid_ros.diagnosis.fit import Fitted
from armid_ros.diagnosis.model_search import Explanation, joint_losses_of
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects.tied import Tied, TiedInteraction
from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.interaction import identify_interaction, Interaction
from armid_ros.identification.interaction_problem import Inertias, InteractionProblem
from armid_ros.identification.interaction_recording import stacked, together_interaction_problem
from armid_ros.identification.interaction_search import LEAST_Z, with_springs
from armid_ros.identification.signals import Conditioning
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
import numpy as np

#: A tie so many standard deviations above zero may well be there.
_DOUBTFUL = 1.0


def sure_ties(
    arm: ArmModel, recordings: Sequence[Recording], used: Conditioning, settings: DiagnosisSettings
) -> frozenset[str]:
    """
    Return the joints whose ties are surely there, if ties and inertias leave nothing but noise.

    Noise of angles is alike in all joints, which least squares joint by joint do not know: they
    miss a soft strap beside others.

    """
    try:
        problem = _problem(arm, arm, recordings, used, 'free')
        found = identify_interaction(problem)
    except IdentificationError:
        return frozenset()
    if found.misfit > settings.partial_loss * problem.tau.size:
        return frozenset()
    z = found.stiffness / found.std
    sure = {joint for k, joint in enumerate(problem.spring_joints) if z[k] > LEAST_Z}
    return frozenset(sure - _tied_joints(arm))


def without_bias(
    explanation: Explanation,
    recordings: Sequence[Recording],
    used: Conditioning,
    arm: ArmModel,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
) -> Explanation:
    """
    Return an explanation whose springs are without what noisy angles take away from them.

    Parameters
    ----------
    explanation : Explanation
        What was found; as it is if no springs are among it, or straps with slack are.
    recordings : sequence of Recording
        With what was beside the arm.
    used : Conditioning
        Filters of the data.
    arm : ArmModel
        The arm as described.
    data : sequence of Trajectory
        The data.
    sigma : sequence of ndarray, each (n,)
        Noise [N m].

    """
    ties = [own.effect for own in explanation.fitted.named if isinstance(own.effect, Tied)]
    springs = [tie for tie in ties if isinstance(tie, TiedInteraction)]
    if not springs or len(springs) < len(ties):
        return explanation
    try:
        found = _identified(explanation, springs, recordings, used, arm)
    except IdentificationError:
        return explanation
    fitted = _with_springs(explanation, found, data, sigma)
    return replace(explanation, fitted=fitted, losses=joint_losses_of(fitted, data, sigma))


def _identified(
    explanation: Explanation,
    springs: Sequence[TiedInteraction],
    recordings: Sequence[Recording],
    used: Conditioning,
    arm: ArmModel,
) -> Interaction:
    """
    Identify the springs, with the inertias free if they were; all else stays as fitted.

    Ties that may well be there are identified beside them: a strap too weak to be named pulls all
    the same, and would be taken for a part of those that are.

    """
    bare = explanation.fitted.arm
    for effect in springs:
        theta = bare.theta.copy()
        theta[_place(effect.parameters(arm.robot)[0], bare.parameters)] = 0.0
        bare = bare.with_theta(theta)
    problem = _problem(
        arm, bare, recordings, used, 'known' if explanation.base is None else 'free'
    )
    everywhere = identify_interaction(problem)
    named = {effect.joints[0] for effect in springs}
    there = _tied_joints(arm)
    kept = [
        k
        for k, joint in enumerate(problem.spring_joints)
        if joint in named
        or (joint not in there and everywhere.stiffness[k] > _DOUBTFUL * everywhere.std[k])
    ]
    return identify_interaction(with_springs(problem, np.array(kept)))


def _problem(
    arm: ArmModel,
    bare: ArmModel,
    recordings: Sequence[Recording],
    used: Conditioning,
    inertias: Inertias,
) -> InteractionProblem:
    """Set up the regression of all ties on an arm, beside what a bare one has but its body."""

    def rest(motion: Motion) -> FloatArray:
        return np.asarray(bare.torque(motion) - inverse_dynamics(bare.robot, motion))

    return stacked(
        [
            together_interaction_problem(
                arm.robot, recording, used, inertias=inertias, separate=True, rest=rest
            )
            for recording in recordings
        ]
    )


def _tied_joints(arm: ArmModel) -> set[str]:
    return {joint for own in arm.effects if isinstance(own, Tied) for joint in own.joints}


def _with_springs(
    explanation: Explanation,
    found: Interaction,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
) -> Fitted:
    """
    Return the arm with these springs, and what is free of it moved to go with them.

    Other names that were fitted at the same time may make springs less sure: deviations are the
    larger ones then.

    """
    fitted, base = explanation.fitted, explanation.base
    listed = {(name.name, name.joint) for name in fitted.estimate.parameters}
    own = [
        k
        for k, name in enumerate(found.estimate.parameters[: len(found.segments)])
        if (name.name, name.joint) in listed
    ]
    springs = [found.estimate.parameters[k] for k in own]
    stiffness, std = found.stiffness[own], found.std[own]
    values, covariance = fitted.estimate.values.copy(), fitted.estimate.covariance
    where = [_place(spring, fitted.estimate.parameters) for spring in springs]
    change = stiffness - values[where]
    values[where] = stiffness
    wider = np.ones(len(values))
    wider[where] = std / np.sqrt(np.diag(covariance)[where])
    if any(not isinstance(name.effect, Tied) for name in fitted.named):
        wider = np.maximum(wider, 1.0)
    theta = fitted.arm.theta.copy()
    theta[[_place(spring, fitted.arm.parameters) for spring in springs]] = stiffness
    if base is not None:
        known, rank = len(base.standard), base.rank
        weighted = [
            (columns * (part.told / s)[:, :, np.newaxis]).reshape(-1, columns.shape[2])
            for columns, part, s in zip(fitted.columns, data, sigma, strict=True)
        ]
        rows = np.concatenate(weighted)
        away = rows[:, rank:][:, where] @ change
        moved = np.linalg.lstsq(rows[:, :rank], -away, rcond=None)[0]
        theta[:known] = base.lift(base.values(theta[:known]) + moved, theta[:known])
    patched = fitted.arm.with_theta(theta)
    return replace(
        fitted,
        arm=patched,
        estimate=Estimate(fitted.estimate.parameters, values, covariance * np.outer(wider, wider)),
        residual=tuple(part.residual(patched) for part in data),
    )


def _place(wanted: ParameterName, names: Sequence[ParameterName]) -> int:
    """Return where a parameter is, whatever its unit."""
    return [(name.name, name.joint) for name in names].index((wanted.name, wanted.joint))
