# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated sensor readings of exoskeleton and wearer in periodic motion."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from typing import NamedTuple

from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.gait import Gait
from armid_ros.papers.exo.plant.leg_pair import pair_torques, stepping, TiedPair
import numpy as np

#: Samples that are computed together.
_BLOCK = 50


class PairSample(NamedTuple):
    """
    Sensor readings of exoskeleton and wearer at one time.

    Attributes
    ----------
    t : float
        Time [s].
    q, dq, tau : ndarray, shape (n,)
        State and torques of the machine [rad, rad/s, N m].
    other_q, other_dq : ndarray, shape (m,)
        State of the wearer [rad, rad/s].

    """

    t: float
    q: FloatArray
    dq: FloatArray
    tau: FloatArray
    other_q: FloatArray
    other_dq: FloatArray


def sensor_readings(
    pair: TiedPair,
    gait: Gait,
    *,
    rate: float = 1000.0,
    angle_noise: float = 0.0,
    torque_noise: float = 0.0,
    rng: np.random.Generator,
) -> Iterator[PairSample]:
    """
    Yield sensor readings of exoskeleton and wearer who step forward and back, without end.

    Parameters
    ----------
    pair : TiedPair
        The machines and their springs.
    gait : Gait
        Gait of one leg.
    rate : float
        Samples per second [Hz].
    angle_noise, torque_noise : float
        Standard deviation of all angles [rad], and of the machine's torques [N m].
    rng : numpy.random.Generator
        Source of the noise.

    """
    for first in count(1, _BLOCK):
        t = (first + np.arange(_BLOCK)) / rate
        own, other = stepping(pair, gait, t)
        tau = pair_torques(pair, own, other).tau
        noise = rng.standard_normal((_BLOCK, 3, tau.shape[1]))
        yield from map(
            PairSample,
            t,
            own.q + angle_noise * noise[:, 0],
            own.dq,
            tau + torque_noise * noise[:, 1],
            other.q + angle_noise * noise[:, 2],
            other.dq,
        )
