# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a diagnosis came to."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Trajectory
from armid_ros.diagnosis.data.floor import NoiseFloor
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.verdict.finding import Finding
from armid_ros.diagnosis.verdict.gap import Gap
from armid_ros.diagnosis.verdict.where import Where


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
