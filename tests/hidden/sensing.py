# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Hidden faults of what is measured: torque readings, their timing, and encoders."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Any, Self

from armid_ros.robots import Robot
import numpy as np

from tests.hidden.arrays import FloatArray, low_pass, Parameter, sampled, Signals
from tests.hidden.base import HiddenEffect, InPair, OneJoint, Setting


class _Reading(OneJoint):
    """A fault of one torque reading."""

    def distort(self, signals: Signals, robot: Robot) -> Signals:
        tau = signals.tau.copy()
        tau[:, self.index] = self.reading(signals.t, tau[:, self.index])
        return replace(signals, tau=tau)

    @abstractmethod
    def reading(self, t: FloatArray, tau: FloatArray) -> FloatArray:
        """Return what is read, shape (N,), for a true torque."""


class TorqueOffset(_Reading):
    """The reading is too high by a constant."""

    name = 'torque_offset'
    ordinary, signed = 0.02, True
    stated = (('torque_offset', 'value', 'N m'),)
    limit_of = ('torque_drift', 'joint_spring', 'asymmetric_friction')

    def reading(self, t: FloatArray, tau: FloatArray) -> FloatArray:
        return tau + self.value


@dataclass(frozen=True)
class TorqueDrift(_Reading):
    """The reading creeps towards a new zero while the sensor warms up."""

    name = 'torque_drift'
    ordinary, signed = 0.02, True
    stated = (
        ('drift', 'value', 'N m'),
        ('drift_time', 'time_constant', 's'),
    )
    repeats = False
    time_constant: float = 10.0

    @classmethod
    def drawn(cls, setting: Setting, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        return (rng.uniform(6.0, 15.0),)

    def reading(self, t: FloatArray, tau: FloatArray) -> FloatArray:
        return tau + self.value * (1.0 - np.exp(-t / self.time_constant))


class TorqueGain(_Reading):
    """The reading is too large by a share."""

    name = 'torque_gain'
    ordinary, by_torque, loaded = 0.05, 0, 0.05
    stated = (('gain_error', 'value', ''),)

    def reading(self, t: FloatArray, tau: FloatArray) -> FloatArray:
        return (1.0 + self.value) * tau


@dataclass(frozen=True)
class TorqueCrosstalk(InPair):
    """The reading of one joint contains a share of another's torque."""

    name = 'torque_crosstalk'

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        order = np.argsort(setting.torque)[::-1]
        loud = int(order[rng.integers(0, 2)])
        quiet = int(rng.choice([j for j in range(len(order)) if j != loud]))
        share = rng.choice([-1.0, 1.0]) * 0.02
        return cls((setting.joints[quiet], setting.joints[loud]), share)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter(f'crosstalk_from_{self.pair[1]}', self.pair[0], self.value, ''),)

    def distort(self, signals: Signals, robot: Robot) -> Signals:
        tau = signals.tau.copy()
        listener, source = (robot.index(joint) for joint in self.pair)
        tau[:, listener] += self.value * signals.tau[:, source]
        return replace(signals, tau=tau)


class TorqueLag(_Reading):
    """The reading is low-passed, first order, exact for a torque linear between the steps."""

    name = 'torque_lag'
    ordinary, by_torque, loaded = 0.01, 0, 0.05
    stated = (('lag', 'value', 's'),)

    def reading(self, t: FloatArray, tau: FloatArray) -> FloatArray:
        return low_pass(tau, self.value, t[1] - t[0])


@dataclass(frozen=True)
class TimeDelay(HiddenEffect):
    """Torque readings are older than the positions they come with: interpolated back."""

    name = 'time_delay'
    stated = (('delay', 'value', 's'),)
    value: float

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        return cls(0.004)

    def distort(self, signals: Signals, robot: Robot) -> Signals:
        past = signals.t - self.value
        return replace(signals, tau=sampled(past, signals.t, signals.tau))


class EncoderOffset(OneJoint):
    """The encoder reads too little by a constant."""

    name = 'encoder_offset'
    ordinary, by_torque, signed, first_joint = 0.02, 0, True, 1
    stated = (('encoder_offset', 'value', 'rad'),)
    rigid = True

    def distort(self, signals: Signals, robot: Robot) -> Signals:
        q = signals.q.copy()
        q[:, self.index] -= self.value
        return replace(signals, q=q)
