# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What travels through the hidden-effect generator: arrays of joint signals over time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

FloatArray = npt.NDArray[np.float64]
#: Name and unit of the ten parameters of a body.
BODY = {
    **{'m': 'kg', 'mx': 'kg m', 'my': 'kg m', 'mz': 'kg m'},
    **dict.fromkeys(('Ixx', 'Ixy', 'Iyy', 'Ixz', 'Iyz', 'Izz'), 'kg m^2'),
}


@dataclass(frozen=True)
class Signals:
    """
    Joint signals as a perfect instrument would show them, on the time base of the plant.

    Attributes
    ----------
    t : ndarray, shape (N,)
        Time [s], evenly spaced.
    q, dq, ddq : ndarray, shape (N, n)
        Position, velocity, acceleration of the joints, before the gear's elasticity.
    tau : ndarray, shape (N, n)
        Torque that the torque sensor is to show [N m].
    command : ndarray, shape (N, n)
        Torque that the drives are asked for [N m].

    """

    t: FloatArray
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    tau: FloatArray
    command: FloatArray

    @property
    def dt(self) -> float:
        """Time between samples [s]."""
        return float(self.t[1] - self.t[0])


@dataclass(frozen=True)
class Parameter:
    """
    A true parameter of a hidden effect.

    Attributes
    ----------
    name, unit : str
        As in the catalogue of effects.
    joint : str
        The joint it belongs to; empty for the whole arm.
    value : float
        True value.

    """

    name: str
    joint: str
    value: float
    unit: str


class Sized:
    """What has true parameters and grows by one of its attributes; a base of dataclasses."""

    #: The attribute that is larger where the gap is to be.
    sized_by: ClassVar[str] = 'value'
    #: Name in the catalogue, attribute and unit of every true parameter.
    stated: ClassVar[tuple[tuple[str, str, str], ...]] = ()

    def scaled(self, factor: float) -> Self:
        """Return it larger by a factor, or its like of which the gap grows with the factor."""
        return replace(self, **{self.sized_by: getattr(self, self.sized_by) * factor})

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return the true parameters, as the catalogue names them."""
        joint = getattr(self, 'joint', '')
        return tuple(
            Parameter(name, joint, getattr(self, attribute), unit)
            for name, attribute, unit in self.stated
        )


def named_body(label: str, joint: str, values: FloatArray) -> tuple[Parameter, ...]:
    """Return the ten parameters of a body, named after a label with a place for each name."""
    return tuple(
        Parameter(label.format(name), joint, float(value), unit)
        for (name, unit), value in zip(BODY.items(), values, strict=True)
    )


def sampled(times: FloatArray, t: FloatArray, values: FloatArray) -> FloatArray:
    """Return signals (N, n) at other times."""
    return np.column_stack([np.interp(times, t, column) for column in values.T])


def coloured_noise(shape: tuple[int, ...], lasting: float, rng: np.random.Generator) -> FloatArray:
    """Return noise of variance 1, half white and half correlated over a number of samples."""
    decay = np.exp(-1.0 / lasting)
    start = rng.normal(size=(1, shape[1]))
    steps = np.sqrt(1.0 - decay**2) * rng.normal(size=shape)
    slow, _ = lfilter([1.0], [1.0, -decay], steps, axis=0, zi=decay * start)
    return np.asarray(np.sqrt(0.5) * (slow + rng.normal(size=shape)))
