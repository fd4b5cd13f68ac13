# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The result of a diagnosis, and causes as they are reported.

A cause has its name, joints, values, share of the gap, and rivals.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.trajectory import not_shown, Trajectory
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.spans import Span
from armid_ros.diagnosis.verdict.where import Where
from armid_ros.effects import CATALOGUE, Effect
from armid_ros.estimate import Estimate, name_in_words, ParameterName
from armid_ros.model.spring_ties import Tie
from armid_ros.motion import FloatArray
import numpy as np
import scipy.linalg

#: Smallest share of the gap that a sentence gives as a number.
SAID = 0.01


@dataclass(frozen=True)
class Rival:
    """A competing cause that the data do not exclude, with joints and probability."""

    name: str
    joints: tuple[str, ...]
    probability: float = 0.0


@dataclass(frozen=True)
class Finding:
    """
    One named effect.

    Attributes
    ----------
    name : str
        Its name in the catalogue.
    joints : tuple of str
        The joints it is on; none for the whole arm.
    parameters : tuple of ParameterName
        Its parameters, shapes included.
    values, std : tuple of float
        Their values and standard deviations; nan where the data do not determine them.
    share : float
        Share of the held-out gap that it explains, 0 to 1.
    share_interval : tuple of float
        Its 95 % interval.
    p : float
        Probability that it is not there, or has not changed.
    rivals : tuple of Rival
        Names that the data do not exclude in its place, the likeliest first.
    gain : float
        Reduction of the held-out squares; twice the log Bayes factor in the small print.
    sign : str
        What a positive value means, where the name does not say it.
    ties : tuple of Tie
        Where it holds the arm, in the order of its joints, if it is tied to another machine.
    weighs : bool
        Whether it is described by a mass, its first value.
    together : tuple of str
        Names that are one cause with it and have the share in common: a gravity of another
        direction and another size.
    added_to : tuple of float
        Values of the same parameters in the given model, which its values are added to; empty
        where none is known.
    look_at : str
        What to look at for the one cause that several names stand for, instead of what each says.
    probability : float
        Among all explanations.

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
    gain: float = 0.0
    sign: str = ''
    ties: tuple[Tie, ...] = ()
    weighs: bool = False
    together: tuple[str, ...] = ()
    added_to: tuple[float, ...] = ()
    look_at: str = ''
    probability: float = 0.0

    @property
    def had(self) -> tuple[float, ...]:
        """Return the value that each change is added to; zero where none is known."""
        return self.added_to or (0.0,) * len(self.values)

    @property
    def ambiguous_with(self) -> tuple[str, ...]:
        """Names of the rivals."""
        return tuple(rival.name for rival in self.rivals)

    @property
    def experiment(self) -> str:
        """
        Return the experiment that separates it from its likeliest rival; empty without rival.

        No motion separates a payload from the link that carries it: it has to be taken off.

        """
        if not self.rivals:
            return ''
        rival = self.rivals[0]
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
                f'No motion separates {names}, as they move as one body. Weigh what the link '
                f'carries, or record {best}.'
            )
        return f'To separate {names}, record {best}.'

    def place_of(self, joint: str) -> str:
        """Return where the parameters of a joint act: its tied segment, or the joint itself."""
        return next((tie.name for tie in self.ties if tie.joint == joint), joint)

    def values_of(self, joint: str) -> list[tuple[ParameterName, float, float]]:
        """Return name, value and standard deviation of the parameters of one joint."""
        rows = zip(self.parameters, self.values, self.std, strict=True)
        return [row for row in rows if row[0].joint == joint]


@dataclass(frozen=True)
class Overlay:
    """
    Torques of one trajectory, filtered alike.

    Attributes
    ----------
    source : str
        The recording.
    trajectory : Trajectory
        Its motion.
    measured, before, after : ndarray, shape (M, n)
        Measured torque, and predictions of the model without and with the names [N m].
    sigma : ndarray, shape (n,)
        Unit of the gap [N m].

    """

    source: str
    trajectory: Trajectory
    measured: FloatArray
    before: FloatArray
    after: FloatArray
    sigma: FloatArray


@dataclass(frozen=True)
class Gap:
    """
    The gap in numbers.

    Attributes
    ----------
    before, after, floor : ndarray, shape (n,)
        Root mean square residual of each joint without and with the names, and root mean square
        unit of the gap [N m].
    chi2_before : ndarray, shape (n,)
        Mean square of the weighted residual without the names.
    closed : float
        Share of the excess over the floor that the names explain, 0 to 1, in joints that had a
        gap.
    predicted : bool
        Whether it was measured on held-out recordings.
    overlays : tuple of Overlay
        Torques of each trajectory.

    """

    before: FloatArray
    after: FloatArray
    floor: FloatArray
    chi2_before: FloatArray
    closed: float
    predicted: bool
    overlays: tuple[Overlay, ...]

    @property
    def data(self) -> str:
        """Return the data that it was measured on, in words."""
        return 'held-out' if self.predicted else 'the data it was found in'


@dataclass(frozen=True)
class Diagnosis:
    """
    Result of a diagnosis.

    Attributes
    ----------
    verdict : str
        consistent, named, ambiguous, partial, unknown, not_repeatable or bad_data.
    summary : str
        The same in a sentence or two.
    findings : tuple of Finding
        The headline: named effects with share, parameters, rivals and the experiment that would
        separate them.
    minor : tuple of Finding
        The small print: causes that are significant and do not matter.
    where : tuple of Where
        Where the model without the names has a gap.
    left : tuple of Where
        Where the model with the names still has a gap.
    gap : Gap or None
        Residuals before and after, and the floor; None where the data are bad.
    explanation : Explanation or None
        The names with their fits and trials; None where the data are bad.
    arm : ArmModel
        The patched model; the given one where nothing was named or a patch would harm.
    data : tuple of Trajectory
        The recordings in question.
    not_visible : tuple of str
        Names of the catalogue that these data cannot show.
    refitted : bool
        Whether the rigid body was fitted anew.
    notes : tuple of str
        What a reader should know.
    baseline : str
        The floor of the gap in words: the noise, the model's own misfit, or an estimate of it.
    harmful : bool
        Whether the model is not patched, as the names would make it worse in some joint.
    doubt : str
        Why the model itself may be wrong, a sentence; empty if it need not be.
    spans : tuple of Span
        Seconds of each recording in which the findings act; none if they act throughout.

    """

    verdict: str
    summary: str
    findings: tuple[Finding, ...]
    minor: tuple[Finding, ...]
    where: tuple[Where, ...]
    left: tuple[Where, ...]
    gap: Gap | None
    explanation: Explanation | None
    arm: ArmModel
    data: tuple[Trajectory, ...]
    not_visible: tuple[str, ...]
    refitted: bool
    notes: tuple[str, ...]
    baseline: str
    harmful: bool = False
    doubt: str = ''
    spans: tuple[Span, ...] = ()

    def acting_in(self, spans: Sequence[Span]) -> Diagnosis:
        """Return the diagnosis with the time spans in which its causes act."""
        seconds = [f'{one.source} from {one.start:.1f} to {one.stop:.1f} s' for one in spans]
        summary = f'In {", ".join(seconds)}: {self.summary} Other seconds were not diagnosed.'
        return replace(self, summary=summary, spans=tuple(spans))

    @property
    def estimate(self) -> Estimate | None:
        """Estimate of the fit, followed by the named causes in terms of the catalogue."""
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
    def not_checked(self) -> tuple[str, ...]:
        """Joints without informative rows: at rest throughout, or always reversing."""
        return not_shown(self.data, self.arm.robot.joints)

    def __repr__(self) -> str:
        """Return the verdict and its sentence."""
        return f'Diagnosis: {self.verdict}. {self.summary}'
