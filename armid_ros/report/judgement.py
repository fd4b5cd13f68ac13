# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sentences on an identification: findings, limitations and next steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.estimate import name_in_words
from armid_ros.identification import Fit, Identification, Score, Verification
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.fitting.identifiability import excludes_zero
from armid_ros.recording import Recording
from armid_ros.report.notation import counted, digits, plain, sentence
from armid_ros.report.parameter_tables import not_as_described
from armid_ros.report.statistics import MIN_TREND_SHARE, trends_of, Whiteness
import numpy as np

#: Condition numbers: an excitation is good below the first (Presse and Gautier 1993), and weak
#: above the second.
GOOD_CONDITION, WEAK_CONDITION = 100.0, 1000.0
#: Next step with a good model.
USE = 'Use model.yaml for simulation and control, in the range of the recorded motions.'
#: A limitation and its remedy; one of them may be empty.
Caution = tuple[str, str]


def judge(
    result: Identification,
    validation: Mapping[str, Sequence[Fit]],
    recordings: Sequence[Recording],
    verification: Verification | None = None,
    unusable: bool = False,
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """
    Return sentences on the limitations of an identification, and on next steps.

    Parameters
    ----------
    result : Identification
        The identified model.
    validation : mapping of str to sequence of Fit
        Predictions of held-out recordings.
    recordings : sequence of Recording
        Recordings, for the damage that their reader reports.
    verification : Verification, optional
        Test for encoder noise, and simulations.
    unusable : bool
        Whether the grade is unusable.

    """
    training = Score.of(result.training)
    fits = [fit for part in validation.values() for fit in part]
    held_out = Score.of(fits) if fits else None
    worst = float(training.joint_relative_error_percent.max())
    misfits = unusable and worst > LIMITS.unusable  # more data do not help
    findings: list[Caution] = [
        *(
            (f'{recording.source or "A recording"}: {recording.report.describe()}', '')
            for recording in recordings
            if not recording.report.unharmed
        ),
        *_of_errors(result, training, held_out, misfits),
        *_of_residuals(result, fits or result.training),
        *([] if verification is None else _of_verification(verification, misfits)),
        *((sentence(note), '') for note in result.notes),
    ]
    steps = [step for _, step in findings if step]
    if held_out is not None and not steps:
        steps = [USE]
    return tuple(text for text, _ in findings if text), tuple(dict.fromkeys(steps))


def findings_of(
    result: Identification, description: ArmModel, verification: Verification | None
) -> Iterator[str]:
    """Yield sentences on the identified parameters, and on the position error in simulation."""
    unlike = not_as_described(result, description)
    joints = [joint for joint, (differ, _) in unlike.items() if differ]
    if joints:
        differ, compared = (sum(numbers) for numbers in zip(*unlike.values(), strict=True))
        yield (
            f'{differ} of {compared} rigid-body parameters of the URDF are outside their 95 % '
            f'intervals, at {", ".join(joints)}. Chance alone gives 5 %.'
        )
    robot = result.arm.robot
    effects = [name_in_words(effect.name) for effect in result.arm.effects]
    time = sum(float(fit.motion.t[-1] - fit.motion.t[0]) for fit in result.training)
    count = counted(result.base.rank, 'parameter')
    if result.base.rank < result.theory.rank:
        count = f'{result.base.rank} of the {counted(result.theory.rank, "parameter")}'
    yield (
        f'{count} of {robot.name} '
        f'({counted(robot.n_joints, "joint")}; rigid body'
        + ''.join(f', {effect}' for effect in effects)
        + f') identified from {time:.0f} s of motion.'
    )
    if verification is not None and verification.forward:
        worst = max(verification.forward, key=lambda pair: float(pair.after.position_error.max()))
        before = '' if worst.before is None else f' (links as described: {worst.before.worst})'
        yield (
            'Driven by the recorded torques, the identified arm has a position error of at most '
            f'{worst.after.worst} rms{before}.'
        )


def _of_errors(
    result: Identification, training: Score, held_out: Score | None, misfits: bool
) -> Iterator[Caution]:
    """Yield limitations and remedies that follow from training and held-out torque errors."""
    if misfits:
        yield (
            '',
            'Check names, signs and units of the joints with armid inspect. If they are right, '
            'the model lacks an effect.',
        )
    elif held_out is None:
        yield (
            '',
            'Record another motion of armid excite, and test the model on it with --validate.',
        )
    else:
        # the same residual is a larger share of a smaller torque
        stronger = np.linalg.norm(held_out.torque_rms) / np.linalg.norm(training.torque_rms)
        ratio = held_out.relative_error_percent / max(training.relative_error_percent, 1e-9)
        ratio *= min(float(stronger), 1.0)
        if ratio > 1.3:  # the model is fitted to the noise
            yield (
                f'The residual on recordings not used for the fit is {digits(ratio)} times that '
                'of the fit: the model overfits, these motions leave the range of the '
                'training data, or the arm has changed.',
                'Train on more recordings, over all poses and speeds that matter. If the arm '
                'may have changed, run armid diagnose.',
            )
    errors = (held_out or training).joint_relative_error_percent
    joints = result.arm.robot.joints
    bad = [(joint, e) for joint, e in zip(joints, errors, strict=True) if e > LIMITS.poor]
    if bad:
        yield (
            'Poorly predicted: ' + ', '.join(f'{j} ({digits(e)} %)' for j, e in bad) + '.',
            f'Compare the residual of {", ".join(joint for joint, _ in bad)} with its torque '
            'noise, and run armid diagnose.',
        )


def residual_trends(joints: Sequence[str], fits: Sequence[Fit]) -> tuple[str, ...]:
    """Return a sentence on joints whose residual depends on speed, position or load."""
    depends: dict[str, list[str]] = {}
    errors = Score.of(fits).joint_relative_error_percent
    least = 100.0 * DiagnosisSettings.material
    matters = [(joint, name) for joint, name in enumerate(joints) if errors[joint] >= least]
    for joint, name in matters:
        for key, trend in trends_of(fits, joint).items():
            if trend.share > MIN_TREND_SHARE:
                depends.setdefault(key, []).append(name)
    parts = [
        f'{key} ({", ".join(names) if len(names) <= 3 else f"{len(names)} joints"})'
        for key, names in depends.items()
    ]
    text = f'The residual depends on {", ".join(parts)}: the model lacks an effect.'
    return (text,) if parts else ()


def _of_residuals(result: Identification, fits: Sequence[Fit]) -> Iterator[Caution]:
    """Yield limitations and remedies that follow from residuals and condition number."""
    joints = result.arm.robot.joints
    for trend in residual_trends(joints, fits):
        yield trend, 'Find the missing effect with armid diagnose, and add it with --effects.'
    coloured = [
        name
        for joint, name in enumerate(joints)
        if Whiteness.of(fits, joint).outside > 0.25  # share of lags, 0.01 for white noise
    ]
    if coloured:
        yield (
            f'The residual of {", ".join(coloured)} is far from white: the model lacks an '
            'effect. The intervals account for autocorrelation, not for bias.',
            '',
        )
    known = excludes_zero(result.estimate.values, result.estimate.std)
    if not known.all():
        yield (
            f'{int(np.sum(~known))} of {len(known)} parameters are not distinguishable from '
            'zero: use the torque of the model, not their single values.',
            '',
        )
    if result.condition_number > WEAK_CONDITION:
        yield (
            f'The excitation is weak (condition number {plain(result.condition_number)}). '
            'Errors on other motions may be large.',
            'Design an excitation with armid excite and record it. With these recordings, '
            '--physical keeps undetermined links near their description.',
        )


def _of_verification(verification: Verification, misfits: bool) -> Iterator[Caution]:
    """Yield limitations and remedies that follow from simulations and the noise test."""
    for text in verification.left_out:
        yield sentence(text), ''
    worse = ', '.join(sorted({name for pair in verification.forward for name in pair.worse}))
    if worse:
        yield (
            'Driven by the recorded torques, the identified arm has larger position errors '
            f'than the description in {worse}.',
            f'Check the residual of {worse} before you simulate with the model.',
        )
    # jerks of a missing effect look like encoder noise
    if verification.noise is not None and not verification.noise.harmless and not misfits:
        size = float(np.max(np.abs(verification.noise.relative_bias)))
        yield (
            'Encoder noise biases parameters by up to '
            f'{digits(size)} standard deviations, which the intervals do not include.',
            'Lower the cut-off of the position filter (--cutoff), or move faster: encoder noise '
            'biases parameters.',
        )
