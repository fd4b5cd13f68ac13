# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Trial identification of a recording with the usual friction."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.effects import USUAL_EFFECTS
from armid_ros.errors import ArmidError
from armid_ros.identification import identify, Score
from armid_ros.identification.assess.grade import beyond_noise, grade
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.assess.sensor_faults import held_elsewhere
from armid_ros.identification.rows.checks import FOLLOWS, torque_factors
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np


@dataclass(frozen=True)
class TrialFit:
    """
    Result of a trial identification.

    Attributes
    ----------
    refused : str
        Why ``identify`` refuses the recording; empty if it accepts the recording.
    relative_error_percent : float or None
        100 |tau - tau_hat| / |tau| of the fit.
    rank : int
        Number of parameters that the motion makes identifiable, at most ``theory``.
    theory : int
        Number of parameters that are identifiable with a suitable motion.
    condition_number : float or None
        Condition number of the weighted regressor.
    cutoff_hz : float or None
        Cut-off of the position filter [Hz].
    scale : ndarray, shape (n,), or None
        Ratio of efforts to torques of the description, per joint; NaN without correlation.
    notes : tuple of str
        Notes of the identification.
    elsewhere : tuple of str
        Joints without drive that moved, or stood at another position than described.
    poor : tuple of str
        Joints whose torque the fit hardly describes, each with its error.
    grade : str
        Grade by ``identify``: good, poor or unusable; empty if the recording is refused.
    reasons : tuple of str
        Reasons of the grade, the worst first.
    faults : tuple of str
        Reasons that are faults of the recording itself, without a full stop.

    """

    refused: str = ''
    relative_error_percent: float | None = None
    rank: int = 0
    theory: int = 0
    condition_number: float | None = None
    cutoff_hz: float | None = None
    scale: FloatArray | None = None
    notes: tuple[str, ...] = ()
    elsewhere: tuple[str, ...] = ()
    poor: tuple[str, ...] = ()
    grade: str = ''
    reasons: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()


def try_identification(robot: Robot, recording: Recording, rng: np.random.Generator) -> TrialFit:
    """
    Try an identification and collect measures of its quality.

    Parameters
    ----------
    robot : Robot
        Description.
    recording : Recording
        Recording of the joints of the robot.
    rng : numpy.random.Generator
        Random numbers for the identification.

    """
    arm = ArmModel.of(robot, effects=USUAL_EFFECTS)
    try:
        result = identify(arm, [recording], rng=rng)
        graded = grade(result, arm, [recording], {})
    except ArmidError as refusal:
        return TrialFit(refused=str(refusal))
    motions = [fit.motion for fit in result.training]
    factors, correlation = torque_factors(ArmModel(robot), motions)
    score = Score.of(result.training)
    errors = score.joint_relative_error_percent
    beyond = beyond_noise(errors, result.training, result.used)  # noise makes no model poor
    return TrialFit(
        relative_error_percent=score.relative_error_percent,
        rank=result.base.rank,
        theory=result.theory.rank,
        condition_number=result.condition_number,
        cutoff_hz=result.used.cutoff_hz,
        scale=np.where(np.abs(correlation) > FOLLOWS, factors, np.nan),
        notes=result.notes,
        elsewhere=tuple(one.text for one in held_elsewhere(robot, [recording], motions)),
        poor=tuple(
            f'{error:.0f} % of the efforts of {joint}'
            for joint, error, left in zip(robot.joints, errors, beyond, strict=True)
            if left > LIMITS.poor
        ),
        grade=graded.word,
        reasons=graded.reasons,
        faults=graded.faults,
    )
