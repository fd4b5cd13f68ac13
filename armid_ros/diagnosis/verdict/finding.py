# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Result of a diagnosis: verdict, named effects with values and rivals, and residuals."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import Trajectory, unchecked_joints
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.spans import Span
from armid_ros.diagnosis.verdict.where import Where
from armid_ros.effects import CATALOGUE, Effect
from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate, name_in_words, ParameterName
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.motion import FloatArray
from armid_ros.robots.ties import Tie
import numpy as np
import scipy.linalg


@dataclass(frozen=True)
class Rival:
    """
    Another effect that explains the data about as well as a named effect.

    Attributes
    ----------
    name : str
        Name of the effect.
    joints : tuple of str
        Joints on which it acts; empty for the whole arm.
    probability : float
        Probability among all causes.
    same_body : bool
        Whether it is the named load on the other link of a joint, and no other cause.

    """

    name: str
    joints: tuple[str, ...]
    probability: float = 0.0
    same_body: bool = False


@dataclass(frozen=True)
class Finding:
    """
    Effect that a diagnosis names, with values, rivals and the explained share of the gap.

    Attributes
    ----------
    name : str
        Name of the effect in the catalogue.
    joints : tuple of str
        Joints on which it acts; empty for the whole arm.
    parameters : tuple of ParameterName
        Its parameters, shapes included.
    values, std : tuple of float
        Values and standard deviations of the parameters; nan where data do not determine them.
    share : float
        Share of the held-out gap that the effect explains, 0 to 1.
    share_interval : tuple of float
        The 95 % interval of the share.
    p : float
        Probability that the effect is absent, or has not changed.
    rivals : tuple of Rival
        Other effects that the data do not exclude, the likeliest first.
    sign : str
        Meaning of a positive value, if the name does not express it.
    ties : tuple of Tie
        Ties of the arm to another machine, in the order of the joints; empty for other effects.
    weighs : bool
        Whether its first value is a mass.
    together : tuple of str
        Names of other effects of the same cause, with a common share, such as size and direction
        of gravity.
    added_to : tuple of float
        Values of the same parameters in the given model, to which `values` are added; empty
        if none is known.
    look_at : str
        Part of the robot to inspect, if several effects have one cause; else empty.
    probability : float
        Probability among all causes.

    """

    name: str
    joints: tuple[str, ...]
    parameters: tuple[ParameterName, ...]
    values: tuple[float, ...]
    std: tuple[float, ...]
    share: float
    share_interval: tuple[float, float]
    p: float
    rivals: tuple[Rival, ...] = ()
    sign: str = ''
    ties: tuple[Tie, ...] = ()
    weighs: bool = False
    together: tuple[str, ...] = ()
    added_to: tuple[float, ...] = ()
    look_at: str = ''
    probability: float = 0.0

    @property
    def rows(self) -> list[tuple[ParameterName, float, float, float]]:
        """Each parameter with its value, standard deviation, and value in the given model."""
        given = (0.0,) * len(self.values) if self.weighs or not self.added_to else self.added_to
        return [
            (name, value, std, before if abs(before) > HALF_WIDTH * std else 0.0)
            for name, value, std, before in zip(
                self.parameters, self.values, self.std, given, strict=True
            )
        ]

    @property
    def other_causes(self) -> tuple[Rival, ...]:
        """Rivals, except those that are the same load described on another link."""
        return tuple(rival for rival in self.rivals if not rival.same_body)

    @property
    def ambiguous_with(self) -> tuple[str, ...]:
        """Names of the rivals, except the same load described on another link."""
        return tuple(rival.name for rival in self.other_causes)

    @property
    def experiment(self) -> str:
        """
        Return which recording would separate the effect from its likeliest rival.

        It is empty without rival. No motion separates a payload from its link, so the payload has
        to be weighed.

        """
        if not self.other_causes:
            return ''
        rival = self.other_causes[0]
        kinds = [CATALOGUE[one] for one in (self.name, rival.name) if one in CATALOGUE]
        carried = [kind for kind in kinds if kind.traits.weighs]
        bodies = len(kinds) == 2 and all(kind.changes_body for kind in kinds)
        alike = set(self.joints) == set(rival.joints)
        own, other = (
            f' of {", ".join(where)}' if where else '' for where in (self.joints, rival.joints)
        )
        first, second = map(name_in_words, (self.name, rival.name))
        names = f'{first}{"" if own == other else own} from {second}{other}'
        one_body = bodies and bool(carried) and alike and bool(self.joints)
        shown = [kind.traits.shown_by for kind in (carried if one_body else kinds)]
        best = '. Or record '.join(dict.fromkeys(shown or [Effect.traits.shown_by]))
        if one_body:
            return (
                f'No motion separates {names}, as they move as one body. Weigh the load of the '
                f'link, or record {best}.'
            )
        return f'To separate {names}, record {best}.'

    def place_of(self, joint: str) -> str:
        """Return the body segment that is tied at a joint; without a tie, the joint name."""
        return next((tie.name for tie in self.ties if tie.joint == joint), joint)


@dataclass(frozen=True)
class Overlay:
    """
    Measured and predicted torque of one trajectory, both with the same filter.

    Attributes
    ----------
    trajectory : Trajectory
        Motion of the recording.
    measured, before, after : ndarray, shape (M, n)
        Measured torque, and predictions of the model without and with the named effects [N m].
    sigma : ndarray, shape (n,)
        Floor of each joint: its noise, or the misfit of the model if larger [N m].

    """

    trajectory: Trajectory
    measured: FloatArray
    before: FloatArray
    after: FloatArray
    sigma: FloatArray


@dataclass(frozen=True)
class Gap:
    """
    Root mean square residual of each joint, without and with the named effects.

    Attributes
    ----------
    before, after, floor : ndarray, shape (n,)
        Root mean square residual of each joint without and with the named effects, and the floor
        [N m].
    chi2_before : ndarray, shape (n,)
        Mean square of the residual over the floor, without the named effects.
    closed : float
        Share of the gap above the floor that the named effects explain, 0 to 1.
    predicted : bool
        Whether the residual is that of held-out recordings.
    overlays : tuple of Overlay
        Measured and predicted torques of each trajectory.

    """

    before: FloatArray
    after: FloatArray
    floor: FloatArray
    chi2_before: FloatArray
    closed: float
    predicted: bool
    overlays: tuple[Overlay, ...]

    @classmethod
    def of(cls, explanation: Explanation, unseen: Evidence | None) -> Gap:
        """
        Measure the residuals in held-out recordings if there are any, else in fitted ones.

        Parameters
        ----------
        explanation : Explanation
            The fitted causes.
        unseen : Evidence or None
            Held-out recordings, weighted by the floor of the gap.

        """
        evidence = explanation.evidence if unseen is None else unseen
        fits = explanation.reference, explanation.fitted
        residuals = [evidence.residuals(one.arm) for one in fits]
        overlays = []
        for part, sigma, given, patched in zip(
            evidence.data, evidence.sigma, *residuals, strict=True
        ):
            torque = part.torque
            overlays.append(Overlay(part, torque, torque - given, torque - patched, sigma))
        power = [evidence.power(rows) for rows in residuals]
        floor = evidence.power([np.broadcast_to(o.sigma, o.measured.shape) for o in overlays])
        excess = [np.maximum(own - floor, 0.0) / np.maximum(floor, 1e-24) for own in power]
        gap = excess[0] > 0.2  # in other joints, squares beyond the floor are random
        closed = 1.0 - excess[1][gap].sum() / excess[0][gap].sum() if gap.any() else 0.0
        return cls(
            np.sqrt(power[0]),
            np.sqrt(power[1]),
            np.sqrt(floor),
            evidence.chi2_per_row(residuals[0]),
            float(np.clip(closed, 0.0, 1.0)),
            unseen is not None,
            tuple(overlays),
        )


@dataclass(frozen=True)
class Diagnosis:
    """
    Result of a diagnosis: verdict, named effects, remaining residual and notes.

    Attributes
    ----------
    verdict : str
        consistent, named, ambiguous, partial, unknown, not_repeatable or bad_data.
    summary : str
        The verdict in a sentence or two.
    arm : ArmModel
        The patched model; the given one if nothing was named or a patch would make it worse.
    data : tuple of Trajectory
        The diagnosed recordings.
    notes : tuple of str
        Notes for the reader of the report.
    findings : tuple of Finding
        The headline: named effects with share, parameters, rivals and the experiment that would
        separate them.
    minor : tuple of Finding
        Causes that are significant and not material.
    where : tuple of Where
        Joints in which the model without the named effects has a gap.
    left : tuple of Where
        Joints in which the model with the named effects still has a gap.
    gap : Gap or None
        Residuals without and with the named effects, and the floor; None if the data are bad.
    explanation : Explanation or None
        The named effects with their fits and trials; None if the data are bad.
    not_visible : tuple of str
        Effects of the catalogue that these data cannot show.
    refitted : bool
        Whether the rigid body was refitted.
    baseline : str
        The floor of the gap in words: the noise, the misfit of the model, or an estimate of it.
    harmful : bool
        Whether the model is not patched, as the named effects would make it worse in some joint.
    doubt : str
        Sentence on the reasons why the given model may be wrong; empty without reasons.
    spans : tuple of Span
        Seconds of each recording in which the findings act; empty if they act throughout.
    not_repeating : tuple of str
        Joints whose torque differs between equal periods, the largest difference first.
    contradicted : bool
        Whether held-out recordings contradict an effect that explains the others.

    """

    verdict: str
    summary: str
    arm: ArmModel
    data: tuple[Trajectory, ...]
    notes: tuple[str, ...]
    findings: tuple[Finding, ...] = ()
    minor: tuple[Finding, ...] = ()
    where: tuple[Where, ...] = ()
    left: tuple[Where, ...] = ()
    gap: Gap | None = None
    explanation: Explanation | None = None
    not_visible: tuple[str, ...] = ()
    refitted: bool = False
    baseline: str = ''
    harmful: bool = False
    doubt: str = ''
    spans: tuple[Span, ...] = ()
    not_repeating: tuple[str, ...] = ()
    contradicted: bool = False

    @property
    def estimate(self) -> Estimate | None:
        """Estimate of all fitted parameters; the values of the findings come last."""
        if self.explanation is None:
            return None
        fit = self.explanation.fitted.estimate
        rows = [
            row
            for one in self.findings
            for row in zip(one.parameters, one.values, one.std, strict=True)
        ]
        variance = np.array([std**2 for _, _, std in rows])
        return Estimate(
            (*fit.parameters, *(name for name, _, _ in rows)),
            np.array([*fit.values, *(value for _, value, _ in rows)]),
            scipy.linalg.block_diag(fit.covariance, np.diag(variance)),
        )

    @property
    def overlays(self) -> tuple[Overlay, ...]:
        """Measured and predicted torque of each trajectory; raises an error for bad data."""
        if self.gap is None:
            raise IdentificationError(f'no residual: {self.summary}')
        return self.gap.overlays

    @property
    def not_checked(self) -> tuple[str, ...]:
        """Joints without usable data, because they rest or reverse in every row."""
        return unchecked_joints(self.data, self.arm.robot.joints)

    def __repr__(self) -> str:
        """Return the verdict and its summary."""
        return f'Diagnosis: {self.verdict}. {self.summary}'
