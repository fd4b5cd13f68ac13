# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Delay between torques and positions of a recording, with a confidence interval.

A delay shifts the whole torque in time. Presliding friction delays only the friction: after a
reversal it grows with the distance that the joint has travelled (Dahl 1968), which takes tens of
milliseconds at low speed. A delay is therefore estimated from weight and inertia. Its column is
the rate of the rigid-body torque; friction with several presliding lengths is a nuisance. In a
reversed motion, the rigid-body torque is the same, but its rate and friction have the opposite
sign. Errors of described masses therefore do not look like a delay.

"""

from __future__ import annotations

from typing import NamedTuple

from armid_ros.effects.slipping import Hysteresis
from armid_ros.effects.timing import smoothed, within_band
from armid_ros.identification.assess.hypotheses import shifted
from armid_ros.identification.assess.prediction_error import root_mean_square, shared_values
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
    # longest delay that is tested [s]
    longest = 0.3
    stretches = list(segments(recording, used))
    seconds, half = 0.0, np.inf
    for _ in range(10):  # Gauss-Newton steps
        moved = [shifted(motion, seconds) for motion in stretches] if seconds else stretches
        # the rate needs two samples
        rows = [_rows(robot, x, used) for x in moved if len(decimated_samples(len(x), used)) > 1]
        if not rows:
            return None
        own, near, shared, tau = (np.concatenate(part, axis=1) for part in zip(*rows, strict=True))
        own = own / root_mean_square(own.transpose(1, 0, 2))[:, np.newaxis]
        torque = root_mean_square(tau.T)[:, np.newaxis, np.newaxis]
        (step,), (half,) = shared_values(own, shared / torque, near / torque)
        before = seconds
        seconds = float(np.clip(seconds + step, -longest, longest))
        # a smaller step [s], or a small share of the interval, changes no decision
        if abs(seconds - before) < max(1e-4, 0.05 * half):
            break
    return Delay(seconds, float(half)) if abs(seconds) > half else None


def _rows(robot: Robot, motion: Motion, used: Conditioning) -> tuple[FloatArray, ...]:
    """Return columns of each joint, of bodies, of a delay and the rest, (n, M, k), and torques."""
    # presliding lengths of friction [rad or m], as in gears of arms, in steps of three to cover
    # all lengths between. On 63 recordings with lengths of 1 to 3 mrad, the delay errs by -1 to 6
    # ms (5 to 95 %). Lengths of 1 and 3 mrad alone err by 0 to 6 ms, 0.1 to 30 mrad by -3 to 6 ms.
    # Without lengths, the error is -24 to 17 ms, with a six times wider interval.
    lengths = (0.0003, 0.001, 0.003, 0.01)
    # own columns: offset, viscous friction, drive inertia, and dry friction without and with
    # presliding, constant and in proportion to the load; it is filtered as the torque is, as it
    # steps within a sample
    assert motion.tau is not None
    n, kept = motion.n_joints, np.array(decimated_samples(len(motion), used), dtype=np.intp)
    slow = motion.select(kept)
    elements = [Hysteresis(np.eye(n), np.ones(n), np.full(n, length)) for length in lengths]
    states = (one.along(motion.q, motion.dq) for one in elements)
    tau, *dry = (
        within_band(slow, decimate(x, used)) for x in (motion.tau, np.sign(motion.dq), *states)
    )
    slow = smoothed(slow)
    body = inverse_dynamics(robot, slow)
    loaded = [np.abs(body) * part for part in dry]
    own = np.stack([np.ones_like(body), slow.dq, slow.ddq, *dry, *loaded], axis=-1)
    near = regressor(robot, slow) * near_deviation(robot)
    rate = np.gradient(body, slow.t, axis=0)
    shared = np.stack([-rate, tau - body], axis=-1)
    return *(one.transpose(1, 0, 2) for one in (own, near, shared)), tau.T
