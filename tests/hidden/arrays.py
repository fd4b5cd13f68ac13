# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What travels through the hidden-effect generator: arrays of joint signals over time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

FloatArray = npt.NDArray[np.float64]
#: When recordings begin.
START_NS = 1_700_000_000_000_000_000
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


@dataclass(frozen=True)
class KnownEffect:
    """
    An effect that the model given to the diagnosis has.

    Attributes
    ----------
    name : str
        As in the catalogue.
    joints : tuple of str
        The joints it is known of.
    values : ndarray, shape (number of joints,), or None
        Values that the model has; None where it is given by name only.

    """

    name: str
    joints: tuple[str, ...]
    values: FloatArray | None


class Sized:
    """What has true parameters and one value that the gap goes by; a base of dataclasses."""

    #: Ordinary value over the drive's torque and the joint's speed, to these powers.
    ordinary: ClassVar[float]
    by_torque: ClassVar[int] = 1
    by_speed: ClassVar[int] = 0
    #: Whether the value has either sign.
    signed: ClassVar[bool] = False
    #: Share of the largest torque that its joint carries, and the first joint that it may be in.
    loaded: ClassVar[float] = 0.0
    first_joint: ClassVar[int] = 0
    #: Name in the catalogue, attribute and unit of every true parameter.
    stated: ClassVar[tuple[tuple[str, str, str], ...]] = ()
    value: float

    def scaled(self, factor: float) -> Self:
        """Return it larger by a factor, or its like of which the gap grows with the factor."""
        return replace(self, value=self.value * factor)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return the true parameters, as the catalogue names them."""
        joint = getattr(self, 'joint', '')
        return tuple(
            Parameter(name, joint, getattr(self, attribute), unit)
            for name, attribute, unit in self.stated
        )


@dataclass(frozen=True)
class OfJoint(Sized):
    """What is in one joint."""

    joint: str
    index: int
    value: float

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of its joints."""
        return (self.joint,)

    @classmethod
    def draw(cls, scene: Any, rng: np.random.Generator) -> Self:
        """Draw one of ordinary size, for joints of some strength and speed [N m, rad/s]."""
        j = scene.pick(rng, loaded=cls.loaded, first=cls.first_joint)
        value = rng.choice([-1.0, 1.0]) * cls.ordinary if cls.signed else cls.ordinary
        value = value * scene.strength[j] ** cls.by_torque / scene.speed[j] ** cls.by_speed
        return cls(scene.joints[j], j, float(value), *cls.drawn(scene, j, rng))

    @classmethod
    def drawn(cls, scene: Any, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        """Draw what it has beside its value."""
        return ()


@dataclass(frozen=True)
class Ball(OfJoint):
    """A body fixed to a link, of equal inertia about all axes; the value is its mass [kg]."""

    #: What the names of the ten parameters are made of.
    label: ClassVar[str]
    #: Inertia over mass times squared radius.
    share: ClassVar[float] = 0.4
    centre: tuple[float, float, float]
    radius: float

    @property
    def inertia(self) -> float:
        """Inertia about any axis through the centre of mass [kg m^2]."""
        return self.share * self.value * self.radius**2

    @property
    def body(self) -> FloatArray:
        """Its ten parameters about the frame of the joint."""
        return body_vector(self.value, np.array(self.centre), self.inertia * np.eye(3))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(self.label.format(name), self.joint, float(value), unit)
            for (name, unit), value in zip(BODY.items(), self.body, strict=True)
        )


@dataclass(frozen=True)
class Tilted(Sized):
    """What turns the base about a horizontal axis by an angle along x and y [rad]."""

    name = 'base_tilt'
    tilt: tuple[float, float]

    def scaled(self, factor: float) -> Self:
        return replace(self, tilt=(self.tilt[0] * factor, self.tilt[1] * factor))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        x, y = self.tilt
        return Parameter('tilt_x', '', x, 'rad'), Parameter('tilt_y', '', y, 'rad')

    def seen(self, gravity: FloatArray) -> FloatArray:
        """Return gravity as the turned base sees it, shape (3,)."""
        return Rotation.from_rotvec([*self.tilt, 0.0]).inv().apply(gravity)


def spring_parameters(joint: str, stiffness: float, rest: float) -> tuple[Parameter, ...]:
    """Return the parameters of a spring across a joint that is at rest at a position."""
    return (
        Parameter('spring_stiffness', joint, stiffness, 'N m/rad'),
        Parameter('spring_preload', joint, -stiffness * rest, 'N m'),
    )


def holding_parameters(
    joint: str, stiffness: float, damping_time: float, way: FloatArray
) -> tuple[Parameter, ...]:
    """Return the parameters of a spring and a damper to a place, for its way from the middle."""
    return (
        Parameter('interaction_stiffness', joint, stiffness, 'N/m'),
        Parameter('interaction_damping', joint, stiffness * damping_time, 'N s/m'),
        *force_parameters(joint, stiffness * way),
    )


def force_parameters(joint: str, force: FloatArray) -> tuple[Parameter, ...]:
    """Return the parameters of a force on a link, shape (3,) [N]."""
    return tuple(
        Parameter(f'interaction_force_{axis}', joint, float(value), 'N')
        for axis, value in zip('xyz', force, strict=True)
    )


def body_vector(mass: float, centre: FloatArray, central: FloatArray) -> FloatArray:
    """Return mass, first moments and inertia about the origin of the frame, shape (10,)."""
    about = central + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return np.concatenate([[mass], mass * centre, about[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]])


def body_parts(body: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Return mass, centre and inertia about the centre of a body."""
    mass = float(body[0])
    centre = body[1:4] / mass if mass else np.zeros(3)
    return (
        mass,
        centre,
        symmetric(body[4:]) - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre)),
    )


def symmetric(values: FloatArray) -> FloatArray:
    """Return the symmetric matrix of xx, xy, yy, xz, yz, zz."""
    xx, xy, yy, xz, yz, zz = values
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


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


def low_pass(tau: FloatArray, lag: float, step: float) -> FloatArray:
    """Return torques behind a first-order low-pass, exact if linear between the samples."""
    if lag <= 0.0:
        return tau
    ratio = step / lag
    decay = np.exp(-ratio)
    newest = 1.0 - (1.0 - decay) / ratio
    numerator = np.array([newest, 1.0 - decay - newest])
    start = tau[:1] * (1.0 - newest)
    filtered, _ = lfilter(numerator, [1.0, -decay], tau, axis=0, zi=start)
    return filtered


def smooth_step(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the smooth step and its derivatives."""
    return (
        x**3 * (10.0 - 15.0 * x + 6.0 * x**2),
        30.0 * x**2 * (1.0 - x) ** 2,
        60.0 * x * (1.0 - x) * (1.0 - 2.0 * x),
    )
