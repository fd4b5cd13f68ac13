# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Ties of a diagnosis as ``armid exo`` looks at them, who knows what noisy angles do to springs.

A search compares least squares of all causes. Springs are too soft by a little in them, and soft
ones beside stiff ones are missed: noise of angles is alike in all joints, which least squares
joint by joint do not know.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.fit import Fitted
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects.tied import Tied, TiedInteraction
from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.identification.ties.problem import Inertias, InteractionProblem
from armid_ros.identification.ties.recorded import stacked, together_interaction_problem
from armid_ros.identification.ties.search import LEAST_Z, with_springs
from armid_ros.identification.ties.stiffness import identify_interaction, Interaction
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
import numpy as np

#: A tie so many standard deviations above zero may well be there.
_DOUBTFUL = 1.0
#: Squares over noise that each inertia has to take for its description to be wrong: one by chance,
#: two where filters make neighbours alike.
_TOLD = 5.0


@dataclass(frozen=True)
class TieRegression:
    """
    Recordings of an arm and of a machine beside it, as a regression of the ties.

    Attributes
    ----------
    arm : ArmModel
        The arm as described.
    recordings : tuple of Recording
        With what was beside it.
    used : Conditioning
        Filters of the data.
    settings : DiagnosisSettings
        Thresholds.

    """

    arm: ArmModel
    recordings: tuple[Recording, ...]
    used: Conditioning
    settings: DiagnosisSettings

    def sure(self, slack: float) -> frozenset[str]:
        """
        Return joints with ties surely there, if ties and inertias leave nothing but noise.

        Parameters
        ----------
        slack : float
            Way that all ties give before they pull [m].

        """
        try:
            problem = self._problem(self.arm, 'free', slack)
            found = identify_interaction(problem)
        except IdentificationError:
            return frozenset()
        if found.misfit > self.settings.thresholds.same_fit * problem.tau.size:
            return frozenset()
        z = found.stiffness / found.std
        sure = {joint for k, joint in enumerate(problem.spring_joints) if z[k] > LEAST_Z}
        return frozenset(sure - _tied_joints(self.arm))

    def springs(self, explanation: Explanation, inertias: Inertias) -> Interaction | None:
        """
        Identify springs that were named, if all ties among the names are such and data tell them.

        Ties that may well be there are identified beside them: a strap too weak to be named pulls
        all the same, and would be taken for a part of those that are. All else stays as fitted.

        """
        ties = [own.effect for own in explanation.fitted.named if isinstance(own.effect, Tied)]
        if not ties or not all(isinstance(tie, TiedInteraction) for tie in ties):
            return None
        bare = explanation.fitted.arm
        for effect in ties:
            theta = bare.theta.copy()
            theta[_place(effect.parameters(bare.robot)[0], bare.parameters)] = 0.0
            bare = bare.with_theta(theta)
        try:
            problem = self._problem(bare, inertias)
            everywhere = identify_interaction(problem)
            named, there = {tie.joints[0] for tie in ties}, _tied_joints(self.arm)
            doubtful = everywhere.stiffness > _DOUBTFUL * everywhere.std
            kept = [
                k
                for k, joint in enumerate(problem.spring_joints)
                if joint in named or (joint not in there and doubtful[k])
            ]
            return identify_interaction(with_springs(problem, np.array(kept)))
        except IdentificationError:
            return None

    def _problem(
        self, bare: ArmModel, inertias: Inertias, slack: float = 0.0
    ) -> InteractionProblem:
        """Set up the regression of all ties, beside what a bare arm has but its body."""

        def rest(motion: Motion) -> FloatArray:
            return np.asarray(bare.torque(motion) - inverse_dynamics(bare.robot, motion))

        robot = self.arm.robot
        return stacked(
            [
                together_interaction_problem(
                    robot,
                    recording,
                    self.used,
                    inertias=inertias,
                    separate=True,
                    slack=slack,
                    rest=rest,
                )
                for recording in self.recordings
            ]
        )


def rightly_described(known: Interaction | None, free: Interaction | None) -> bool:
    """Return whether inertias as described explain the torques as well as fitted ones do."""
    if known is None or free is None:
        return True
    freed = len(free.estimate.values) - len(free.segments)
    noise = max(1.0, free.misfit / free.residual.size)
    return known.misfit - free.misfit < _TOLD * freed * noise


def without_bias(explanation: Explanation, springs: Interaction | None) -> Explanation:
    """
    Return an explanation whose springs are without what noisy angles take away from them.

    Parameters
    ----------
    explanation : Explanation
        What was found.
    springs : Interaction or None
        Its springs as `TieRegression.springs` finds them, inertias free as in the explanation;
        None leaves it as it is.

    """
    if springs is None:
        return explanation
    return replace(explanation, fitted=_with_springs(explanation, springs))


def _tied_joints(arm: ArmModel) -> set[str]:
    return {joint for own in arm.effects if isinstance(own, Tied) for joint in own.joints}


def _with_springs(explanation: Explanation, found: Interaction) -> Fitted:
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
        weighted = np.concatenate(list(explanation.evidence.weighted(fitted.columns)))
        rows = weighted.reshape(-1, weighted.shape[2])
        away = rows[:, rank:][:, where] @ change
        moved = np.linalg.lstsq(rows[:, :rank], -away, rcond=None)[0]
        theta[:known] = base.lift(base.values(theta[:known]) + moved, theta[:known])
    patched = fitted.arm.with_theta(theta)
    return replace(
        fitted,
        arm=patched,
        estimate=Estimate(fitted.estimate.parameters, values, covariance * np.outer(wider, wider)),
        residual=tuple(part.residual(patched) for part in explanation.evidence.data),
    )


def _place(wanted: ParameterName, names: Sequence[ParameterName]) -> int:
    """Return where a parameter is, whatever its unit."""
    return [(name.name, name.joint) for name in names].index((wanted.name, wanted.joint))
