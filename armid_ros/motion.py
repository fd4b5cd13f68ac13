# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Joint motion on one time base: the input of models, effects and simulators."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from armid_ros.errors import RecordingError
import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Samples = slice | npt.NDArray[np.intp] | npt.NDArray[np.bool_]


def read_only(values: npt.ArrayLike) -> FloatArray:
    """
    Return values as a contiguous float64 array that cannot be written to.

    An array that is already a read-only view of immutable memory is not copied.

    """
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.flags.writeable:
        array = array.view() if array is not values else array.copy()
        array.setflags(write=False)
    return array


def freeze(instance: object, *names: str) -> None:
    """Make the named array attributes of a frozen dataclass instance read-only."""
    for name in names:
        if getattr(instance, name) is not None:
            object.__setattr__(instance, name, read_only(getattr(instance, name)))


def freeze_samples(where: str, samples: Any, *names: str) -> None:
    """Make the named arrays of `samples` read-only; RecordingError unless of shape (N, n)."""
    freeze(samples, 't', *names)
    expected = (len(samples.t), len(samples.joints))
    for name in names:
        values = getattr(samples, name)
        if values is not None and values.shape != expected:
            raise RecordingError(
                f'{where}: {name} has shape {values.shape}, but the {expected[0]} times and '
                f'{expected[1]} joints need {expected}'
            )
    heat = samples.temperature
    if heat is not None and heat.values.shape != (len(heat.t), len(samples.joints)):
        raise RecordingError(
            f'{where}: temperatures have shape {heat.values.shape}, but their {len(heat.t)} times '
            f'and {len(samples.joints)} joints need {(len(heat.t), len(samples.joints))}'
        )


def selected(instance: object, samples: Samples, *names: str) -> dict[str, Any]:
    """Return the named arrays of an object at the selected samples; missing arrays stay None."""
    arrays = {name: getattr(instance, name) for name in names}
    return {name: None if array is None else array[samples] for name, array in arrays.items()}


@dataclass(frozen=True)
class MovingPoints:
    """
    Positions and velocities of points on another machine or on a person.

    Attributes
    ----------
    names : tuple of str
        Names of the S points.
    position, velocity : ndarray, shape (N, S, 3)
        Position and velocity in the base frame of the arm, at the samples of its motion [m, m/s].

    """

    names: tuple[str, ...]
    position: FloatArray
    velocity: FloatArray

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        freeze(self, 'position', 'velocity')

    def select(self, samples: Samples) -> MovingPoints:
        """Return the positions and velocities at selected samples."""
        return replace(self, **selected(self, samples, 'position', 'velocity'))


@dataclass(frozen=True, eq=False)
class Temperatures:
    """
    Temperatures of joints or motors, usually measured less often than the motion.

    Attributes
    ----------
    t : ndarray, shape (K,)
        Time [s], strictly increasing, on the time base of the motion.
    values : ndarray, shape (K, n)
        Temperature of each joint [degC]; nan for a joint without a sensor.

    """

    t: FloatArray
    values: FloatArray

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        freeze(self, 't', 'values')

    def at(self, t: npt.ArrayLike) -> FloatArray:
        """Return temperatures at times `t`, (N, n) [degC]; constant outside the readings."""
        return np.column_stack([np.interp(np.ravel(t), self.t, one) for one in self.values.T])


@dataclass(frozen=True)
class Motion:
    """
    Joint motion sampled on one time base, with or without measured torque.

    Attributes
    ----------
    joints : tuple of str
        Joint names in column order, n of them.
    t : ndarray, shape (N,)
        Time [s], strictly increasing.
    q, dq, ddq : ndarray, shape (N, n)
        Position [rad or m], velocity, acceleration.
    tau : ndarray, shape (N, n), or None
        Actuator torque [N m] or force [N], positive along the URDF joint axis; None for a
        reference motion without measurement.
    band_hz : float
        Frequency above which second derivatives of torques along measured positions are mostly
        noise; infinite for a reference.
    partner : MovingPoints or None
        Points of a partner that were recorded with the arm.
    temperature : Temperatures or None
        Measured temperatures of the joints.

    Examples
    --------
    >>> import armid_ros as ar
    >>> import numpy as np
    >>> t = np.linspace(0.0, 1.0, 101)
    >>> q = np.sin(t)[:, None]
    >>> motion = ar.Motion(('hinge',), t, q, np.cos(t)[:, None], -q)
    >>> len(motion), motion.n_joints
    (101, 1)

    """

    joints: tuple[str, ...]
    t: FloatArray
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    tau: FloatArray | None = None
    band_hz: float = field(default=np.inf, kw_only=True)
    partner: MovingPoints | None = field(default=None, kw_only=True)
    temperature: Temperatures | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        """Make the arrays read-only; RecordingError if their shapes differ."""
        freeze_samples('motion', self, 'q', 'dq', 'ddq', 'tau')

    @classmethod
    def of_states(
        cls, joints: tuple[str, ...], q: npt.ArrayLike, dq: npt.ArrayLike, ddq: npt.ArrayLike
    ) -> Motion:
        """Return a motion whose samples are independent states, 1 s apart."""
        parts = np.broadcast_arrays(np.atleast_2d(q), dq, ddq)
        return cls(joints, np.arange(len(parts[0]), dtype=float), *map(np.array, parts))

    def __len__(self) -> int:
        """Return the number of samples N."""
        return len(self.t)

    @property
    def n_joints(self) -> int:
        """Return the number of joints n."""
        return len(self.joints)

    def select(self, samples: Samples) -> Motion:
        """Return the motion at selected samples only; the times of these samples are unchanged."""
        partner = None if self.partner is None else self.partner.select(samples)
        arrays = selected(self, samples, 't', 'q', 'dq', 'ddq', 'tau')
        return replace(self, **arrays, partner=partner)

    def at_rest(self) -> Motion:
        """Return the motion with its positions, but zero velocity and acceleration."""
        zero = np.zeros_like(self.q)
        return replace(self, dq=zero, ddq=zero)

    def with_torque(self, tau: npt.ArrayLike | None) -> Motion:
        """Return the motion with another measured torque, shape (N, n) [N m or N]."""
        return replace(self, tau=None if tau is None else read_only(tau))


@dataclass(frozen=True)
class BlurredMotion(Motion):
    """
    Motion in which tanh(dq / width) replaces the sign of joint velocities.

    A search for trajectories needs a gradient, which the sign of a velocity does not have.

    Attributes
    ----------
    width : ndarray, shape (n,)
        Velocity below which the direction is blurred [rad/s or m/s].

    """

    width: FloatArray = field(kw_only=True)

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        super().__post_init__()
        object.__setattr__(self, 'width', read_only(self.width))


@dataclass(frozen=True, eq=False)
class ElasticRun:
    """
    Motor, link and reference signals of one experiment with an elastic arm.

    Attributes
    ----------
    motor, link : Motion
        Motion of the motors, converted to the joints, and of the links. The torque of the motors
        is that of the drives [N m], constant between samples; the links have no torque.
    reference : ndarray, shape (N, n)
        Reference of the velocity loop [rad/s].
    integral : ndarray, shape (n,), or None
        Initial value of the integral of the loop [rad]; None for zero. If a motor sticks, the
        integral stays from one experiment to the next.
    felt : ndarray, shape (n, N, 3), or None
        Readings of the accelerometers on the links [m/s^2]; None if they were not read.

    """

    motor: Motion
    link: Motion
    reference: FloatArray
    integral: FloatArray | None = None
    felt: FloatArray | None = None
