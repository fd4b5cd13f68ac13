# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Settings, request and answer of the diagnosis of the latest samples of an arm."""

from __future__ import annotations

from dataclasses import dataclass, replace
import time

from armid_ros.arm import ArmModel, Misfit
from armid_ros.diagnosis import diagnose, Diagnosis, DiagnosisSettings, Finding, known_misfit
from armid_ros.diagnosis.prepare import choose_filters
from armid_ros.diagnosis.verdict.finding import Gap
from armid_ros.errors import ArmidError, IdentificationError
from armid_ros.identification.online.onset import onset
from armid_ros.recording import Recording
import numpy as np

#: Name and joints of an effect.
Named = tuple[str, tuple[str, ...]]
#: Verdict if the motion since the last change of the arm is too short.
WAITING = 'waiting'


@dataclass(frozen=True)
class LiveSettings:
    """
    Settings of the live diagnosis.

    Attributes
    ----------
    window : float
        Longest duration of motion that is diagnosed [s].
    shortest : float
        Shortest duration of motion that is diagnosed [s].
    every : float
        Duration of motion between two requests [s].
    rate : float
        Rate of the kept samples [Hz].
    confirmations : int
        Diagnoses in a row that must agree on an effect.
    learning : float
        Motion at the beginning in which the arm is healthy [s]. The misfit of the model is
        computed from it if neither a baseline nor a misfit is given. 0: no misfit is used.
    material : float
        Share of a joint's torque below which an effect does not matter.

    """

    window: float = 20.0
    shortest: float = 8.0
    every: float = 4.0
    rate: float = 200.0
    confirmations: int = 2
    learning: float = 20.0
    material: float = 0.01

    def __post_init__(self) -> None:
        """Raise an IdentificationError unless 0 < shortest <= window."""
        if not 0.0 < self.shortest <= self.window:
            raise IdentificationError(
                f"the parameter 'shortest' is {self.shortest:g} s, but has to be positive and at "
                f"most the parameter 'window', {self.window:g} s"
            )


@dataclass(frozen=True)
class DiagnosisRequest:
    """
    Input of a live diagnosis: latest samples of an arm, model, baseline and settings.

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
    settings : LiveSettings
        Settings of the diagnosis.
    seed : int
        Random seed of the diagnosis.
    end : float
        Time of the last sample of the window, on the time base of the node [s].
    healthy : tuple of ArmModel and Recording, or None
        Motion of the healthy arm, and the model at that time; they give the misfit if no
        baseline is given.
    of_one_arm : bool
        Whether all samples follow the last change of the arm. The residual of a wrong model
        varies with the motion and hides further changes, so they are not searched.

    """

    arm: ArmModel
    window: Recording
    baseline: tuple[Recording, ...] = ()
    misfit: Misfit | None = None
    settings: LiveSettings = LiveSettings()
    seed: int = 0
    end: float = 0.0
    healthy: tuple[ArmModel, Recording] | None = None
    of_one_arm: bool = False


@dataclass(frozen=True)
class Answer:
    """
    Diagnosis of the latest samples of an arm.

    Attributes
    ----------
    verdict : str
        Verdict of a diagnosis; 'waiting' if the motion since the last change is too short;
        'bad_data' if the window cannot be diagnosed.
    summary : str
        Verdict in one or two sentences.
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
    findings : tuple of Finding
        Named effects.
    gap : Gap or None
        Residuals of the joints, without curves; None if the window was not diagnosed.

    """

    verdict: str
    summary: str
    arm: ArmModel
    window: Recording
    end: float
    seconds: float
    changed: bool = False
    findings: tuple[Finding, ...] = ()
    gap: Gap | None = None

    @property
    def named(self) -> tuple[Named, ...]:
        """Names and joints of the named effects, the largest effect first."""
        return tuple((finding.name, finding.joints) for finding in self.findings)


def answer(request: DiagnosisRequest) -> tuple[Answer, Diagnosis | None]:
    """
    Diagnose the latest samples of an arm.

    Samples before the last change of the residual are skipped. The diagnosis is None for samples
    that cannot be diagnosed.

    """
    begun, arm, window = time.process_time(), request.arm, request.window
    settings = DiagnosisSettings(material=request.settings.material)
    found: Diagnosis | None = None
    try:
        changed = None if request.of_one_arm else onset(arm, window)
        if changed is not None:
            window = window.select(window.t >= changed)
            window = replace(window, t=window.t - (window.t[0] if len(window) else 0.0))
        if window.duration < request.settings.shortest:
            verdict = WAITING
            summary = (
                f'the arm changed {window.duration:.0f} s ago: the diagnosis requires more motion'
            )
        else:
            misfit = request.misfit
            if request.healthy is not None and not request.baseline:
                # misfit of the healthy arm, in the band of the window
                rng = np.random.default_rng(request.seed)
                filters = choose_filters(arm, [window], (), settings, rng)
                misfit = known_misfit(request.healthy[0], [], filters, [request.healthy[1]])
            found = diagnose(
                arm,
                [window],
                baseline=request.baseline,
                misfit=misfit,
                settings=settings,
                rng=np.random.default_rng(request.seed),
            )
            verdict, summary = found.verdict, found.summary
    except ArmidError as error:
        verdict, summary = 'bad_data', str(error)
    result = Answer(
        verdict,
        summary,
        arm if found is None else found.arm,
        window,
        request.end,
        time.process_time() - begun,
        changed=window is not request.window,
    )
    if found is not None:
        gap = None if found.gap is None else replace(found.gap, overlays=())
        result = replace(result, findings=tuple(found.findings), gap=gap)
    return result, found
