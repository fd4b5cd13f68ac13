# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The simulated pair: both machines step to and fro, by prescription or by torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.exo.assumptions import read_assumptions
from armid_ros.papers.exo.plant.gait import Gait
from armid_ros.papers.exo.plant.leg_pair import pair_torques, PairMotion, stepping, TiedPair
from armid_ros.papers.exo.plant.torque_driven import drive_by_torque
import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

#: Number of samples per block of the simulation.
_BLOCK = 50


@dataclass(frozen=True, eq=False)
class PairSample:
    """
    One reading of both machines.

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
    A pair that steps repeatedly through single support and back.

    Joints that are driven follow the torques of the gait, sampled and splined as in the source;
    all others follow the gait. A single driven joint stays near the gait. If all joints are
    driven, the pair is an inverted pendulum in open loop, and falls.

    Parameters
    ----------
    pair : TiedPair
        The machines and their springs.
    gait : Gait
        Gait of one leg.
    driven : sequence of str
        Joints of the machine that follow torques.
    torque_rate : float
        Torque samples per second [Hz].
    rate : float
        Samples per second [Hz].
    angle_noise, torque_noise : float
        Standard deviation of all angles [rad], and of the machine's torques [N m].
    rng : numpy.random.Generator
        Source of the noise.

    Raises
    ------
    RobotError
        If the machine has no such joint.

    """

    def __init__(
        self,
        pair: TiedPair,
        gait: Gait,
        *,
        driven: Sequence[str] = (),
        torque_rate: float = 100.0,
        rate: float = 1000.0,
        angle_noise: float = 0.0,
        torque_noise: float = 0.0,
        rng: np.random.Generator,
    ) -> None:
        self.pair = pair
        self.driven = tuple(driven)
        self._columns = [self.pair.robot.index(joint) for joint in self.driven]
        self._gait = gait
        self._rate = rate
        self._noise = angle_noise, torque_noise
        self._rng = rng
        period = float(read_assumptions()['stepping_period'].value)
        knots = np.linspace(0.0, period, round(period * torque_rate))
        tau = np.array(pair_torques(self.pair, *stepping(self.pair, self._gait, knots)).tau)
        tau[-1] = tau[0]
        self._torque = CubicSpline(knots, tau[:, self._columns], bc_type='periodic')
        self.reset()

    def reset(self) -> None:
        """Return both machines to the initial state."""
        self._steps = 0
        self._first = 0
        self._block: tuple[PairMotion, FloatArray] | None = None
        self._state: FloatArray | None = None
        self.deviation = 0.0

    @property
    def t(self) -> float:
        """Time since the beginning [s]."""
        return self._steps / self._rate

    @property
    def fallen(self) -> bool:
        """Whether a driven joint deviates so far from the gait that the pair has fallen."""
        return bool(self.deviation > np.radians(60.0))  # of a driven joint from the gait

    def advance(self) -> PairSample:
        """Simulate one sample, and return the sensor readings."""
        self._steps += 1
        if self._block is None or self._steps - self._first > _BLOCK:
            self._first = self._steps - 1
            self._block = self._look_ahead()
        (own, other), tau = self._block
        k = self._steps - self._first
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

    def _look_ahead(self) -> tuple[PairMotion, FloatArray]:
        """Return motion and torques from the sample before the next one on."""
        t = (self._first + np.arange(_BLOCK + 1)) / self._rate
        own, other = stepping(self.pair, self._gait, t)
        if not self._columns:
            return PairMotion(own, other), pair_torques(self.pair, own, other).tau
        own = self._driven(own)
        tau = np.array(pair_torques(self.pair, own, other).tau)
        tau[:, self._columns] = self._torque(t)
        return PairMotion(own, other), tau

    def _driven(self, own: Motion) -> Motion:
        """Integrate the driven joints with their torques over the block."""
        # Runge-Kutta steps in a block: 5 ms at 1 kHz, half the time between two torque samples
        coarse = np.linspace(own.t[0], own.t[-1], 2 * 10 + 1)
        prescribed, other = stepping(self.pair, self._gait, coarse)
        if self._state is not None:
            q, dq = np.array(prescribed.q), np.array(prescribed.dq)
            q[0, self._columns], dq[0, self._columns] = self._state
            prescribed = replace(prescribed, q=q, dq=dq)
        moved = drive_by_torque(self.pair, prescribed, other, self.driven, self._torque)
        self._state = np.array([moved.q[-1, self._columns], moved.dq[-1, self._columns]])
        q, dq, ddq = (np.array(part) for part in (own.q, own.dq, own.ddq))
        far = moved.q[-1, self._columns] - q[-1, self._columns]
        self.deviation = float(np.abs(far).max())
        speed = CubicHermiteSpline(moved.t, moved.dq, moved.ddq)
        path = CubicHermiteSpline(moved.t, moved.q, moved.dq)
        for values, curve in ((q, path(own.t)), (dq, speed(own.t)), (ddq, speed(own.t, 1))):
            values[:, self._columns] = curve[:, self._columns]
        return replace(own, q=q, dq=dq, ddq=ddq)
