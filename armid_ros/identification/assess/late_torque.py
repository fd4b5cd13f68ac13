# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
By how much a torque comes later than the position that it belongs to, and how sure that is.

A delay shifts all of a torque in time, friction that gives way before it slips only itself: after
a reversal it follows the way that the joint has travelled (Dahl 1968), which at low speed takes
tens of milliseconds. So a delay is told by weight and inertia, with friction free to come as late
as it likes: beside the rate of the body's torque are columns of friction that gives way over
several lengths. Where a motion is run backwards the torque of a body is the same and its rate is
opposite, as friction is; a body that is off from its description is therefore no delay.

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

#: Lengths over which friction may give way [rad or m]: what gears of arms show, in steps of three,
#: which any length between follows. Of 63 recordings with friction of 1 to 3 mrad they are off
#: by -1 to 6 ms (5 to 95 %), 1 and 3 mrad alone by 0 to 6, 0.1 to 30 mrad by -3 to 6, and no
#: length at all by -24 to 17 ms with an interval that is six times as wide.
_LENGTHS = (0.0003, 0.001, 0.003, 0.01)
#: Longest delay that is looked for [s].
_LONGEST = 0.3
#: Parts of a recording of which each tells a delay by itself: ten are nine degrees of freedom.
_BLOCKS = 10


class Delay(NamedTuple):
    """Delay of a torque, negative if early, and half-width of its 95 % interval [s]."""

    seconds: float
    half_width: float


def late_torque(robot: Robot, recording: Recording, used: Conditioning) -> Delay | None:
    """
    Return the delay with its 95 % interval; None if that includes zero.

    Parameters
    ----------
    robot : Robot
        The description.
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
            if len(decimated_samples(len(motion), used)) > 1  # or they have no rate
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
    # own are offset, viscous friction, drive inertia, and dry friction that gives way over no
    # length and over several, constant and in proportion to the load, filtered as the torque is,
    # for it steps within a sample; shared are what bodies near the description add, what a delay
    # of 1 s does, what is to be explained, and the torque
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
    # the deviation allows for residuals that are alike for long, or in all of a joint (Liang and
    # Zeger 1986): sums of their products with the rate over parts of the recording, or over
    # joints, whichever vary more
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
    # the deviation of the total of some sums; one alone tells none
    spreads = [np.sqrt(np.sum(x**2) * len(x) / max(len(x) - 1, 1)) for x in (blocks, score.sum(1))]
    return Delay(delay, float(student.ppf(0.975, _BLOCKS - 1) * max(spreads) / known))
