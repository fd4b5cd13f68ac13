# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Gate that removes damaged joint states, for streams, recordings and pairs of machines."""

from __future__ import annotations

from armid_ros.identification.samples.spikes import SpikeGate
import numpy as np
import numpy.typing as npt

#: Best resolution of a position [rad or m], of a velocity (per second), and of a torque as a share
#: of its limit: an encoder of 22 bits, a torque sensor of 17.
_FINEST = {'q': 1e-6, 'v': 1e-5, 't': 1e-5}
#: Second derivative of each signal when an arm at rest begins to move, in these units per second
#: squared: 2 rad/s^2, a jerk of 50 rad/s^3, and a torque at its limit that oscillates at 1 Hz.
_ONSET = {'q': 2.0, 'v': 50.0, 't': 50.0}


def joint_gate(
    prismatic: npt.ArrayLike,
    signals: str,
    *,
    torque_limit: npt.ArrayLike = 0.0,
    max_gap: int = 10,
    false_alarm_time: float = 360000.0,
) -> SpikeGate:
    """
    Return a gate for joint states: positions never step, torques may jump and return.

    Parameters
    ----------
    prismatic : array_like of bool, shape (n,)
        Whether each joint is prismatic; the angles of the others may jump by full turns.
    signals : str
        Signals of a sample, each for all joints: q for positions, v for velocities, t for torques,
        as in 'qt'.
    torque_limit : array_like, shape (n,), optional
        Largest torque of each joint [N m or N], infinite where unknown.
    max_gap, false_alarm_time
        See `SpikeGate`.

    Returns
    -------
    SpikeGate

    """
    turning = ~np.asarray(prismatic, dtype=bool)
    kind, revolute = np.repeat(list(signals), len(turning)), np.tile(turning, len(signals))
    position = kind == 'q'
    limit = np.broadcast_to(np.asarray(torque_limit, dtype=float), turning.shape)
    known = limit[np.isfinite(limit)]
    scale = np.where(np.isfinite(limit), limit, known.min() if len(known) else 0.0)
    finest, onset = (
        np.concatenate(
            [known[one] * (scale if one == 't' else np.ones_like(scale)) for one in signals]
        )
        for known in (_FINEST, _ONSET)
    )
    return SpikeGate(
        position & revolute,
        max_gap=max_gap,
        false_alarm_time=false_alarm_time,
        continuous=position,
        pulsing=kind == 't',
        finest=finest,
        onset=onset,
    )
