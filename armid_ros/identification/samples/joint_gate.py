# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What leaves damaged joint states out: one gate for streams, recordings and pairs of machines."""

from __future__ import annotations

from armid_ros.identification.samples.spikes import SpikeGate
import numpy as np
import numpy.typing as npt


def joint_gate(
    prismatic: npt.ArrayLike,
    signals: str,
    *,
    max_gap: int = 10,
    false_alarm_time: float = 360000.0,
) -> SpikeGate:
    """
    Return a gate for joint states: a position never steps, a torque may jump and come back.

    Parameters
    ----------
    prismatic : array_like of bool, shape (n,)
        Whether each joint is prismatic; the angles of the others may jump by full turns.
    signals : str
        What a sample holds of all joints, in turn: q for positions, v for velocities, t for
        torques, as in 'qt'.
    max_gap, false_alarm_time
        As for `SpikeGate`.

    Returns
    -------
    SpikeGate

    """
    turning = ~np.asarray(prismatic, dtype=bool)
    kind, revolute = np.repeat(list(signals), len(turning)), np.tile(turning, len(signals))
    position = kind == 'q'
    return SpikeGate(
        position & revolute,
        max_gap=max_gap,
        false_alarm_time=false_alarm_time,
        continuous=position,
        pulsing=kind == 't',
    )
