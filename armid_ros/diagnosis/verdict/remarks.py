# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Warnings and notes that are added to a verdict.

They are warnings that a model may not belong to the arm, because its residual in the baseline is
too large, and notes on joints at rest, on a cold start, and on wear at equal temperature.

"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from armid_ros.arm import ArmModel, Misfit
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import torque_rms
from armid_ros.diagnosis.data.trajectory import trajectories, Trajectory, unchecked_joints
from armid_ros.diagnosis.settings import Thresholds
from armid_ros.diagnosis.verdict.finding import Finding
from armid_ros.diagnosis.verdict.words import Verdict
from armid_ros.effects import CATALOGUE, Effect
from armid_ros.errors import IdentificationError
from armid_ros.estimate import name_in_words
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.identification.rows.temperature import mean_temperatures
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np

#: Smallest difference of two temperatures [K].
_MIN_DIFFERENCE = 2.0


def doubt_of_model(
    arm: ArmModel,
    baseline: Baseline | None,
    recordings: Sequence[Recording],
    misfit: Misfit | None,
    thresholds: Thresholds,
) -> str:
    """
    Return a warning that the given model may be wrong, or an empty string.

    Parameters
    ----------
    arm : ArmModel
        The model.
    baseline : Baseline or None
        Residual of the model in recordings from a time at which the model was right.
    recordings : sequence of Recording
        Recordings of the baseline.
    misfit : Misfit or None
        Misfit of the model when it was identified.
    thresholds : Thresholds
        Factors by which a misfit varies from motion to motion.

    """
    unusable = ''
    if misfit is not None and misfit.unusable:
        unusable = (
            'The model was unusable when it was identified (see its identification.json): its '
            'residual does not measure a change.'
        )
    if baseline is None:
        return unusable
    changed = (
        ''
        if misfit is None
        else _increased_residual(arm, baseline, recordings, misfit, thresholds)
    )
    return changed or _large_residual(arm, baseline) or unusable


def with_doubt(
    verdict: Verdict,
    doubt: str,
    findings: Sequence[Finding],
    arm: ArmModel,
    baseline: Baseline | None,
) -> tuple[Verdict, str]:
    """
    Adapt a verdict to a warning about the given model; return verdict and warning.

    A model with a large residual in the baseline is consistent with any data, so the verdict is
    `bad_data`. With a smaller residual, the warning precedes the sentence of the verdict. A link
    inertia that is named since a baseline is a reason for a warning, as links do not change.

    """
    if verdict.word != 'consistent':
        listed = [one for one in findings if one.name in CATALOGUE]
        links = [one for one in listed if one.joints and CATALOGUE[one.name].traits.corrects]
        if baseline and links and not doubt:
            doubt = (
                'The inertia of a link does not change by itself. Unless the link of '
                f'{" and ".join(links[0].joints)} was exchanged or carries a new part, the true '
                'cause is not in the catalogue and resembles this change.'
            )
        return verdict, doubt
    if baseline and 100.0 * baseline.errors[0] > LIMITS.unusable:
        lead = 'The data cannot be diagnosed: too little signal, or the model of another arm.'
        return Verdict('bad_data', f'{lead} {_large_residual(arm, baseline)}'), ''
    return Verdict(verdict.word, f'{doubt} {verdict.summary}'.lstrip()), doubt


def _increased_residual(
    arm: ArmModel,
    baseline: Baseline,
    recordings: Sequence[Recording],
    misfit: Misfit,
    thresholds: Thresholds,
) -> str:
    """Return a warning if the baseline residual is much larger than after identification."""

    def compared(known: Baseline) -> tuple[FloatArray, FloatArray]:
        times = known.misfit / np.maximum(misfit.of(arm.robot, torque_rms(known.data)), 1e-300)
        most = np.sqrt(thresholds.predicted * thresholds.same_fit * np.maximum(known.varies, 1.0))
        return times, times / most

    times, beyond = compared(baseline)
    if misfit.filters is not None and beyond.max() > 1.0:  # misfit with other filters
        try:
            parts = trajectories(recordings, Conditioning(*misfit.filters), arm)
        except IdentificationError:  # too short for these filters, or sampled more slowly
            return ''
        times, beyond = compared(Baseline.of(arm, parts, np.random.default_rng(0)))
    worst = int(np.argmax(beyond))
    if beyond[worst] <= 1.0:
        return ''
    return (
        f'In the baseline, the residual of {arm.robot.joints[worst]} is {times[worst]:.1f} times '
        'that of the identification. The model was not identified from this baseline, or the arm '
        'had changed before the baseline was recorded.'
    )


def _large_residual(arm: ArmModel, baseline: Baseline) -> str:
    """Return a warning if the baseline residual is a large share of the torque."""
    whole, each = baseline.errors
    rows = [(whole, LIMITS.poor, 'the arm')]
    rows += [(e, LIMITS.unusable, j) for e, j in zip(each.tolist(), arm.robot.joints, strict=True)]
    bad = [
        f'{100.0 * error:.0f} % of the torque of {place}'
        for error, limit, place in sorted(rows, key=lambda row: -row[0])
        if 100.0 * error > limit
    ]
    if not bad:
        return ''
    return (
        f'In the baseline, the residual of the model is {", ".join(bad[:2])}. Check that it is '
        'the model of this arm. Smaller changes are not detectable.'
    )


def data_remarks(
    found: Sequence[Finding], arm: ArmModel, now: Sequence[Trajectory], then: Sequence[Trajectory]
) -> Iterator[str]:
    """
    Yield notes on joints that did not move, and on temperatures of the diagnosed recordings.

    Parameters
    ----------
    found : sequence of Finding
        The findings.
    arm : ArmModel
        The model with the named effects.
    now, then : sequence of Trajectory
        Diagnosed recordings, and baseline recordings; without a baseline, the reference
        temperatures of the model are compared.

    """
    still = ', '.join(unchecked_joints(now, arm.robot.joints))
    if still:
        yield f'Not checked: {still} did not move, or reversed all the time.'
    laws = [own for own in arm.effects if own.lasting]
    today = mean_temperatures([part.motion for part in now])
    if today is None and laws:
        yield (
            f'The temperature was not recorded: {name_in_words(laws[0].name)} is taken at the '
            'reference temperature.'
        )
    before = mean_temperatures([part.motion for part in then])
    if before is None and laws:
        before = laws[0].reference_temperatures
    warmer = {
        joint: mean - before[joint]
        for joint, mean in (today or {}).items()
        if before is not None and joint in before
    }
    if not warmer:
        return
    changes: dict[str, list[str]] = {'colder': [], 'warmer': []}
    for joint, share in _friction_changes(laws, arm, now, warmer).items():
        if abs(warmer[joint]) >= _MIN_DIFFERENCE and abs(share) >= 0.03:  # of friction
            changes['colder' if warmer[joint] < 0.0 else 'warmer'].append(
                f'{joint} by {abs(warmer[joint]):.0f} degC (friction {100.0 * share:+.0f} %)'
            )
    than = 'in the baseline' if then else 'at the reference temperature of the model'
    yield from (
        f'{word.capitalize()} than {than}: {", ".join(joints)}.'
        for word, joints in changes.items()
        if joints
    )
    named = any(CATALOGUE[one.name].lasting for one in found if one.name in CATALOGUE)
    within = max(_temperature_spread(now), _temperature_spread(then))
    # a fifth of the difference within the recordings separates a law of temperature from wear
    if named and within < 0.2 * max(map(abs, warmer.values())):
        yield (
            'The temperature differs from the baseline but hardly changes within the recordings, '
            'so wear of the same size is not excluded: record a range of temperatures.'
        )
    equal = {joint for joint, more in warmer.items() if abs(more) < _MIN_DIFFERENCE}
    yield from _wear(found, equal.union(*(law.joints for law in laws)))


def _wear(found: Sequence[Finding], equal: Collection[str]) -> Iterator[str]:
    """Yield a note on joints of equal temperature whose friction changed: wear."""
    names, where = dict[str, None](), dict[str, None]()
    for one in found:
        kinds = [CATALOGUE[name] for name in (one.name, *one.ambiguous_with) if name in CATALOGUE]
        joints = [joint for joint in one.joints if joint in equal]
        rubs = one.name in CATALOGUE and kinds[0].traits.friction
        if joints and rubs and not any(kind.lasting for kind in kinds):
            names[name_in_words(one.name)] = None
            where |= dict.fromkeys(joints)
    if names:
        text = f'{" and ".join(names)} of {", ".join(where)}'
        yield (
            f'{text[0].upper()}{text[1:]} changed at equal temperature: wear or another grease, '
            'not a cold start.'
        )


def _temperature_spread(data: Sequence[Trajectory]) -> float:
    """Return the largest standard deviation of a joint temperature over recordings [K]."""
    found = [part.motion.temperature.at(part.t) for part in data if part.motion.temperature]
    return float(np.nanmax(np.concatenate(found).std(axis=0))) if found else 0.0


def _friction_changes(
    laws: Sequence[Effect],
    arm: ArmModel,
    now: Sequence[Trajectory],
    warmer: dict[str, float],
) -> dict[str, float]:
    """Return the relative friction changes that temperature laws predict, at mean speed."""
    action, joints = arm.action(), arm.robot.joints
    speed = np.concatenate([np.abs(part.at_rows.dq) for part in now]).mean(axis=0)
    size = np.zeros(len(joints))
    if action.damping is not None:
        size += np.diag(action.damping) * speed
    if action.dry_friction is not None:
        size += action.dry_friction.largest(np.zeros(len(joints)))
    shares = dict.fromkeys(warmer, 0.0)
    for law in laws:
        for joint, slopes in zip(law.joints, arm.values_of(law).reshape(-1, 2), strict=True):
            k = joints.index(joint)
            if joint in warmer and size[k] > 0.0:
                change = slopes[0] * speed[k] + slopes[1]
                shares[joint] += warmer[joint] * float(change) / float(size[k])
    return shares
