# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The diagnosis: from recordings and a model to a verdict.

The model is tried as it is, with single causes added (what is wrong with the description shows
there), and with its rigid body and known effects fitted anew, where only the structure counts.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.bodies import as_bodies
from armid_ros.diagnosis.evidence import trajectories, Trajectory
from armid_ros.diagnosis.floor import Floor, noise_floor
from armid_ros.diagnosis.gap import Gap, measure_gap
from armid_ros.diagnosis.gate import check_data, Gate
from armid_ros.diagnosis.league import League, make_league
from armid_ros.diagnosis.model_search import as_described, explain, Explanation, no_worse
from armid_ros.diagnosis.pattern import find_pattern, Pattern
from armid_ros.diagnosis.prepare import choose_filters, prepare
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.diagnosis.tied_search import explain_tied, within_its_noise
from armid_ros.diagnosis.tied_values import TieRegression
from armid_ros.diagnosis.verdict import decide, Finding, Verdict
from armid_ros.diagnosis.where import locate, Where
from armid_ros.diagnosis.wrong_body import wrong_body
from armid_ros.errors import IdentificationError
from armid_ros.identification.checks import check_motion
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np

#: Told the share that is done and what is being done.
Progress = Callable[[float, str], None]

#: Causes that a model as described may lack before a fit of everything is the better explanation.
_FIXED_STEPS = 3


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
        What was named, with parameters, rivals and the experiment that would separate them.
    where : tuple of Where
        Where the gap was before anything was named, or is where nothing was.
    left : tuple of Where
        Where what remains lives.
    gap : Gap or None
        Errors before and after beside the noise; None where the data are bad.
    explanation : Explanation or None
        How it was found.
    league : League
        How sure each candidate is.
    arm : ArmModel
        The patched model.
    gate : Gate or None
        What the data are like.
    data : tuple of Trajectory
        What was looked at.
    floors : tuple of Floor
        Noise of each trajectory.
    not_visible : tuple of str
        Names of the catalogue that these data cannot show.
    refitted : bool
        Whether the rigid body and known effects were fitted anew.
    pattern : Pattern or None
        What all values that are off have in common, where nothing was named.
    notes : tuple of str
        What a reader should know.

    """

    verdict: str
    summary: str
    findings: tuple[Finding, ...]
    where: tuple[Where, ...]
    left: tuple[Where, ...]
    gap: Gap | None
    explanation: Explanation | None
    league: League
    arm: ArmModel
    gate: Gate | None
    data: tuple[Trajectory, ...]
    floors: tuple[Floor, ...]
    not_visible: tuple[str, ...]
    refitted: bool
    pattern: Pattern | None
    notes: tuple[str, ...]


def diagnose(
    arm: ArmModel,
    recordings: Sequence[Recording],
    *,
    validate: Sequence[Recording] = (),
    settings: DiagnosisSettings | None = None,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> Diagnosis:
    """
    Find what a model lacks.

    Parameters
    ----------
    arm : ArmModel
        The model as it is believed to be: rigid body, gravity, known effects with values.
    recordings : sequence of Recording
        Data with torques; three speeds or more with two equal periods each are best.
    validate : sequence of Recording
        Data that are only predicted.
    settings : DiagnosisSettings, optional
        Thresholds and library.
    rng : numpy.random.Generator
        Draws the states over which base parameters are found, and resamplings of the data.
    progress : callable, optional
        Told the share that is done and what is being done.

    Returns
    -------
    Diagnosis
        Verdict, names, patched model.

    Raises
    ------
    IdentificationError
        If there is nothing to diagnose: no torque, no motion, too short.

    """
    settings = settings or DiagnosisSettings()
    tell = progress or _silent
    tell(0.02, 'filtering')
    used = choose_filters(recordings, settings)
    data: Sequence[Trajectory] = trajectories(recordings, used, arm)
    gate = check_data(arm, recordings, data)
    faults, notes = list(gate.faults), [*gate.notes]
    try:
        notes += check_motion(arm.robot, recordings, used)
    except IdentificationError as error:
        faults.append(str(error))
    if faults:
        return _bad(arm, gate, data, tuple(faults))
    tell(0.1, 'noise floor')
    prepared = prepare(arm, recordings, used, data, settings, rng)
    data, base, floors = prepared.data, prepared.base, prepared.floors
    sigma, as_told = prepared.sigma, prepared.as_told
    if any(floor.period is None for floor in floors):
        notes.append(
            'nothing repeats in some recordings: their noise floor is assumed from what rows '
            'differ by from their neighbours; two equal periods would measure it'
        )
    found = None
    if settings.partner is not None:
        tell(0.2, f'ties to {settings.partner.source}')
        ties = TieRegression(arm, tuple(recordings), prepared.used, settings)
        found = explain_tied(arm, settings.partner, data, sigma, base, settings, ties)
        found = found or within_its_noise(arm, data, as_told, settings)
    if found is None:
        chosen = _explained(arm, data, (sigma, as_told), base, settings, tell)
    else:
        chosen, sigma = found
    chosen, remarks = as_bodies(chosen, arm, data, sigma, settings)
    notes += remarks
    pattern = None if chosen.steps else find_pattern(chosen, arm, data, sigma)
    if pattern is not None:
        notes.append(pattern.sentence)
    tell(0.85, 'held-out gap')
    floors = tuple(noise_floor(part, chosen.fitted.arm) for part in data)
    gap = measure_gap(chosen, data, floors, validate, prepared.used, settings.consistent_loss)
    verdict: Verdict = decide(chosen, floors, gap, settings, arm)
    where = locate(
        chosen.reference.arm,
        data,
        chosen.reference.residual,
        chosen.reference_losses,
        settings.consistent_loss,
    )
    left = locate(
        chosen.fitted.arm, data, chosen.fitted.residual, chosen.losses, settings.consistent_loss
    )
    tell(1.0, verdict.word)
    return Diagnosis(
        verdict=verdict.word,
        summary=verdict.summary,
        findings=verdict.findings,
        where=where,
        left=left,
        gap=gap,
        explanation=chosen,
        league=make_league(chosen, arm, settings, rng),
        arm=chosen.fitted.arm,
        gate=gate,
        data=tuple(data),
        floors=floors,
        not_visible=_not_visible(chosen, settings),
        refitted=chosen.base is not None,
        pattern=pattern,
        notes=tuple(notes),
    )


def _explained(
    arm: ArmModel,
    data: Sequence[Trajectory],
    sigmas: tuple[Sequence[FloatArray], Sequence[FloatArray]],
    base: BaseParameters,
    settings: DiagnosisSettings,
    tell: Progress,
) -> Explanation:
    """Explain the gap of the arm as described or fitted anew, each at its own noise."""
    sigma, as_told = sigmas
    tell(0.25, 'model as described')
    fixed = explain(arm, data, as_told, None, settings, _FIXED_STEPS)
    explained = bool(np.all(fixed.losses < settings.consistent_loss))
    if explained and len(fixed.steps) == 1:
        return fixed
    if explained and not fixed.steps:
        refitted = explain(arm, data, sigma, base, settings, 1)
        return replace(fixed, survey=refitted.survey)
    tell(0.5, 'model fitted anew')
    chosen = explain(arm, data, sigma, base, settings, settings.most_steps)
    chosen = as_described(chosen, fixed, arm, data, as_told, settings)
    names = len(fixed.steps)
    fewer = 0 < names <= max(1, len(chosen.steps))
    if fewer and no_worse(fixed.losses, chosen.losses, settings):
        return fixed
    if not chosen.steps and np.all(chosen.losses < settings.consistent_loss):
        return wrong_body(chosen, fixed, arm, data, as_told, settings)
    return chosen


def _not_visible(chosen: Explanation, settings: DiagnosisSettings) -> tuple[str, ...]:
    names = [kind.name for kind in settings.kinds]
    hidden = chosen.survey.hidden if chosen.survey is not None else frozenset()
    return tuple(name for name in names if name in hidden)


def _bad(
    arm: ArmModel, gate: Gate, data: Sequence[Trajectory], faults: tuple[str, ...]
) -> Diagnosis:
    return Diagnosis(
        verdict='bad_data',
        summary=f'The data cannot be diagnosed: {"; ".join(faults)}.',
        findings=(),
        where=(),
        left=(),
        gap=None,
        explanation=None,
        league=League(),
        arm=arm,
        gate=gate,
        data=tuple(data),
        floors=(),
        not_visible=(),
        refitted=False,
        pattern=None,
        notes=gate.notes,
    )


def _silent(share: float, what: str) -> None:
    """Tell nobody."""
