# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Facts about the joints of a recording, and consistency of positions and velocities."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.identification.assess.sensor_faults import velocity_ratio
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.recording.series import NOTHING
import numpy as np
from scipy.signal import savgol_filter

#: A joint slower than this share of its own top speed is at rest.
_REST = 0.02
#: A joint whose range is smaller than this is at rest [rad or m].
STILL = 1e-3


@dataclass(frozen=True)
class JointFacts:
    """
    One joint of a recording in numbers, in the units of the file.

    Attributes
    ----------
    name : str
        Name of the joint.
    lower, upper : float
        Range of the positions.
    speed : float
        99th percentile of the speed, from the positions.
    moving : float
        Share of the time in which it moves.
    step : float
        Smallest change of the position from sample to sample that is not zero.
    repeated : float
        Share of the samples that repeat the position of the one before while it moves.
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
        """Whether the joint is at rest throughout."""
        return self.upper - self.lower < STILL


def joint_facts(recording: Recording) -> tuple[JointFacts, ...]:
    """Return the facts of every joint of a recording."""
    derivative = _derivative(recording)
    ratios = velocity_ratio(recording)
    return tuple(_facts(recording, derivative, ratios, j) for j in range(recording.n_joints))


def _derivative(recording: Recording) -> FloatArray:
    """Return velocities from positions, by parabolas through neighbours in even steps."""
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


def _facts(
    recording: Recording, derivative: FloatArray, ratios: tuple[FloatArray, FloatArray], j: int
) -> JointFacts:
    q, speed = recording.q[:, j], np.abs(derivative[:, j])
    top = float(np.percentile(speed, 99))
    moves = speed > _REST * max(top, 1e-12)
    changes = np.abs(np.diff(q))
    moved = changes[changes > 0.0]
    still = float(np.ptp(q)) < STILL
    ratio, fit = (float(one[j]) for one in ratios)
    tau = None if recording.tau is None else recording.tau[:, j]
    return JointFacts(
        name=recording.joints[j],
        lower=float(q.min()),
        upper=float(q.max()),
        speed=top,
        moving=0.0 if still else float(moves.mean()),
        step=float(moved.min()) if len(moved) else 0.0,
        repeated=0.0 if still else float(np.mean(changes[moves[1:]] == 0.0)),  # noqa: RUF069 - as recorded
        velocity_ratio=ratio if np.isfinite(ratio) else None,
        velocity_fit=fit,
        effort_rms=None if tau is None else float(np.sqrt(np.mean(tau**2))),
        effort_largest=None if tau is None else float(np.abs(tau).max()),
        effort_varies=tau is not None and bool(np.ptp(tau) > NOTHING),
    )
