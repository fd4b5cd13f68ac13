# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Diagnosis of a model: from recordings to named effects and a verdict."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from armid_ros.arm import ArmModel, Misfit
from armid_ros.arm.memoized_arm import memoized_arm, plain_arm
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import Evidence, joints_that_do_not_repeat, noise_floor
from armid_ros.diagnosis.data.trajectory import trajectories, Trajectory
from armid_ros.diagnosis.prepare import choose_filters, prepare, repaired, with_friction
from armid_ros.diagnosis.search.explainer import Explainer, Progress
from armid_ros.diagnosis.search.explanation import Explanation, NOISE
from armid_ros.diagnosis.search.spans import acting_spans
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.diagnosis.ties import diagnose_ties
from armid_ros.diagnosis.verdict.attribution import Attribution, headline
from armid_ros.diagnosis.verdict.bodies import as_bodies, as_possible_loads, on_outer_link
from armid_ros.diagnosis.verdict.finding import Diagnosis, Finding, Gap
from armid_ros.diagnosis.verdict.naming import findings, minor_findings
from armid_ros.diagnosis.verdict.remaining_misfit import (
    locate_blocked_joints,
    RemainingMisfit,
    unlisted_laws,
)
from armid_ros.diagnosis.verdict.remarks import data_remarks, doubt_of_model, with_doubt
from armid_ros.diagnosis.verdict.where import locate_explained, locate_remaining_gap
from armid_ros.diagnosis.verdict.words import decide
from armid_ros.errors import IdentificationError
from armid_ros.estimate import name_in_words
from armid_ros.identification.assess.data_faults import check_data, mistaken_recordings
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.rows.regression import Stretch
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt

#: Verdicts of a residual that no named effect explains completely.
OPEN = ('unknown', 'partial')
#: Note on recordings without two equal periods, whose difference would measure the noise.
_ASSUMED = (
    'noise of recordings without two equal periods is estimated from differences between '
    'neighbouring samples'
)
#: Note on a model without the covariance of its identification.
_AS_EXACT = 'intervals do not include errors of given values, as identification.json is missing'
#: Note if a cause acts temporarily and its time span in held-out recordings is unknown.
_NOT_TIMED = (
    'held-out recordings are not used: without a baseline, the seconds in which the cause acts in '
    'them are unknown'
)
#: Fault if the residual of the baseline is larger than its torque.
_NO_MODEL = (
    'in the baseline, the residual of the model is {ratio:.3g} times the measured torque. The '
    'model belongs to another arm, or has other units. Identify the arm from the baseline, and '
    'give the new model with --model'
)


def diagnose(
    arm: ArmModel,
    recordings: Sequence[Recording],
    *,
    validate: Sequence[Recording] = (),
    baseline: Sequence[Recording] = (),
    misfit: Misfit | None = None,
    settings: DiagnosisSettings | None = None,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> Diagnosis:
    """
    Find the effects that a model lacks, or that have changed.

    Parameters
    ----------
    arm : ArmModel
        The given model: rigid body, gravity, known effects with values.
    recordings : sequence of Recording
        The recordings to diagnose, with torques; several motions are best.
    validate : sequence of Recording
        Held-out recordings, which are predicted and not fitted.
    baseline : sequence of Recording
        Recordings from a time at which the model was right, such as those of its identification.
        Their residual is the misfit of the model, and the diagnosis finds changes since then.
    misfit : Misfit, optional
        Misfit of the model at its identification. The result is in doubt if the residual of the
        baseline is much larger.
    settings : DiagnosisSettings, optional
        Catalogue and thresholds.
    rng : numpy.random.Generator
        Draws the random states from which base parameters are found, and resamples the data.
    progress : callable, optional
        Called with the share of the work that is done, and the name of the present step.

    Returns
    -------
    Diagnosis
        Verdict, named effects, patched model.

    Raises
    ------
    IdentificationError
        If there is nothing to diagnose: no torque, no motion, too short.

    """
    settings = settings or DiagnosisSettings()
    tell = progress or (lambda share, what: None)
    if settings.everything:
        settings = replace(settings, material=0.0)
    tell(0.02, 'filtering')
    given, arm = arm, memoized_arm(arm)
    recordings, validate, baseline, repairs = repaired(recordings, validate, baseline, settings)
    used = choose_filters(arm, recordings, baseline, settings, rng.spawn(1)[0])
    data: Sequence[Trajectory] = trajectories(recordings, used, arm)
    checked = [
        Stretch(part.source, part.at_rows.with_torque(part.torque), part.informative)
        for part in data
    ]
    faults, notes = check_data(arm, recordings, used, checked, baseline)
    notes += repairs
    if faults:
        return _bad_data(given, data, faults, notes)
    notes += [f'prior odds set by the user: {k} is {odds}' for k, odds in settings.prior.items()]
    tell(0.1, 'noise floor')
    by_misfit = bool(baseline) and settings.partner is None
    prepared = prepare(arm, used, data, settings, rng, by_misfit)
    if any(floor.period is None for floor in prepared.floors):
        notes.append(_ASSUMED)
    if misfit is not None and misfit.information is None and not baseline:
        notes.append(_AS_EXACT)
    before = trajectories(baseline, prepared.used, arm, prepared.allowed)
    known = Baseline.of(arm, before, rng) if baseline else None
    if known is not None and known.errors[0] > 1.0:
        return _bad_data(given, data, [_NO_MODEL.format(ratio=known.errors[0])], notes)
    held_out = trajectories(validate, prepared.used, arm, prepared.allowed)
    explainer = Explainer(arm, prepared, known, rng, tell, settings, misfit, held_out)
    doubt = doubt_of_model(given, known, baseline, misfit, settings.thresholds)
    if settings.partner is not None:
        tell(0.2, f'ties to {settings.partner.source}')
        tied = diagnose_ties(explainer, recordings, settings.partner)
        if tied is not None:
            return _as_diagnosis(tied, notes, explainer, doubt, given)
    explanation = explainer.explanation()
    result = _as_diagnosis(explanation, notes, explainer, doubt, given)
    if _hardly_explained(result, settings):
        timed = _of_spans(explanation, explainer, recordings, validate, notes, doubt)
        result = timed or result
    if (result.verdict in OPEN or result.doubt) and settings.partner is None:
        groups = [*recordings, *validate], baseline
        apart = [one for group in groups for one in _with_unfitted_joints(arm, group, used)]
        # with a baseline, a mistake that needs fitted links is a change of the arm instead
        alone = mistaken_recordings(arm, apart, used, refit=not baseline)
        return _bad_data(given, result.data, alone, result.notes) if alone else result
    return result


def _hardly_explained(result: Diagnosis, settings: DiagnosisSettings) -> bool:
    """Return whether a gap remains open, or no finding explains more than half of the gap."""
    largest = max((one.share for one in result.findings), default=0.0)
    return result.verdict in OPEN or largest <= settings.thresholds.open_share


def _of_spans(
    explanation: Explanation,
    explainer: Explainer,
    recordings: Sequence[Recording],
    validate: Sequence[Recording],
    notes: Sequence[str],
    doubt: str,
) -> Diagnosis | None:
    """Diagnose only the time in which a cause acts; None if its residual stays unexplained."""
    settings, arm, prepared = explainer.settings, explainer.arm, explainer.prepared
    ranking = explanation.ranking
    spans = () if ranking is None else acting_spans(ranking, settings.thresholds)
    if all(one.whole for one in spans):
        return None
    shorter, held_out = list[Recording](), list[Recording]()
    for k, (span, one) in enumerate(zip(spans, [*recordings, *validate], strict=False)):
        margin = 0.25  # s: uncertainty of the start and of the end
        inside = (one.t >= span.start + margin) & (one.t <= span.stop - margin) | span.whole
        if span.stop > span.start:
            (shorter if k < len(recordings) else held_out).append(one.select(inside))
    if not shorter:
        return None
    if len(spans) < len(recordings) + len(validate):
        notes = (*notes, _NOT_TIMED)
    by_misfit = explainer.baseline is not None and settings.partner is None
    try:
        data, unseen = (
            trajectories(part, prepared.used, arm, prepared.allowed)
            for part in (shorter, held_out)
        )
        prepared = prepare(arm, prepared.used, data, settings, explainer.rng, by_misfit)
        within = replace(explainer, prepared=prepared, held_out=unseen)
        found = _as_diagnosis(within.explanation(), notes, within, doubt, plain_arm(arm))
    except IdentificationError:  # too short for the filters, or without motion
        return None
    if _hardly_explained(found, settings):
        return None
    spans = tuple(one for one in spans if one.stop > one.start)
    seconds = [f'{Path(x.source).name} from {x.start:.1f} to {x.stop:.1f} s' for x in spans]
    summary = f'In {", ".join(seconds)}: {found.summary} Other seconds were not diagnosed.'
    return replace(found, summary=summary, spans=spans)


def _with_unfitted_joints(
    arm: ArmModel, recordings: Sequence[Recording], used: Conditioning
) -> Iterator[tuple[Recording, npt.NDArray[np.bool_]]]:
    """Yield recordings with a mask of joints that the model fits in other recordings, not here."""
    unit = np.ones(arm.robot.n_joints)
    bad, sound = np.zeros((2, len(recordings), len(unit)), dtype=bool)
    for k, one in enumerate(recordings):
        parts = trajectories([one], used, arm)
        rows = Evidence.over_noise(parts, [unit] * len(parts))
        bad[k] = 100.0 * rows.relative_errors(rows.residuals(arm)) > LIMITS.unusable
        sound[k] = (rows.count > 0.0) & ~bad[k]
    for one, own in zip(recordings, bad & sound.any(axis=0), strict=True):
        if own.any():
            yield one, own


def _as_diagnosis(
    explanation: Explanation,
    notes: Sequence[str],
    explainer: Explainer,
    doubt: str,
    given: ArmModel,
) -> Diagnosis:
    """Convert an explanation to a diagnosis with findings, verdict, patched model and notes."""
    arm, settings, before = explainer.arm, explainer.settings, explainer.baseline
    explainer.tell(0.85, 'held-out gap')
    explanation, of_bodies = as_bodies(as_possible_loads(on_outer_link(explanation)))
    explanation, shares, unseen = _with_shares(explanation, explainer)
    both = (explanation.evidence, *(() if unseen is None else (unseen,)))
    excess = RemainingMisfit(explanation, both, before, arm, settings)
    evidence, patched = explanation.evidence, explanation.fitted.arm
    found, minor = findings(explanation, shares, arm, explainer.rng), minor_findings(explanation)
    worse, over, resting = excess.worse_joints(), excess.residual_over_limit(), excess.at_rest()
    laws = [] if explanation.measured else unlisted_laws(explanation, settings)
    least = settings.material * evidence.torque_rms
    floors, joints = explainer.prepared.floors, arm.robot.joints
    not_repeating = joints_that_do_not_repeat(joints, floors, settings.thresholds, least)
    explanation = explanation if found else replace(explanation, reference=explanation.fitted)
    gap = Gap.of(explanation, unseen)
    word = decide(
        found,
        not_repeating if explanation.measured else (),
        [*over, *resting, *laws],
        arm,
        NOISE if explanation.measured else explanation.floor,
        excess.given_body_over_limit(),
        minor,
        gap,
    )
    word, doubt = with_doubt(word, doubt, found, given, before)
    worst = int(np.argmax([one.ratio.max() for one in over]))
    left = locate_remaining_gap(explanation, both[worst], settings, laws)
    places = locate_explained(explanation, unseen or evidence, settings) if found else left
    explainer.tell(1.0, word.word)
    small = [x for x in found if settings.everything and x.share < settings.thresholds.headline]
    remarks = _remarks(found, worse, explanation, word.word, doubt, explainer, gap)
    untested = explanation.untested if before is not None else ''
    return Diagnosis(
        verdict=word.word,
        summary=' '.join([word.summary, *remarks]),
        findings=tuple(one for one in found if one not in small),
        minor=(*small, *minor),
        where=places or locate_blocked_joints(arm, resting),
        left=left,
        gap=gap,
        explanation=explanation.without_data(),
        arm=plain_arm(patched) if found and not worse else given,
        data=evidence.data,
        not_visible=_not_visible(explanation, found, explainer),
        refitted=explanation.refitted,
        notes=tuple(x for x in (*notes, untested, *of_bodies) if x and x not in remarks),
        baseline=explanation.floor,
        harmful=bool(found and worse),
        doubt=doubt,
        not_repeating=not_repeating,
        contradicted=word.contradicted,
    )


def _with_shares(
    explanation: Explanation, explainer: Explainer
) -> tuple[Explanation, Attribution, Evidence | None]:
    """
    Measure the share of the squared residual that each cause explains.

    Returns
    -------
    explanation : Explanation
        The explanation with the causes of the headline.
    shares : Attribution
        Their shares in held-out recordings, or cross-validated without any.
    unseen : Evidence or None
        Held-out recordings, weighted by the floor of the gap.

    """
    settings, data, unseen = explainer.settings, explainer.held_out, None
    if data:
        noise = tuple(noise_floor(part, explanation.fitted.arm).sigma for part in data)
        sigma = tuple(np.maximum(one, explanation.misfit) for one in noise)
        unseen = Evidence(tuple(data), sigma, noise, explanation.evidence.varies)
    every = explanation.measured or settings.everything
    least = 0.0 if every else settings.thresholds.headline
    explanation, shares = headline(explanation, unseen, least, settings)
    untested = explainer.baseline is not None and bool(explanation.untested)
    whole = shares.share(range(len(explanation.steps)))
    if untested and whole <= settings.thresholds.open_share:
        nothing = explanation.without(*range(len(explanation.steps)))
        explanation, shares = headline(nothing, unseen, least, settings)
    return explanation, shares, unseen


def _not_visible(
    explanation: Explanation, found: Sequence[Finding], explainer: Explainer
) -> tuple[str, ...]:
    """Return the names of effects that the data cannot reveal on any joint."""
    hidden = {name for name, _ in explanation.invisible}
    hidden -= {one.effect.name for one in explanation.candidates}
    hidden -= {finding.name for finding in found}
    if explainer.baseline is None:  # effects fitted with every cause have their own values
        hidden -= {one.name for one in with_friction(explainer.arm, explainer.settings.library)[1]}
    return tuple(kind.name for kind in explainer.settings.kinds if kind.name in hidden)


def _remarks(
    found: Sequence[Finding],
    worse: Sequence[str],
    explanation: Explanation,
    verdict: str,
    doubt: str,
    explainer: Explainer,
    gap: Gap,
) -> list[str]:
    """Return notes: on a model that may be wrong or is not patched, and on unchecked joints."""
    names = ' and '.join(name_in_words(one.name) for one in found)
    hidden = gap.predicted and gap.closed < explainer.settings.thresholds.inexact
    remarks = {
        f'No held-out recording shows {names}; the share is that of the others.': found and hidden,
        f'The model is not patched: {names} would make it worse in {", ".join(worse)}.': worse,
        explanation.untested: verdict == 'unknown',
        doubt: verdict != 'consistent',  # then it precedes the verdict
    }
    then = () if explainer.baseline is None else explainer.baseline.data
    of_data = data_remarks(found, explanation.fitted.arm, explainer.prepared.data, then)
    return [*(text for text, applies in remarks.items() if text and applies), *of_data]


def _bad_data(
    arm: ArmModel, data: Sequence[Trajectory], faults: Sequence[str], notes: Sequence[str]
) -> Diagnosis:
    """Return a diagnosis with the verdict `bad_data`, and the faults as its summary."""
    summary = f'The data cannot be diagnosed: {"; ".join(faults)}.'
    return Diagnosis('bad_data', summary, arm, tuple(data), tuple(notes))
