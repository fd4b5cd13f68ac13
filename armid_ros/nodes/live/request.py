# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Request and answer of the diagnosis of a window of samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import time

from armid_ros.arm import ArmModel, Misfit
from armid_ros.diagnosis import diagnose, Diagnosis, DiagnosisSettings, Finding, known_misfit
from armid_ros.diagnosis.prepare import choose_filters
from armid_ros.errors import ArmidError
from armid_ros.identification.online.onset import onset
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.recording import Recording
import numpy as np

#: Verdict if the motion since the last change of the arm is too short.
WAITING = 'waiting'


@dataclass(frozen=True)
class Healthy:
    """
    Motion of the healthy arm, and its model at that time.

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
        Compute the misfit of the model in the band of the filters.

        Raises
        ------
        IdentificationError
            If the motion is too short for the filters.

        """
        return known_misfit(self.arm, [], filters, [self.recording])


@dataclass(frozen=True)
class DiagnosisRequest:
    """
    Request to diagnose a window.

    Attributes
    ----------
    arm : ArmModel
        The present model.
    window : Recording
        Latest samples of the arm.
    baseline : tuple of Recording
        Recordings of the healthy arm.
    misfit : Misfit or None
        Residual of the model when it was identified, used without a baseline.
    shortest : float
        Shortest window that is diagnosed [s].
    material : float
        Share of a joint's torque below which a cause does not matter.
    seed : int
        Random seed of the diagnosis.
    end : float
        Time of the last sample of the window, on the time base of the node [s].
    healthy : Healthy or None
        Motion of the healthy arm, from which the misfit is computed if no baseline is given.
    of_one_arm : bool
        Whether the whole window lies after the last change of the arm. The residual of a wrong
        model varies with the motion and hides further changes, so that none is searched for.

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
    """Root mean square residual of a joint before and after the patch, and noise floor [N m]."""

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
        Verdict of a diagnosis; 'waiting' if the motion since the last change is too short;
        'bad_data' if the window cannot be diagnosed.
    summary : str
        Verdict in one or two sentences.
    findings : tuple of Finding
        Named effects.
    gap : tuple of GapOfJoint
        Residuals of the joints.
    arm : ArmModel
        Patched model; the model of the request if no effect was named.
    window : Recording
        Diagnosed part of the window, after the last change of the arm.
    end : float
        Time of its last sample, on the time base of the node [s].
    seconds : float
        Processor time of the diagnosis [s].
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
        """Return names and joints of the named effects, the largest first."""
        return tuple((finding.name, finding.joints) for finding in self.findings)


def answer(request: DiagnosisRequest) -> tuple[Answer, Diagnosis | None]:
    """
    Diagnose a window; the diagnosis is None if the window cannot be diagnosed.

    Samples before the last change of the residual are skipped.

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
            text = f'the arm changed {window.duration:.0f} s ago: the diagnosis needs more motion'
            return answered(WAITING, text), None
        rng, misfit = np.random.default_rng(request.seed), request.misfit
        if request.healthy is not None and not request.baseline:
            # misfit of the healthy arm, in the band of the window
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
