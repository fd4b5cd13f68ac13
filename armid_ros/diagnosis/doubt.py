# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Why a model may be none of the arm: what it leaves of recordings in which nothing was wrong."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.arm import ArmModel, Misfit
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import torque_rms
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.settings import Thresholds
from armid_ros.diagnosis.verdict.finding import Finding
from armid_ros.diagnosis.verdict.words import larger
from armid_ros.effects import CATALOGUE
from armid_ros.errors import IdentificationError
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np

_UNUSABLE = (
    'The model was unusable when it was identified, as identification.json beside it says: what '
    'it leaves is no measure of what has changed.'
)


def doubt_of(
    arm: ArmModel,
    baseline: Baseline | None,
    recordings: Sequence[Recording],
    misfit: Misfit | None,
    thresholds: Thresholds,
) -> str:
    """
    Say why a model may be wrong itself, in a sentence; empty if it need not be.

    Parameters
    ----------
    arm : ArmModel
        The model.
    baseline : Baseline or None
        What it leaves of recordings in which nothing was wrong.
    recordings : sequence of Recording
        These recordings.
    misfit : Misfit or None
        What it left when it was identified.
    thresholds : Thresholds
        How much a misfit varies from motion to motion.

    """
    if baseline is not None:
        said = _unlike(arm, baseline, recordings, misfit, thresholds) or _poor(arm, baseline)
        if said:
            return said
    return _UNUSABLE if misfit is not None and misfit.unusable else ''


def doubt_of_names(findings: Sequence[Finding]) -> str:
    """Say that what was named never happens between two days; empty where it may have."""
    never = [
        one for one in findings if one.name in CATALOGUE and CATALOGUE[one.name].traits.corrects
    ]
    if not never:
        return ''
    return (
        f'Links do not change between two days: unless that of {" and ".join(never[0].joints)} '
        'was exchanged or something was bolted to it, what is not in the catalogue acts like it.'
    )


def doubt_as_it_is(excess: FloatArray, robot: Robot, floor_in_words: str) -> str:
    """Say that a body as it was leaves more than a floor can be; '' where it does not."""
    worst, *others = np.argsort(-excess)
    if excess[worst] <= 1.0:
        return ''
    too = ', '.join(robot.joints[k] for k in others if excess[k] > 1.0)
    return (
        f'Without a fit of its rigid body and friction, the error of {robot.joints[worst]} is '
        f'{larger(np.sqrt(excess[worst]))} {floor_in_words} can be'
        f'{f", and that of {too} is too large as well" if too else ""}.'
    )


def _unlike(
    arm: ArmModel,
    baseline: Baseline,
    recordings: Sequence[Recording],
    misfit: Misfit | None,
    thresholds: Thresholds,
) -> str:
    """Say that a model leaves much more of a baseline than when it was identified."""
    if misfit is None:
        return ''
    times, most = _times(arm, baseline, misfit, thresholds)
    if misfit.filters is not None and np.any(times > most):
        times, most = _behind_its_filters(arm, recordings, misfit, thresholds)
    worst = int(np.argmax(times / most))
    if times[worst] <= most[worst]:
        return ''
    return (
        f'In the baseline the model leaves {times[worst]:.1f} times as much in '
        f'{arm.robot.joints[worst]} as when it was identified: it is not what the model was '
        'identified from, or something had changed by then.'
    )


def _behind_its_filters(
    arm: ArmModel, recordings: Sequence[Recording], misfit: Misfit, thresholds: Thresholds
) -> tuple[FloatArray, FloatArray]:
    """Compare behind the filters of the identification: a wider band has more noise."""
    assert misfit.filters is not None
    try:
        parts = trajectories(recordings, Conditioning(*misfit.filters), arm)
    except IdentificationError:  # too short for them, or of a lower rate: nothing to compare
        return np.zeros(arm.robot.n_joints), np.ones(arm.robot.n_joints)
    baseline = Baseline.of(arm, parts, np.random.default_rng(0))
    return _times(arm, baseline, misfit, thresholds)


def _times(
    arm: ArmModel, baseline: Baseline, misfit: Misfit, thresholds: Thresholds
) -> tuple[FloatArray, FloatArray]:
    """Return how many times as much a model leaves, and how many times it may, each (n,)."""
    known = misfit.of(arm.robot, torque_rms(baseline.data))
    most = np.sqrt(thresholds.other_motion * np.maximum(baseline.varies, 1.0))
    return baseline.misfit / np.maximum(known, 1e-300), most


def _poor(arm: ArmModel, baseline: Baseline) -> str:
    """Say that a model leaves much of the torque of a baseline."""
    whole, each = baseline.errors
    bad = [
        f'{100.0 * error:.0f} % of the torque of {joint}'
        for joint, error in zip(arm.robot.joints, each, strict=True)
        if 100.0 * error > LIMITS.unusable
    ]
    if 100.0 * whole > LIMITS.poor:
        bad.insert(0, f'{100.0 * whole:.0f} % of the torque of the arm')
    if not bad:
        return ''
    return (
        f'In the baseline itself the model leaves {", ".join(bad)}: is it the model of this arm? '
        'A change of less is not seen.'
    )
