# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Ties of a diagnosis, identified as by ``armid exo``, which models the noise of angles.

A search compares causes by least squares. Those make springs slightly too soft, and miss soft ones
next to stiff ones: noise of angles is correlated between the torques of all joints, which least
squares joint by joint ignore.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.posterior import Fitted
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects.tied import Tied, TiedInteraction
from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.identification.ties.problem import Inertias, InteractionProblem
from armid_ros.identification.ties.recorded import stacked, together_interaction_problem
from armid_ros.identification.ties.stiffness import identify_interaction, Interaction, LEAST_Z
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
import numpy as np

#: A tie so many standard deviations above zero is not excluded.
_DOUBTFUL = 1.0
#: Squares over noise that each fitted inertia has to explain for the description to be wrong: one
#: by chance, two where filters correlate neighbouring rows.
_TOLD = 5.0


@dataclass(frozen=True)
class TieRegression:
    """
    Recordings of an arm and of another machine, as a regression of the ties.

    Attributes
    ----------
    arm : ArmModel
        The arm as described.
    recordings : tuple of Recording
        Of the arm, with the motion of the other machine.
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
        Return the joints with significant ties, if ties and inertias leave nothing but noise.

        Parameters
        ----------
        slack : float
            Slack of all ties, the elongation beyond which they pull [m].

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
        Identify the named springs; None unless all named ties are springs that data determine.

        Ties that are not excluded are identified jointly with them: a strap too weak to be named
        pulls all the same, and would be attributed to the named ones. All else stays as fitted.

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
            return identify_interaction(problem.with_springs(np.array(kept)))
        except IdentificationError:
            return None

    def _problem(
        self, bare: ArmModel, inertias: Inertias, slack: float = 0.0
    ) -> InteractionProblem:
        """Set up the regression of all ties, with the effects of a bare arm subtracted."""

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
    Return an explanation without the bias of its springs by noisy angles.

    Parameters
    ----------
    explanation : Explanation
        The names, fitted.
    springs : Interaction or None
        Its springs as identified by `TieRegression.springs`, with inertias fitted or known as in
        the explanation; None returns it unchanged.

    """
    if springs is None:
        return explanation
    return replace(explanation, fitted=_with_springs(explanation, springs))


def _tied_joints(arm: ArmModel) -> set[str]:
    return {joint for own in arm.effects if isinstance(own, Tied) for joint in own.joints}


def _with_springs(explanation: Explanation, found: Interaction) -> Fitted:
    """
    Return the fitted arm with these springs, its base parameters refitted to them.

    Names other than ties that were fitted jointly may make springs less certain: deviations are
    the larger ones then.

    """
    fitted, problem = explanation.fitted, explanation.problem
    assert problem is not None
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
    values[where] = stiffness
    wider = np.ones(len(values))
    wider[where] = std / np.sqrt(np.diag(covariance)[where])
    if any(not isinstance(name.effect, Tied) for name in fitted.named):
        wider = np.maximum(wider, 1.0)
    each = [one.copy() for one in fitted.values]
    for name, own_values, place in zip(fitted.named, each, fitted.places, strict=True):
        own_values[list(name.kept)] = values[list(place[0])]
    return replace(
        fitted,
        arm=problem.with_names_at(fitted.named, each),
        values=tuple(each),
        estimate=Estimate(fitted.estimate.parameters, values, covariance * np.outer(wider, wider)),
    )


def _place(wanted: ParameterName, names: Sequence[ParameterName]) -> int:
    """Return the position of a parameter among names, whatever its unit."""
    return [(name.name, name.joint) for name in names].index((wanted.name, wanted.joint))
