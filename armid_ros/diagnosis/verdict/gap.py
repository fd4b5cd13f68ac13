# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The gap between model and measurement, before and after, and what holds a joint that is at rest.

No patch makes a model worse: in no joint, in the data it was found in or in others, may the
residual of the patched model exceed that of the given one by more than blocks of the data differ,
unless it is no gap.

Dry friction holds a joint at rest or in a reversal with any torque up to its own, so that such
rows do not determine a model, and with no more than that. A residual beyond it comes from a stop,
a brake, or a contact.

"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import Evidence, NoiseFloor
from armid_ros.diagnosis.data.trajectory import at_rest, REST_TIME, Trajectory
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.settings import DiagnosisSettings, Thresholds
from armid_ros.diagnosis.verdict.finding import Gap, Overlay
from armid_ros.diagnosis.verdict.where import Excess, Where
from armid_ros.diagnosis.verdict.words import Hiding
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy.ndimage import uniform_filter1d

#: A joint has a gap where its squares exceed the floor by this share of it.
_A_GAP = 0.2
#: Increase of the squares of a joint, as a share, that does not count as worse.
_SLIGHTLY = 0.05
#: Multiple of dry friction by which a joint at rest may be held: twice that of motion until it
#: breaks away, and once that of the model, whose direction is arbitrary at rest.
_HELD = 3.0
#: A person who leans on an arm, or a contact in passing, lasts as long [s].
_SECOND = 1.0
#: Share of the rows of such a time that have to say something.
_TELLING = 0.25
#: From so many recordings on, slow differences of periods that are small in each are tested in
#: their mean.
_SEVERAL = 3
#: What has nearly all of its squares in this share of the seconds, at the most, comes and goes.
_NEARLY, _SOME = 0.95, 0.5
#: Words for a joint that is held, for a table, and for the beginning and the end of a sentence.
_WHERE = 'at rest or turning round, and more than friction: a stop, a brake or a contact'
_TURNING = 'where it stands still or turns round'
_BESIDE = ' beside friction: a stop, a brake or a contact does that'


def measure_gap(explanation: Explanation, unseen: Evidence | None) -> Gap:
    """
    Measure the gap on held-out data, or on the fitted data if there are none.

    Parameters
    ----------
    explanation : Explanation
        The names, fitted.
    unseen : Evidence or None
        Held-out data; their unit is the residual of a perfect model.

    """
    before, after = explanation.reference.arm, explanation.fitted.arm
    evidence = explanation.evidence if unseen is None else unseen
    overlays = [
        _overlay(part, sigma, before, after)
        for part, sigma in zip(evidence.data, evidence.sigma, strict=True)
    ]
    residuals = [
        [o.measured - o.before for o in overlays],
        [o.measured - o.after for o in overlays],
    ]
    power = [evidence.power(rows) for rows in residuals]
    floor = evidence.power([np.broadcast_to(o.sigma, o.measured.shape) for o in overlays])
    beyond = [np.maximum(own - floor, 0.0) / np.maximum(floor, 1e-24) for own in power]
    gap = beyond[0] > _A_GAP
    closed = 1.0 - beyond[1][gap].sum() / beyond[0][gap].sum() if gap.any() else 0.0
    return Gap(
        np.sqrt(power[0]),
        np.sqrt(power[1]),
        np.sqrt(floor),
        evidence.chi2_per_row(residuals[0]),
        float(np.clip(closed, 0.0, 1.0)),
        unseen is not None,
        tuple(overlays),
    )


def _overlay(part: Trajectory, sigma: FloatArray, before: ArmModel, after: ArmModel) -> Overlay:
    measured = part.torque
    without, patched = part.residual(before), part.residual(after)
    return Overlay(part.source, part, measured, measured - without, measured - patched, sigma)


def harmed(
    explanation: Explanation, unseen: Evidence | None, settings: DiagnosisSettings
) -> tuple[str, ...]:
    """Return the joints in which the patched model is worse than the given one."""
    if not explanation.steps:
        return ()
    before, after = explanation.given, explanation.fitted.arm
    sets = [explanation.evidence, *([] if unseen is None else [unseen])]
    worse = np.any([_worse(before, after, evidence, settings) for evidence in sets], axis=0)
    return tuple(j for j, bad in zip(before.robot.joints, worse, strict=True) if bad)


def _worse(
    before: ArmModel, after: ArmModel, evidence: Evidence, settings: DiagnosisSettings
) -> npt.NDArray[np.bool_]:
    residuals = [evidence.residuals(arm) for arm in (before, after)]
    had, has = (evidence.block_squares(rows) for rows in residuals)
    more = has - had
    spread = more.std(axis=0, ddof=1) * np.sqrt(len(more))
    total = more.sum(axis=0)
    floor = np.maximum(had.sum(axis=0), evidence.count)
    gap = evidence.chi2_per_row(residuals[1]) > evidence.as_good(settings) + evidence.matters(
        settings
    )
    surely = (total > settings.thresholds.surely * spread) & (total > _SLIGHTLY * floor)
    by_far = total > (settings.thresholds.same_fit - 1.0) * floor
    return np.asarray((surely | by_far) & gap)


def excess_of(
    residual: Sequence[FloatArray],
    evidence: Evidence,
    settings: DiagnosisSettings,
    more: float = 1.0,
    where: str = 'the recordings',
) -> Excess:
    """Return the loss of a residual over so many times the limit up to which it is no gap."""
    ratio = evidence.chi2_per_row(residual) / evidence.limits(residual, settings) / more
    worst = int(np.argmax(ratio))
    return Excess(ratio, f'in {where}', _at_times(evidence, residual, worst))


def _at_times(evidence: Evidence, residual: Sequence[FloatArray], joint: int) -> str:
    """Say in which seconds of those in which a joint moves nearly all of a residual is, or ''."""
    each: list[tuple[float, str]] = []
    for part, own, unit in zip(evidence.data, residual, evidence.sigma, strict=True):
        means, rows = _seconds(part, own, unit)
        middles = range(rows // 2, len(means), rows)
        each += [
            (float(means[k, joint]), _time(part, k)) for k in middles if means[k, joint] > 0.0
        ]
    each.sort(reverse=True)
    squares = np.cumsum([mean for mean, _ in each])
    count = int(np.sum(squares < _NEARLY * squares[-1:])) + 1
    if count > _SOME * len(each):
        return ''
    moves = f'{count} of the {len(each)} seconds in which it moves'
    return f', nearly all of it in {moves}, the worst at {each[0][1]}'


def held(
    arm: ArmModel,
    evidence: Evidence,
    before: Baseline | None,
    given: ArmModel,
    settings: DiagnosisSettings,
) -> Excess:
    """
    Return by how much joints at rest or in a reversal are held by more than friction.

    Parameters
    ----------
    arm : ArmModel
        The patched model.
    evidence : Evidence
        The data.
    before : Baseline or None
        Recordings from when nothing was wrong, of the given model: what held a joint then, such as
        a brake, still does.
    given : ArmModel
        The given model.
    settings : DiagnosisSettings
        Thresholds.

    """
    residual = evidence.residuals(arm)
    surely = settings.thresholds.surely
    excess = standing(arm, evidence, residual, surely)
    if before is not None:
        unit = (before.misfit,) * len(before.data)
        then = standing(given, Evidence(before.data, unit, unit), before.residual, surely)
        excess = excess / np.maximum(settings.thresholds.same_fit * then, 1.0)
    return Excess(excess, _TURNING, _BESIDE)


def for_a_second(
    left: Sequence[FloatArray],
    evidence: Evidence,
    before: Baseline,
    given: ArmModel,
    settings: DiagnosisSettings,
) -> Excess:
    """
    Return the most that any second leaves over the most that it may.

    What comes and goes is little of a whole recording. Squares may be larger on motions that were
    not used, and by as much again in the worst second of such a motion. What a model has more than
    the given one is not exact to less than a share (`inexact`) of its squares.

    """
    thresholds = settings.thresholds
    most = thresholds.other_motion * thresholds.predicted
    then, _ = _worst_second(before.data, before.residual, (before.misfit,) * len(before.data))
    now, times = _worst_second(evidence.data, left, evidence.sigma)
    pairs = zip(evidence.residuals(given), left, strict=True)
    made, _ = _worst_second(evidence.data, [had - has for had, has in pairs], evidence.sigma)
    limit = np.where(then > 0.0, most * then, np.inf) + evidence.matters(settings)
    ratio = now / (limit + thresholds.inexact * made)
    return Excess(ratio, f'in the second at {times[int(np.argmax(ratio))]}')


def _worst_second(
    data: Sequence[Trajectory], residual: Sequence[FloatArray], sigma: Sequence[FloatArray]
) -> tuple[FloatArray, list[str]]:
    """Return the largest mean square of any second over the unit, (n,), and its middle."""
    worst = np.zeros(residual[0].shape[1])
    times = [''] * len(worst)
    for part, own, unit in zip(data, residual, sigma, strict=True):
        means, _ = _seconds(part, own, unit)
        at, largest = means.argmax(axis=0), means.max(axis=0)
        for joint in np.flatnonzero(largest > worst):
            times[joint] = _time(part, int(at[joint]))
        worst = np.maximum(worst, largest)
    return worst, times


def _seconds(part: Trajectory, own: FloatArray, unit: FloatArray) -> tuple[FloatArray, int]:
    """Return the mean square over the unit of the second around each row, and its rows."""
    rows = max(round(_SECOND / float(part.t[1] - part.t[0])), 1)
    told = part.informative.astype(float)
    share, squares = (
        uniform_filter1d(x, rows, axis=0, mode='constant')
        for x in (told, told * (own / unit) ** 2)
    )
    return np.where(share > _TELLING, squares / np.maximum(share, _TELLING), 0.0), rows


def _time(part: Trajectory, row: int) -> str:
    """Return the time of a row, in words."""
    return f'{part.t[row]:.1f} s of {Path(part.source).name}'


def places_held(arm: ArmModel, excesses: Sequence[Excess]) -> tuple[Where, ...]:
    """Return the joints that are held, the worst first."""
    excess = np.max([np.zeros(arm.robot.n_joints), *(one.ratio for one in excesses)], axis=0)
    beyond = np.where(excess > 1.0, excess, 0.0)
    order = np.argsort(-beyond)[: np.count_nonzero(beyond)]
    whole = float(beyond.sum())
    return tuple(
        Where(arm.robot.joints[j], float(beyond[j]) / whole, _WHERE, (), arm.robot.torque_units[j])
        for j in order.tolist()
    )


def standing(
    arm: ArmModel, evidence: Evidence, residual: Sequence[FloatArray], surely: float
) -> FloatArray:
    """
    Return the ratio of the residual to friction at rest and in reversals, squared, (n,).

    So many units of noise and misfit (`surely`) are added to friction, in proportion to the torque
    that the model predicts: a joint accelerates most in a reversal, and the error of a model grows
    with its torque. The residual is averaged over the time of the filter of positions, over which
    its response to a jerk cancels, and over no less than a rest lasts, as what is shorter may be
    chance. Zero where friction is not exceeded, and where no dry friction is known.

    """
    friction = arm.action().dry_friction
    joints = arm.robot.n_joints
    if friction is None:
        return np.zeros(joints)
    squares, time = np.zeros((2, joints))
    usual = np.maximum(evidence.torque_rms, 1e-300)
    for part, own, sigma in zip(evidence.data, residual, evidence.sigma, strict=True):
        most = _HELD * friction.largest(arm.load(part.at_rows))
        louder = np.maximum(np.abs(part.torque - own) / usual, 1.0)
        period = float(part.t[1] - part.t[0])
        shortest = max(REST_TIME, 1.0 / part.used.cutoff_hz)
        lasting = uniform_filter1d(own, max(round(shortest / period), 1), axis=0)
        beyond = (lasting / (most + surely * sigma * louder)) ** 2
        more = ~part.informative & (most > 0.0) & (beyond > 1.0)
        time += period * more.sum(axis=0)
        squares += period * np.sum(beyond, axis=0, where=more)
    return np.where(time > REST_TIME, squares / np.maximum(time, 1e-300), 0.0)


def hiding(explanation: Explanation, settings: DiagnosisSettings) -> Hiding:
    """Return how much may change beside a misfit before what is left is a gap."""
    evidence = explanation.evidence
    limits = evidence.limits(explanation.residual, settings) * settings.thresholds.predicted
    misfit = np.sqrt(np.mean([own**2 for own in evidence.sigma], axis=0))
    still = at_rest(evidence.data, explanation.given.robot.joints)
    asked = (evidence.count > 0) & ~np.isin(explanation.given.robot.joints, still)
    share = np.where(asked, misfit / np.maximum(evidence.torque_rms, 1e-300), 0.0)
    return Hiding(share, np.sqrt(np.maximum(limits - 1.0, 0.0)) * share)


def blind_joints(
    evidence: Evidence, joints: Sequence[str], hides: Hiding | None
) -> tuple[str, ...]:
    """Return joints that move and show nothing: no row counts, or their whole torque may hide."""
    hidden = evidence.count == 0 if hides is None else (evidence.count == 0) | (hides.change > 1.0)
    still = at_rest(evidence.data, joints)
    return tuple(j for j, one in zip(joints, hidden, strict=True) if one and j not in still)


def not_repeating(
    floors: Sequence[NoiseFloor], arm: ArmModel, thresholds: Thresholds, least: FloatArray
) -> list[str]:
    """
    Return the joints that differ between equal periods, slowly and by as much as matters.

    Parameters
    ----------
    floors : sequence of NoiseFloor
        Noise of the recordings.
    arm : ArmModel
        Gives the joints.
    thresholds : Thresholds
        From which power at low frequency, over that at high frequency, periods do not repeat.
    least : ndarray, shape (n,)
        Torque of each joint that matters [N m].

    """
    known = [
        np.where(floor.slow > least, floor.structure, 1.0)
        for floor in floors
        if floor.period is not None
    ]
    if not known:
        return []
    odd_ones = [structure >= thresholds.one_period for structure in known]
    often = np.sum(odd_ones, axis=0) >= max(1, len(known) / 2)
    if len(known) >= _SEVERAL:
        mean = np.exp(np.mean(np.log(known), axis=0))
        often = often | (mean > thresholds.one_period_on_average)
    return [joint for joint, odd in zip(arm.robot.joints, often, strict=True) if odd]
