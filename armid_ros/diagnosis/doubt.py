# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Doubts whether a model belongs to the arm, because its residual in the baseline is too large."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel, Misfit
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import torque_rms
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.settings import Thresholds
from armid_ros.diagnosis.verdict.finding import Finding
from armid_ros.diagnosis.verdict.words import Verdict
from armid_ros.effects import CATALOGUE
from armid_ros.errors import IdentificationError
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np


def doubt_of(
    arm: ArmModel,
    baseline: Baseline | None,
    recordings: Sequence[Recording],
    misfit: Misfit | None,
    thresholds: Thresholds,
) -> str:
    """
    Return a sentence on why the given model may be wrong; empty without a reason.

    Parameters
    ----------
    arm : ArmModel
        The model.
    baseline : Baseline or None
        Residual of the model in recordings from when the model was right.
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
    changed = '' if misfit is None else _changed(arm, baseline, recordings, misfit, thresholds)
    return changed or _poor(arm, baseline) or unusable


def doubted(
    verdict: Verdict,
    doubt: str,
    findings: Sequence[Finding],
    arm: ArmModel,
    baseline: Baseline | None,
) -> tuple[Verdict, str]:
    """
    Return the verdict under a doubt of the model, and the doubt, which findings may add.

    A model with a large residual in the baseline is consistent with any data: these are bad data.
    With a smaller one, the doubt precedes the verdict.

    """
    if verdict.word != 'consistent':
        return verdict, doubt or (doubt_of_names(findings) if baseline else '')
    if baseline and 100.0 * baseline.errors[0] > LIMITS.unusable:
        lead = 'The data cannot be diagnosed: too little signal, or the model of another arm.'
        return Verdict('bad_data', f'{lead} {_poor(arm, baseline)}'), ''
    return replace(verdict, summary=f'{doubt} {verdict.summary}'.lstrip()), doubt


def doubt_of_names(findings: Sequence[Finding]) -> str:
    """Return a sentence if a named cause cannot arise between two days; empty otherwise."""
    for one in findings:
        if one.name in CATALOGUE and CATALOGUE[one.name].traits.corrects:
            return (
                'Links do not change between two days. Unless the link of '
                f'{" and ".join(one.joints)} was exchanged or carries a new part, the true '
                'cause is not in the catalogue and resembles this change.'
            )
    return ''


def _changed(
    arm: ArmModel,
    baseline: Baseline,
    recordings: Sequence[Recording],
    misfit: Misfit,
    thresholds: Thresholds,
) -> str:
    """Return a sentence if the baseline residual is much larger than at identification."""

    def compared(known: Baseline) -> tuple[FloatArray, FloatArray]:
        times = known.misfit / np.maximum(misfit.of(arm.robot, torque_rms(known.data)), 1e-300)
        most = np.sqrt(thresholds.other_motion * np.maximum(known.varies, 1.0))
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
        'that of the identification. The model was not identified from this baseline, or '
        'something had changed by then.'
    )


def _poor(arm: ArmModel, baseline: Baseline) -> str:
    """Return a sentence if the baseline residual is a large share of the torque."""
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
        f'In the baseline, the residual of the model is {", ".join(bad[:2])}: is it the model of '
        'this arm? Smaller changes are not detectable.'
    )
