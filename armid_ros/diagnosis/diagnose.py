# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The diagnosis: from recordings and a model to a verdict.

The model is tried as given, with single causes added (which shows errors of the description), and
with its rigid body and known effects fitted anew, where only its structure counts.

"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel, Misfit
from armid_ros.arm.memoized_arm import memoized_arm, plain_arm
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import Evidence, noise_floor, torque_rms
from armid_ros.diagnosis.data.trajectory import at_rest, trajectories, Trajectory
from armid_ros.diagnosis.doubt import doubt_as_it_is, doubt_of, doubt_of_names
from armid_ros.diagnosis.prepare import choose_filters, mended, prepare, Prepared
from armid_ros.diagnosis.search.choice import Explainer
from armid_ros.diagnosis.search.explanation import as_bodies, Chosen, Explanation, NOISE
from armid_ros.diagnosis.search.spans import acting_spans, Span
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.diagnosis.ties.ties import diagnose_ties
from armid_ros.diagnosis.verdict.attribution import Names
from armid_ros.diagnosis.verdict.finding import Diagnosis, Finding
from armid_ros.diagnosis.verdict.gap import (
    blind_joints,
    hiding,
    measure_gap,
    not_repeating,
    places_held,
)
from armid_ros.diagnosis.verdict.naming import findings, not_named
from armid_ros.diagnosis.verdict.remaining_misfit import RemainingMisfit
from armid_ros.diagnosis.verdict.where import Excess, where_it_is, where_left
from armid_ros.diagnosis.verdict.words import decide, Verdict
from armid_ros.errors import IdentificationError
from armid_ros.identification.assess.data_faults import check_data, mistaken_recordings
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt

#: Verdicts by which a gap stays open.
OPEN = ('unknown', 'partial')
#: Called with the share that is done and what is being done.
Progress = Callable[[float, str], None]

#: Note where no two equal periods measure the noise.
_ASSUMED = (
    'nothing repeats in some recordings: their noise is assumed from what rows differ by from '
    'their neighbours; two equal periods would measure it'
)
#: Fault where predicting no torque at all would be better.
_NO_MODEL = (
    'the model leaves {:.3g} times the torque of the baseline itself, more than no model would: '
    'it is that of another arm, or has other units; identify the arm from the baseline, and give '
    'that model'
)
#: Time by which the beginning and the end of a span are uncertain [s].
_UNSURE = 0.25
#: Note where shares and gap are of the data that names were found in, though others were given.
_HARDLY_SHOWN = (
    'the recordings to validate hardly show what is named: gap and shares are of the recordings '
    'that it was found in; validate with a motion that shows it'
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
    Find what a model lacks.

    Parameters
    ----------
    arm : ArmModel
        The given model: rigid body, gravity, known effects with values.
    recordings : sequence of Recording
        The recordings in question, with torques; several motions are best.
    validate : sequence of Recording
        Recordings that are predicted and not fitted.
    baseline : sequence of Recording
        Recordings from when nothing was wrong, such as those the model was identified from: their
        residual is the model's own misfit, and the diagnosis asks what has changed since.
    misfit : Misfit, optional
        Misfit of the model when it was identified. A baseline measures it, and is doubted where
        the model leaves much more of it.
    settings : DiagnosisSettings, optional
        Library and thresholds.
    rng : numpy.random.Generator
        Draws the states over which base parameters are found, and resamplings of the data.
    progress : callable, optional
        Called with the share that is done and what is being done.

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
    if settings.everything:
        result = diagnose(
            arm,
            recordings,
            validate=validate,
            baseline=baseline,
            misfit=misfit,
            settings=settings.without_small_print(),
            rng=rng,
            progress=tell,
        )
        large = tuple(one for one in result.findings if one.share >= settings.thresholds.headline)
        small = tuple(one for one in result.findings if one.share < settings.thresholds.headline)
        return replace(result, findings=large, minor=(*small, *result.minor))
    tell(0.02, 'filtering')
    given, arm = arm, memoized_arm(arm)
    recordings, validate, baseline, repairs = mended(recordings, validate, baseline, settings)
    used = choose_filters(arm, recordings, baseline, settings, rng.spawn(1)[0])
    data: Sequence[Trajectory] = trajectories(recordings, used, arm)
    stretches = [part.stretch for part in data]
    faults, notes = check_data(arm, recordings, used, stretches, baseline)
    notes += repairs
    if faults:
        return _bad(given, data, faults, notes)
    notes += [f'prior knowledge given: {name} {how}' for name, how in settings.prior.items()]
    tell(0.1, 'noise floor')
    by_misfit = bool(baseline) and settings.partner is None
    prepared = prepare(arm, recordings, used, data, settings, rng, by_misfit)
    if any(floor.period is None for floor in prepared.floors):
        notes.append(_ASSUMED)
    before = trajectories(baseline, prepared.used, arm, prepared.allowed)
    known = Baseline.of(arm, before, rng) if baseline else None
    if known is not None and known.errors[0] > 1.0:
        return _bad(given, data, [_NO_MODEL.format(known.errors[0])], notes)
    doubt = doubt_of(given, known, baseline, misfit, settings.thresholds)
    asked = _Request(arm, given, prepared, known, doubt, validate, settings, rng, tell)
    if settings.partner is not None:
        tell(0.2, f'ties to {settings.partner.source}')
        found = diagnose_ties(arm, recordings, prepared, settings, rng, tell)
        if found is not None:
            return _said(found, notes, asked)
    chosen = _explainer(asked, misfit).chosen()
    result = _said(chosen, notes, asked)
    within = _within(result, chosen, asked, recordings, baseline, misfit)
    if within is not None:
        return within
    return _each_alone(result, ([*recordings, *validate], baseline), used, asked)


def _hardly_explained(result: Diagnosis, settings: DiagnosisSettings) -> bool:
    """Return whether nothing is named, a gap is open, or names take less than half of it."""
    largest = max((one.share for one in result.findings), default=0.0)
    return result.verdict in OPEN or largest <= settings.thresholds.open_share


def _within(
    result: Diagnosis,
    chosen: Chosen,
    asked: _Request,
    recordings: Sequence[Recording],
    baseline: Sequence[Recording],
    misfit: Misfit | None,
) -> Diagnosis | None:
    """Diagnose the seconds in which a cause acts alone; None if that explains no more."""
    settings, look = asked.settings, chosen.look
    if not settings.spans or look is None or not _hardly_explained(result, settings):
        return None
    spans = acting_spans(look, settings.thresholds)
    cut = [_cut(*each) for each in zip(spans, [*recordings, *asked.validate], strict=False)]
    shorter, unseen = (
        [one for one in part if one is not None]
        for part in (cut[: len(recordings)], cut[len(recordings) :])
    )
    if not shorter or all(one.whole for one in spans):
        return None
    try:
        found = diagnose(
            asked.given,
            shorter,
            validate=unseen,
            baseline=baseline,
            misfit=misfit,
            settings=replace(settings, spans=False),
            rng=asked.rng,
            progress=asked.tell,
        )
    except IdentificationError:  # too short for the filters, or without motion
        return None
    if _hardly_explained(found, settings):
        return None
    return found.acting_in([one for one in spans if one.stop > one.start])


def _cut(span: Span, recording: Recording) -> Recording | None:
    """Return the part of a recording in which a cause acts."""
    if span.whole:
        return recording
    inside = recording.t >= span.start + _UNSURE, recording.t <= span.stop - _UNSURE
    return recording.select(inside[0] & inside[1]) if span.stop > span.start else None


def _explainer(asked: _Request, misfit: Misfit | None) -> Explainer:
    arm, prepared, known = asked.arm, asked.prepared, asked.before
    written = None if misfit is None else misfit.of(arm.robot, torque_rms(prepared.data))
    seen = trajectories(asked.validate, prepared.used, arm, prepared.allowed) if known else ()
    information = None if misfit is None else misfit.information
    own = arm, prepared, known, asked.rng, asked.tell, asked.settings
    return Explainer(*own, written, seen, information)


def _each_alone(
    result: Diagnosis, days: Iterable[Sequence[Recording]], used: Conditioning, asked: _Request
) -> Diagnosis:
    """Return a result, or that single recordings are at fault, where something stays open."""
    open_or_doubted = result.verdict in OPEN or bool(result.doubt)
    if not open_or_doubted or asked.settings.partner is not None:
        return result
    apart = [one for day in days for one in _apart(asked.arm, day, used)]
    alone = mistaken_recordings(asked.arm, apart, used)
    return _bad(asked.given, result.data, alone, result.notes) if alone else result


def _apart(
    arm: ArmModel, day: Sequence[Recording], used: Conditioning
) -> Iterator[tuple[Recording, npt.NDArray[np.bool_]]]:
    """Yield recordings, and in which joints a model is unusable there and not in all of a day."""
    unit = np.ones(arm.robot.n_joints)
    bad, sound = np.zeros((2, len(day), len(unit)), dtype=bool)
    for k, one in enumerate(day):
        parts = trajectories([one], used, arm)
        rows = Evidence.over_noise(parts, [unit] * len(parts))
        bad[k] = 100.0 * rows.relative_errors(rows.residuals(arm)) > LIMITS.unusable
        sound[k] = (rows.count > 0.0) & ~bad[k]
    for one, own in zip(day, bad & sound.any(axis=0), strict=True):
        if own.any():
            yield one, own


@dataclass(frozen=True)
class _Request:
    """The parameters of `diagnose`; `given` is its arm, `arm` the same memoized."""

    arm: ArmModel
    given: ArmModel
    prepared: Prepared
    before: Baseline | None
    doubt: str
    validate: Sequence[Recording]
    settings: DiagnosisSettings
    rng: np.random.Generator
    tell: Progress

    def doubting(
        self, found: Sequence[Finding], as_it_is: Excess | None, floor_in_words: str
    ) -> _Request:
        """Return the same, with a doubt of what was named, or of the model where nothing was."""
        doubt = self.doubt or (doubt_of_names(found) if self.before else '')
        if not (doubt or as_it_is is None):
            doubt = doubt_as_it_is(as_it_is.ratio, self.arm.robot, floor_in_words)
        return replace(self, doubt=doubt)


def _said(chosen: Chosen, notes: Sequence[str], asked: _Request) -> Diagnosis:
    """Return the diagnosis of an explanation, measured on held-out data."""
    arm, settings = asked.arm, asked.settings
    asked.tell(0.85, 'held-out gap')
    explanation, said = as_bodies(chosen.explanation)
    notes = [*notes, *chosen.notes, *(said if explanation.steps else ())]
    evidence = explanation.evidence
    unseen = _unseen(asked, explanation, chosen)
    names = Names.of(replace(chosen, explanation=explanation), unseen, settings)
    measured = RemainingMisfit(chosen, unseen, asked.before, arm, settings)
    if _mostly_open(names, measured, chosen, settings):
        names = names.with_nothing_named(unseen, settings)
    hardly = unseen is not None and not names.shares.predicted
    explanation, notes = names.explanation, [*notes, *names.notes, *[_HARDLY_SHOWN] * hardly]
    found = findings(explanation, names.shares, arm, asked.rng)
    as_it_is = measured.patched(explanation) if found else measured.as_it_is(explanation)
    worse = measured.harmed(explanation)
    floors = tuple(noise_floor(part, explanation.fitted.arm) for part in evidence.data)
    left, resting = measured.beside(explanation), measured.resting(explanation)
    open_gap = any(one.ratio.max() > 1.0 for one in (*left, *resting))
    asked = asked.doubting(found, None if open_gap else as_it_is, chosen.floor_in_words)
    unnamed, matters = not_named(explanation, arm), settings.material * evidence.torque_rms
    hides = None if chosen.measured else hiding(explanation, settings)
    blind = blind_joints(evidence, arm.robot.joints, hides)
    word = decide(
        found,
        not_repeating(floors, arm, settings.thresholds, matters) if chosen.measured else (),
        [*left, *resting],
        arm,
        NOISE if chosen.measured else chosen.floor_in_words,
        as_it_is,
        unnamed,
        hides,
    )
    remarks = _unpatched(found, worse)
    if not found:
        explanation = replace(explanation, reference=explanation.fitted)
    shown, open_in = unseen if names.shares.predicted else None, measured.shown_in(left, evidence)
    places = where_it_is(explanation, (shown or evidence) if found else open_in, settings)
    asked.tell(1.0, word.word)
    return Diagnosis(
        verdict=word.word,
        summary=' '.join([word.summary, *remarks, *_doubts(asked, chosen, word, blind)]),
        findings=found,
        minor=tuple(unnamed.minor),
        where=places or places_held(arm, resting),
        left=where_left(explanation, explanation.fitted.arm, open_in, settings),
        gap=measure_gap(explanation, shown),
        explanation=explanation.forgetting(),
        arm=plain_arm(explanation.fitted.arm) if found and not worse else asked.given,
        data=tuple(evidence.data),
        floors=floors,
        not_visible=_not_visible(explanation, settings),
        refitted=explanation.refitted,
        notes=tuple(notes),
        baseline=chosen.floor_in_words,
        harmful=bool(found and worse),
        doubt=asked.doubt,
        suspected=tuple(unnamed.suspected),
        blind=blind,
    )


def _mostly_open(
    names: Names, measured: RemainingMisfit, chosen: Chosen, settings: DiagnosisSettings
) -> bool:
    """
    Return whether names take less than half of a gap, so that what is there is none of them.

    That counts where the rest is a gap, or where recordings do not separate a change from another
    motion's misfit.

    """
    if not names.explanation.steps or names.share > settings.thresholds.open_share:
        return False
    if chosen.untested:
        return names.largest_share <= settings.thresholds.open_share
    return max(float(one.ratio.max()) for one in measured.beside(names.explanation)) > 1.0


def _unpatched(found: Sequence[Finding], worse: Sequence[str]) -> list[str]:
    """Say why a model is not patched, if it is not."""
    if not worse:
        return []
    names = ' and '.join(one.name.replace('_', ' ') for one in found)
    return [f'The model is not patched: {names} would make it worse in {", ".join(worse)}.']


def _doubts(asked: _Request, chosen: Chosen, verdict: Verdict, blind: Sequence[str]) -> list[str]:
    """Say what would tell a change from a misfit, why a model may be wrong, what is not seen."""
    remedy = chosen.untested if verdict.word == 'unknown' else ''
    still = ', '.join(at_rest(asked.prepared.data, asked.arm.robot.joints))
    not_checked = f'Not checked: {still} did not move.' if still else ''
    short = (
        f'Not checked: a change of all of the torque of {", ".join(blind)} would not show.'
        if blind
        else ''
    )
    return [text for text in (remedy, asked.doubt, not_checked, short) if text]


def _unseen(asked: _Request, explanation: Explanation, chosen: Chosen) -> Evidence | None:
    """Return the recordings to validate, which are only predicted, in the unit of the gap."""
    if not asked.validate:
        return None
    prepared = asked.prepared
    data = trajectories(asked.validate, prepared.used, explanation.fitted.arm, prepared.allowed)
    noise = [noise_floor(part, explanation.fitted.arm).sigma for part in data]
    sigma = [np.maximum(one, chosen.misfit) for one in noise]
    return Evidence(tuple(data), tuple(sigma), tuple(noise), explanation.evidence.varies)


def _not_visible(chosen: Explanation, settings: DiagnosisSettings) -> tuple[str, ...]:
    names = [kind.name for kind in settings.kinds]
    hidden = chosen.survey.hidden if chosen.survey is not None else frozenset()
    return tuple(name for name in names if name in hidden)


def _bad(
    arm: ArmModel, data: Sequence[Trajectory], faults: Sequence[str], notes: Sequence[str]
) -> Diagnosis:
    return Diagnosis(
        verdict='bad_data',
        summary=f'The data cannot be diagnosed: {"; ".join(faults)}.',
        findings=(),
        minor=(),
        where=(),
        left=(),
        gap=None,
        explanation=None,
        arm=arm,
        data=tuple(data),
        floors=(),
        not_visible=(),
        refitted=False,
        notes=tuple(notes),
        baseline='',
    )


def _silent(share: float, what: str) -> None:
    """Report no progress."""
