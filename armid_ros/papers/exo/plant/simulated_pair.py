# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated sensor readings of exoskeleton and wearer in periodic motion."""

from __future__ import annotations

from typing import NamedTuple

from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.gait import Gait
from armid_ros.papers.exo.plant.leg_pair import pair_torques, PairMotion, stepping, TiedPair
import numpy as np

#: Samples that are computed together.
_BLOCK = 50


class PairSample(NamedTuple):
    """
    Sensor readings of exoskeleton and wearer at one instant.

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


class SimulatedPair:
    """
    Simulator of exoskeleton and wearer along a gait, with sensor noise.

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

    def __init__(
        self,
        pair: TiedPair,
        gait: Gait,
        *,
        rate: float = 1000.0,
        angle_noise: float = 0.0,
        torque_noise: float = 0.0,
        rng: np.random.Generator,
    ) -> None:
        self.pair = pair
        self._gait = gait
        self._rate = rate
        self._noise = angle_noise, torque_noise
        self._rng = rng
        self.reset()

    def reset(self) -> None:
        """Return exoskeleton and wearer to the initial state."""
        self._steps = 0
        self._block: tuple[PairMotion, FloatArray] | None = None

    @property
    def t(self) -> float:
        """Time since the initial state [s]."""
        return self._steps / self._rate

    def advance(self) -> PairSample:
        """Advance by one sample, and return the sensor readings."""
        k = self._steps % _BLOCK
        self._steps += 1
        if k == 0 or self._block is None:
            t = (self._steps + np.arange(_BLOCK)) / self._rate
            motions = stepping(self.pair, self._gait, t)
            self._block = motions, pair_torques(self.pair, *motions).tau
        (own, other), tau = self._block
        noise = self._rng.standard_normal((3, len(tau[k])))
        angles, torques = self._noise
        return PairSample(
            self.t,
            own.q[k] + angles * noise[0],
            own.dq[k],
            tau[k] + torques * noise[1],
            other.q[k] + angles * noise[2],
            other.dq[k],
        )
