# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What a diagnosis came to, and causes as they are said.

A cause has its name, joints, values, share of the gap, and what else it may be.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import NoiseFloor
from armid_ros.diagnosis.data.trajectory import Trajectory
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.verdict.where import Where
from armid_ros.estimate import ParameterName
from armid_ros.model.spring_ties import Tie
from armid_ros.motion import FloatArray

#: Less of the gap than this is none in a sentence.
SAID = 0.01


@dataclass(frozen=True)
class Rival:
    """A name that the data do not exclude in the place of another, and the joints it is on."""

    name: str
    joints: tuple[str, ...]


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
        Their values and standard deviations; nan where the data do not tell.
    share : float
        Share of the held-out gap that it takes, 0 to 1.
    share_interval : tuple of float
        Its 95 % interval.
    p : float
        Probability of such a gain if it did nothing, over all that was tried.
    rivals : tuple of Rival
        What the data do not exclude in its place, the likeliest first.
    experiment : str
        What would separate them; empty if there is nothing to separate.
    gain : float
        Squares over the unit of the gap that it takes, held out.
    sign : str
        What a positive value means, where the name does not say it.
    ties : tuple of Tie
        Where it holds the arm, in the order of its joints, if it ends at another machine.
    weighs : bool
        Whether its first value is a weight that says what it is.
    together : tuple of str
        Names that are one cause with it, of which its share is: a gravity of another direction and
        another size.
    of_joint : tuple of (str, float)
        The joint in which it takes most of what the other names leave, and that share, where it
        takes next to nothing of the whole gap; empty where it does.

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
    experiment: str = ''
    gain: float = 0.0
    sign: str = ''
    ties: tuple[Tie, ...] = ()
    weighs: bool = False
    together: tuple[str, ...] = ()
    of_joint: tuple[str, float] = ('', 0.0)

    @property
    def ambiguous_with(self) -> tuple[str, ...]:
        """Names that the data do not exclude in its place."""
        return tuple(rival.name for rival in self.rivals)

    def place_of(self, joint: str) -> str:
        """Return where a joint's parameters act: at a segment that is tied, or the joint."""
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
        Measured torque, and what both models predict [N m].
    sigma : ndarray, shape (n,)
        Noise [N m].

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
    Errors in numbers.

    Attributes
    ----------
    before, after, floor : ndarray, shape (n,)
        Root mean square error of each joint without and with what was named, and the noise [N m].
    chi2_before : ndarray, shape (n,)
        Mean square over noise without what was named.
    closed : float
        Share of the excess over the noise that is gone, 0 to 1, in the joints that had a gap or
        have one.
    predicted : bool
        Whether it was measured on recordings that nothing was fitted to.
    overlays : tuple of Overlay
        The curves.

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
        """Return what it was measured on, for a reader."""
        return 'held-out' if self.predicted else 'the data it was found in'


@dataclass(frozen=True)
class Diagnosis:
    """
    What a diagnosis came to.

    Attributes
    ----------
    verdict : str
        consistent, named, ambiguous, partial, unknown, not_repeatable or bad_data.
    summary : str
        The same in a sentence or two.
    findings : tuple of Finding
        The headline: what was named, with share, parameters, rivals and the experiment that would
        separate them.
    minor : tuple of Finding
        What is statistically there and does not matter.
    where : tuple of Where
        Where the gap was before anything was named, or is where nothing was.
    left : tuple of Where
        Where what remains lives.
    gap : Gap or None
        Errors before and after beside the floor; None where the data are bad.
    explanation : Explanation or None
        How it was found.
    arm : ArmModel
        The patched model; as given where nothing was named or a patch would harm.
    data : tuple of Trajectory
        What was looked at.
    floors : tuple of NoiseFloor
        Noise of each trajectory.
    not_visible : tuple of str
        Names of the catalogue that these data cannot show.
    refitted : bool
        Whether the rigid body and known effects were fitted anew.
    notes : tuple of str
        What a reader should know.
    baseline : str
        What the floor of the gap is: the noise, the model's own misfit, or an estimate of it.
    harmful : bool
        Whether the model is not patched, as what was named would make it worse in some joint.

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
    floors: tuple[NoiseFloor, ...]
    not_visible: tuple[str, ...]
    refitted: bool
    notes: tuple[str, ...]
    baseline: str
    harmful: bool = False

    def __repr__(self) -> str:
        """Return the verdict and what was said."""
        return f'Diagnosis: {self.verdict}. {self.summary}'
