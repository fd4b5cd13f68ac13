# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis of a window of samples: request and answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import time

from armid_ros.arm import ArmModel, Misfit
from armid_ros.diagnosis import diagnose, Diagnosis, DiagnosisSettings, Finding, known_misfit
from armid_ros.diagnosis.prepare import choose_filters
from armid_ros.errors import ArmidError
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.live.onset import onset
from armid_ros.recording import Recording
import numpy as np

#: The verdict where too little came since the arm changed.
WAITING = 'waiting'


@dataclass(frozen=True)
class Healthy:
    """
    Motion in which nothing was wrong, and the model of the arm as it was then.

    Attributes
    ----------
    arm : ArmModel
        The model.
    recording : Recording
        The motion.

    """

    arm: ArmModel
    recording: Recording

    def misfit(self, filters: Conditioning) -> Misfit:
        """
        Measure what the model leaves of the motion: the narrower the band, the less noise.

        Raises
        ------
        IdentificationError
            If the motion is too short for the filters.

        """
        return known_misfit(self.arm, [], filters, [self.recording])


@dataclass(frozen=True)
class DiagnosisRequest:
    """
    A window to be diagnosed.

    Attributes
    ----------
    arm : ArmModel
        The present model.
    window : Recording
        What came lately.
    baseline : tuple of Recording
        From when nothing was wrong.
    misfit : Misfit or None
        Residual of the model when it was identified, where there is no baseline.
    shortest : float
        Shortest window that is diagnosed [s].
    material : float
        Share of a joint's torque below which a cause does not matter.
    seed : int
        Of the diagnosis.
    end : float
        When the last sample of the window was, in the time of the request [s].
    healthy : Healthy or None
        Motion to compute the misfit from, where neither of them is known.
    of_one_arm : bool
        Whether all of the window is since the arm changed last. What a wrong model leaves comes
        and goes with the motion, so that it hides any further change.

    """

    arm: ArmModel
    window: Recording
    baseline: tuple[Recording, ...] = ()
    misfit: Misfit | None = None
    shortest: float = 8.0
    material: float = 0.01
    seed: int = 0
    end: float = 0.0
    healthy: Healthy | None = None
    of_one_arm: bool = False


@dataclass(frozen=True)
class GapOfJoint:
    """Root mean square error of a joint before and after, and the floor [N m]."""

    joint: str
    before: float
    after: float
    floor: float


@dataclass(frozen=True)
class Answer:
    """
    The diagnosis of a window.

    Attributes
    ----------
    verdict : str
        One of a diagnosis; 'waiting' where too little came since the arm changed; 'bad_data'
        where the window cannot be diagnosed.
    summary : str
        The same in a sentence or two.
    findings : tuple of Finding
        What was named.
    gap : tuple of GapOfJoint
        Errors of the joints.
    arm : ArmModel
        The patched model; that of the question where nothing was named.
    window : Recording
        What was looked at: the part of the window since the arm changed last.
    end : float
        When its last sample was, in the time of the request [s].
    seconds : float
        Processor time that it took [s].
    changed : bool
        Whether the arm changed in the window.

    """

    verdict: str
    summary: str
    findings: tuple[Finding, ...]
    gap: tuple[GapOfJoint, ...]
    arm: ArmModel
    window: Recording
    end: float
    seconds: float
    changed: bool = False

    @property
    def named(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """Name and joints of what was named, the largest first."""
        return tuple((finding.name, finding.joints) for finding in self.findings)


def answer(request: DiagnosisRequest) -> tuple[Answer, Diagnosis | None]:
    """
    Diagnose a window; the diagnosis is None where that cannot be done.

    What came before the residual of the model changed is of another arm, and is left out.

    """
    begun, arm, window = time.process_time(), request.arm, request.window

    def answered(
        verdict: str, summary: str, findings: Sequence[Finding] = (), patched: ArmModel = arm
    ) -> Answer:
        spent = time.process_time() - begun
        gap = None if found is None else found.gap
        more: tuple[GapOfJoint, ...] = ()
        if gap is not None:
            rows = zip(arm.robot.joints, gap.before, gap.after, gap.floor, strict=True)
            more = tuple(GapOfJoint(joint, *map(float, numbers)) for joint, *numbers in rows)
        cut = window is not request.window
        return Answer(
            verdict, summary, tuple(findings), more, patched, window, request.end, spent, cut
        )

    found: Diagnosis | None = None
    settings = DiagnosisSettings(material=request.material)
    try:
        changed = None if request.of_one_arm else onset(arm, window)
        if changed is not None:
            window = window.select(window.t >= changed)
            window = replace(window, t=window.t - (window.t[0] if len(window) else 0.0))
        if window.duration < request.shortest:
            text = f'the arm changed {window.duration:.0f} s ago: more motion is needed'
            return answered(WAITING, text), None
        rng, misfit = np.random.default_rng(request.seed), request.misfit
        if request.healthy is not None and not request.baseline:
            # what the model left before, in the band in which the window is looked at
            misfit = request.healthy.misfit(choose_filters(arm, [window], (), settings, rng))
        found = diagnose(
            arm,
            [window],
            baseline=request.baseline,
            misfit=misfit,
            settings=settings,
            rng=np.random.default_rng(request.seed),
        )
    except ArmidError as error:
        return answered('bad_data', str(error)), None
    return answered(found.verdict, found.summary, found.findings, found.arm), found
