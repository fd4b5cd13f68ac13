# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Statistics of a recording: time stamps, joints, and the quality of a trial identification."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.identification import Grade, Identification, Score
from armid_ros.identification.assess.grade import beyond_noise
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.assess.sensor_faults import held_elsewhere, velocity_ratio
from armid_ros.identification.rows.checks import REST_RANGE
from armid_ros.identification.rows.period import find_period, refined_period
from armid_ros.identification.rows.regression import REST_SPEED
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.recording.recording import GAP_PERIODS
from armid_ros.recording.series import NOTHING
import numpy as np
from scipy.signal import savgol_filter


@dataclass(frozen=True)
class Sampling:
    """
    Statistics of the time stamps of a recording: rate, jitter, gaps.

    Attributes
    ----------
    duration : float
        Time from the first sample to the last [s].
    rate_hz : float
        Samples per second, from the median step.
    jitter : float
        Standard deviation of the steps, gaps left out, as a share of the median step.
    longest_step : float
        Longest time between samples [s].
    gaps : int
        Number of steps of more than five median steps.
    period : float or None
        Period of the motion [s]; None if the motion is not periodic.
    periods : float
        Number of periods in the recording.

    """

    duration: float
    rate_hz: float
    jitter: float
    longest_step: float
    gaps: int
    period: float | None
    periods: float

    @staticmethod
    def of(recording: Recording) -> Sampling:
        """Return the statistics of the time stamps of a recording."""
        steps = np.diff(recording.t)
        median = float(np.median(steps))
        ordinary = steps[steps <= GAP_PERIODS * median]
        period = repetition_period(recording)
        return Sampling(
            recording.duration,
            1.0 / median,
            float(np.std(ordinary) / median),
            float(steps.max()),
            int(np.sum(steps > GAP_PERIODS * median)),
            period,
            recording.duration / period if period else 0.0,
        )


def repetition_period(recording: Recording) -> float | None:
    """Return the period of a repeated motion in a recording [s]; None without repetition."""
    # at most 20 Hz and 3000 samples
    rate = min(20.0, 1.0 / recording.period, 3000 / max(recording.duration, 1e-9))
    t = np.arange(recording.t[0], recording.t[-1], 1.0 / rate)
    varying = np.ptp(recording.q, axis=0) > 1e-3
    if len(t) < 40 or not varying.any():
        return None
    q = np.column_stack([np.interp(t, recording.t, column) for column in recording.q.T[varying]])
    found = find_period(t, q)
    if found is None:
        return None
    return refined_period(q, *found) / rate


@dataclass(frozen=True)
class JointFacts:
    """
    Statistics of one joint in a recording, in the units of the recorded file.

    Attributes
    ----------
    name : str
        Name of the joint.
    lower, upper : float
        Range of the positions.
    speed : float
        99th percentile of the speed, from the positions.
    moving : float
        Share of the time in which the joint moves.
    step : float
        Smallest nonzero change of the position from one sample to the next.
    repeated : float
        Share of the samples that repeat the previous position while the joint moves.
    velocity_ratio : float or None
        Recorded velocity divided by the derivative of position, 1 in equal units; None without
        velocity or motion.
    velocity_fit : float
        Correlation of recorded velocity and derivative of position.
    effort_rms, effort_largest : float or None
        Root mean square and largest absolute value of the efforts; None without efforts.
    effort_varies : bool
        Whether the efforts change.

    """

    name: str
    lower: float
    upper: float
    speed: float
    moving: float
    step: float
    repeated: float
    velocity_ratio: float | None
    velocity_fit: float
    effort_rms: float | None
    effort_largest: float | None
    effort_varies: bool

    @property
    def still(self) -> bool:
        """Whether the joint is at rest in the whole recording."""
        return self.upper - self.lower < REST_RANGE


def joint_facts(recording: Recording) -> tuple[JointFacts, ...]:
    """Return position range, speed, resolution and efforts of each recorded joint."""
    speeds = np.abs(_derivative(recording))
    found = []
    for j, (name, ratio, fit) in enumerate(
        zip(recording.joints, *velocity_ratio(recording), strict=True)
    ):
        q, top = recording.q[:, j], float(np.percentile(speeds[:, j], 99))
        moves = speeds[:, j] > REST_SPEED * max(top, 1e-12)
        changes = np.abs(np.diff(q))
        still = float(np.ptp(q)) < REST_RANGE
        tau = None if recording.tau is None else recording.tau[:, j]
        facts = JointFacts(
            name=name,
            lower=float(q.min()),
            upper=float(q.max()),
            speed=top,
            moving=0.0 if still else float(moves.mean()),
            step=float(changes[changes > 0.0].min()) if changes.any() else 0.0,
            repeated=0.0 if still else float(np.mean(changes[moves[1:]] == 0.0)),  # noqa: RUF069 - as recorded
            velocity_ratio=float(ratio) if np.isfinite(ratio) else None,
            velocity_fit=float(fit),
            effort_rms=None if tau is None else float(np.sqrt(np.mean(tau**2))),
            effort_largest=None if tau is None else float(np.abs(tau).max()),
            effort_varies=tau is not None and bool(np.ptp(tau) > NOTHING),
        )
        found.append(facts)
    return tuple(found)


def _derivative(recording: Recording) -> FloatArray:
    """Return velocities (N, n): slopes of parabolas fitted locally to recorded positions."""
    half = 5  # samples on either side
    if len(recording) <= 2 * half + 1:
        return np.gradient(recording.q, recording.t, axis=0)
    even = np.linspace(recording.t[0], recording.t[-1], len(recording))
    columns = []
    for column in recording.q.T:
        q = np.interp(even, recording.t, column)
        speed = savgol_filter(q, 2 * half + 1, 2, deriv=1, delta=float(even[1] - even[0]))
        columns.append(np.interp(recording.t, even, speed))
    return np.column_stack(columns)


@dataclass(frozen=True)
class TrialFit:
    """
    Quality of a trial identification from one recording.

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
        Messages on undriven joints that moved, or stood at another position than described.
    poor : tuple of str
        Joints whose torque error is poor, each with this error.
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

    @classmethod
    def of(
        cls, found: Identification, graded: Grade, recording: Recording, scale: FloatArray
    ) -> TrialFit:
        """Assess a trial identification; `scale` is effort divided by described torque, (n,)."""
        robot, motions = found.arm.robot, [fit.motion for fit in found.training]
        score = Score.of(found.training)
        errors = score.joint_relative_error_percent
        beyond = beyond_noise(errors, found.training, found.used)  # noise may exceed the limit
        return cls(
            relative_error_percent=score.relative_error_percent,
            rank=found.base.rank,
            theory=found.theory.rank,
            condition_number=found.condition_number,
            cutoff_hz=found.used.cutoff_hz,
            scale=scale,
            notes=found.notes,
            elsewhere=tuple(one.text for one in held_elsewhere(robot, [recording], motions)),
            poor=tuple(
                f'{error:.0f} % of the efforts of {joint}'
                for joint, error, excess in zip(robot.joints, errors, beyond, strict=True)
                if excess > LIMITS.poor
            ),
            grade=graded.word,
            reasons=graded.reasons,
            faults=graded.faults,
        )
