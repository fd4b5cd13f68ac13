# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Delay of the torques of a recording against its positions, with a confidence interval.

A delay shifts the whole torque in time. Presliding friction only comes late itself: after a
reversal it grows with the distance that the joint has travelled (Dahl 1968), which takes tens of
milliseconds at low speed. So a delay is estimated from weight and inertia: its column is the rate
of the body's torque, and friction with several presliding lengths is fitted as well. If a motion
runs backwards, the torque of a body is the same and its rate, like friction, is opposite. An error
of the described body therefore does not look like a delay.

"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from armid_ros.effects.slipping import Hysteresis
from armid_ros.effects.timing import smoothed, within_band
from armid_ros.identification.assess.grade_limits import FREEDOM, LIMITS
from armid_ros.identification.assess.hypotheses import shifted
from armid_ros.identification.assess.prediction_error import (
    beside,
    root_mean_square,
)
from armid_ros.identification.fitting.excited import near_deviation
from armid_ros.identification.rows.signals import (
    Conditioning,
    decimate,
    decimated_samples,
    segments,
)
from armid_ros.model import inverse_dynamics, regressor
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np
from scipy.stats import t as student

#: Presliding lengths of friction [rad or m], as in gears of arms, in steps of three to cover all
#: lengths between. On 63 recordings with lengths of 1 to 3 mrad, the delay errs by -1 to 6 ms (5
#: to 95 %). Lengths of 1 and 3 mrad alone err by 0 to 6 ms, 0.1 to 30 mrad by -3 to 6 ms. Without
#: lengths, the error is -24 to 17 ms, with a six times wider interval.
_LENGTHS = (0.0003, 0.001, 0.003, 0.01)
#: Longest delay that is tested [s].
_LONGEST = 0.3
#: Number of blocks of a recording whose scores give the deviation; nine degrees of freedom.
_BLOCKS = 10


class Delay(NamedTuple):
    """Delay of a torque, negative if early, and half-width of its 95 % interval [s]."""

    seconds: float
    half_width: float


def late_torque(robot: Robot, recording: Recording, used: Conditioning) -> Delay | None:
    """
    Return the delay with its 95 % interval; None if the interval includes zero.

    Parameters
    ----------
    robot : Robot
        Robot of the description.
    recording : Recording
        Data with torques.
    used : Conditioning
        Filters that the recording is identified with.

    """
    stretches = list(segments(recording, used))
    seconds, half = 0.0, np.inf
    for _ in range(10):  # Gauss-Newton steps
        moved = [shifted(motion, seconds) for motion in stretches]
        rows = [
            _rows(robot, motion, used)
            for motion in moved
            if len(decimated_samples(len(motion), used)) > 1  # the rate needs two samples
        ]
        found = _step(rows) if rows else None
        if found is None:
            return None
        before, half = seconds, found.half_width
        seconds = float(np.clip(seconds + found.seconds, -_LONGEST, _LONGEST))
        if abs(seconds - before) < 1e-4:  # [s]
            break
    return Delay(seconds, half) if abs(seconds) > half else None


def _rows(robot: Robot, motion: Motion, used: Conditioning) -> tuple[FloatArray, FloatArray]:
    """Return the columns of each joint, (n, M, k), and the shared ones, (n, M, 10 n + 3)."""
    # own columns: offset, viscous friction, drive inertia, and dry friction without and with
    # presliding, constant and in proportion to the load; it is filtered as the torque is, as it
    # steps within a sample. Shared columns: bodies near the description, effect of a delay of
    # 1 s, residual torque, and torque
    assert motion.tau is not None
    n, kept = motion.n_joints, np.array(decimated_samples(len(motion), used), dtype=np.intp)
    bent = Hysteresis(
        np.tile(np.eye(n), (len(_LENGTHS), 1)), np.ones(n * len(_LENGTHS)), np.repeat(_LENGTHS, n)
    ).along(motion.q, motion.dq)
    slow = motion.select(kept)
    both = np.concatenate([motion.tau, np.sign(motion.dq), bent], axis=1)
    tau, *dry = np.split(within_band(slow, decimate(both, used)), len(_LENGTHS) + 2, axis=1)
    slow = smoothed(slow)
    body = inverse_dynamics(robot, slow)
    loaded = [np.abs(body) * part for part in dry]
    own = np.stack([np.ones_like(body), slow.dq, slow.ddq, *dry, *loaded], axis=-1)
    near = regressor(robot, slow) * near_deviation(robot)
    rate = np.gradient(body, slow.t, axis=0)
    shared = np.concatenate([near, np.stack([-rate, tau - body, tau], axis=-1)], axis=-1)
    return own.transpose(1, 0, 2), shared.transpose(1, 0, 2)


def _step(parts: Sequence[tuple[FloatArray, FloatArray]]) -> Delay | None:
    """Fit the delay with friction, drive inertia and body as nuisance parameters."""
    # the deviation allows for residuals that are correlated in time or within a joint (Liang and
    # Zeger 1986): scores are summed over blocks of the recording, or over joints, whichever sums
    # vary more
    own, shared = (np.concatenate(some, axis=1) for some in zip(*parts, strict=True))
    own = own / root_mean_square(own.transpose(1, 0, 2))[:, np.newaxis]
    torque = root_mean_square(shared[:, :, -1].T)
    shared = beside(own, shared[:, :, :-1] / torque[:, np.newaxis, np.newaxis])
    near, rate, rest = shared[:, :, :-2], shared[:, :, -2], shared[:, :, -1]
    stacked = near.reshape(-1, near.shape[2])
    prior = LIMITS.floor**2 * near.shape[1] / FREEDOM
    normal = stacked.T @ stacked + prior * np.eye(stacked.shape[1])
    by_body = near @ np.linalg.solve(normal, stacked.T @ np.stack([rate.ravel(), rest.ravel()], 1))
    alone = rate - by_body[:, :, 0]
    known = float(np.sum(rate * alone))
    if known <= 0.0:
        return None
    delay = float(np.sum(alone * rest)) / known
    score = alone * (rest - by_body[:, :, 1] - alone * delay)
    blocks = np.array([part.sum() for part in np.array_split(score, _BLOCKS, axis=1)])
    # standard deviation of the total of several sums; zero if there is only one
    spreads = [np.sqrt(np.sum(x**2) * len(x) / max(len(x) - 1, 1)) for x in (blocks, score.sum(1))]
    return Delay(delay, float(student.ppf(0.975, _BLOCKS - 1) * max(spreads) / known))
