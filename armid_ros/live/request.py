# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is asked of a window of samples, and what is answered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import time

from armid_ros.arm import ArmModel, Misfit
from armid_ros.diagnosis import diagnose, Diagnosis, DiagnosisSettings, Finding
from armid_ros.diagnosis.data.prepare import choose_filters
from armid_ros.errors import ArmidError, IdentificationError
from armid_ros.live.onset import block_powers, onset
from armid_ros.recording import Recording
import numpy as np

#: The verdict where too little came since the arm changed.
WAITING = 'waiting'


@dataclass(frozen=True)
class DiagnosisRequest:
    """
    What is asked.

    Attributes
    ----------
    arm : ArmModel
        The model as it is believed to be.
    window : Recording
        What came lately.
    baseline : tuple of Recording
        From when nothing was wrong.
    misfit : Misfit or None
        Residual of the model when it was identified, where there is no baseline.
    shortest : float
        A window shorter than this tells too little [s].
    material : float
        Share of a joint's torque below which a cause does not matter.
    seed : int
        Of the diagnosis.
    end : float
        When the last sample of the window was, in the time of who asks [s].
    learn : bool
        Whether nothing is wrong yet, and only the misfit of the model is asked for.

    """

    arm: ArmModel
    window: Recording
    baseline: tuple[Recording, ...] = ()
    misfit: Misfit | None = None
    shortest: float = 8.0
    material: float = 0.01
    seed: int = 0
    end: float = 0.0
    learn: bool = False


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
    What a window tells.

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
        When its last sample was, in the time of who asked [s].
    seconds : float
        Processor time that it took [s].
    misfit : Misfit or None
        What the model leaves, where only that was asked for.

    """

    verdict: str
    summary: str
    findings: tuple[Finding, ...]
    gap: tuple[GapOfJoint, ...]
    arm: ArmModel
    window: Recording
    end: float
    seconds: float
    misfit: Misfit | None = None

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

    def said(
        verdict: str, summary: str, findings: Sequence[Finding] = (), patched: ArmModel = arm
    ) -> Answer:
        spent = time.process_time() - begun
        more = () if found is None else _gap(found)
        return Answer(verdict, summary, tuple(findings), more, patched, window, request.end, spent)

    found: Diagnosis | None = None
    try:
        if request.learn:
            text = 'the misfit of the model was measured'
            return replace(said('consistent', text), misfit=own_misfit(arm, window)), None
        changed = onset(arm, window)
        if changed is not None:
            window = since(window, changed)
        if window.duration < request.shortest:
            text = f'the arm changed {window.duration:.0f} s ago: more motion is needed'
            return said(WAITING, text), None
        found = diagnose(
            arm,
            [window],
            baseline=request.baseline,
            misfit=None if request.baseline else request.misfit,
            settings=DiagnosisSettings(material=request.material),
            rng=np.random.default_rng(request.seed),
        )
    except ArmidError as error:
        return said('bad_data', str(error)), None
    return said(found.verdict, found.summary, found.findings, found.arm), found


def own_misfit(arm: ArmModel, healthy: Recording) -> Misfit:
    """
    Measure what a model leaves of motion in which nothing is wrong, in the band of a diagnosis.

    Raises
    ------
    IdentificationError
        If the motion is too short for the filters.

    """
    filters = choose_filters(arm, [healthy], (), DiagnosisSettings(), np.random.default_rng(0))
    power = block_powers(arm, healthy, filters)[:, 1:]
    if not len(power):
        raise IdentificationError(f'{healthy.duration:.1f} s are too short to measure a misfit')
    assert healthy.tau is not None
    torque = float(np.sum(healthy.tau**2) / len(healthy))
    rms = dict(zip(arm.robot.joints, np.sqrt(power.mean(axis=0)).tolist(), strict=True))
    return Misfit('held-out', rms, 100.0 * float(np.sqrt(power.mean(axis=0).sum() / torque)))


def since(recording: Recording, t: float) -> Recording:
    """Return what a recording holds from a time on [s]."""
    kept = recording.t >= t
    begin = recording.t[kept][0] if kept.any() else 0.0
    return Recording(
        joints=recording.joints,
        t=recording.t[kept] - begin,
        q=recording.q[kept],
        dq=None if recording.dq is None else recording.dq[kept],
        tau=None if recording.tau is None else recording.tau[kept],
        source=recording.source,
    )


def _gap(diagnosis: Diagnosis) -> tuple[GapOfJoint, ...]:
    gap = diagnosis.gap
    if gap is None:
        return ()
    rows = zip(diagnosis.arm.robot.joints, gap.before, gap.after, gap.floor, strict=True)
    return tuple(GapOfJoint(joint, *map(float, numbers)) for joint, *numbers in rows)
