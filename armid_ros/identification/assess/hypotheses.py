# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What may be wrong with a recording: each a change of the data that would put it right.

A hypothesis changes the motion, or leaves some values free that the torque is linear in. It is
believed if the arm then predicts data that were not used for the fit far better; nothing here
decides that.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import ClassVar

from armid_ros.identification.assess.grade_limits import GradeLimits
from armid_ros.identification.assess.hypothesis import changed, Hypothesis, Quantity, scaled
from armid_ros.identification.rows.checks import (
    effort_unit,
    FOLLOWS,
    torque_factors,
    TORQUE_UNITS,
    unit_of,
)
from armid_ros.model import gravity_sensitivity, inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import GRAVITIES, Robot
import numpy as np

#: Angles that the zero of a joint may be off by [degrees]: an encoder's, an axis', a drawing's.
TURNS = (-135.0, -90.0, -45.0, 45.0, 90.0, 135.0, 180.0)
QUANTITIES: tuple[Quantity, ...] = ('position and torque', 'position', 'torque')
#: Gravity of Jupiter [m/s^2]: no arm stands where there is more.
_STRONGEST = 24.8
#: Free values that are within this of an axis [degrees] are written as that axis.
_AXIS = 15.0


@dataclass(frozen=True)
class AsRecorded(Hypothesis):
    """Nothing is wrong."""

    values: ClassVar[int] = 0

    def sentence(self, robot: Robot) -> str:
        """Say so."""
        return 'the data are as they should be'


@dataclass(frozen=True)
class WithoutBody(Hypothesis):
    """The description says nothing of this arm: friction and drives take all there is."""

    values: ClassVar[int] = 0

    def torque(self, robot: Robot, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """Leave the body out."""
        return np.zeros_like(motion.q), np.empty((*motion.q.shape, 0))

    def sentence(self, robot: Robot) -> str:
        """Say so."""
        return 'the description says nothing of the torques'


@dataclass(frozen=True)
class Reversed(Hypothesis):
    """Position, torque or both of a joint have the opposite sign."""

    joint: int
    quantity: Quantity

    def motion(self, motion: Motion) -> Motion:
        """Turn the sign of the joint."""
        return scaled(motion, self.joint, self.quantity, -1.0)

    def sentence(self, robot: Robot) -> str:
        """Name the joint."""
        joint = robot.joints[self.joint]
        if self.quantity == 'position and torque':
            return f'position and torque of {joint} seem to have the opposite sign: negate both'
        return f'the {self.quantity} of {joint} seems to have the opposite sign: negate it'


@dataclass(frozen=True)
class Exchanged(Hypothesis):
    """Two joints have each other's position, torque or both."""

    first: int
    second: int
    quantity: Quantity

    def motion(self, motion: Motion) -> Motion:
        """Exchange them back."""
        order = np.arange(motion.n_joints)
        order[[self.first, self.second]] = order[[self.second, self.first]]
        return changed(motion, self.quantity, lambda values: values[:, order])

    def sentence(self, robot: Robot) -> str:
        """Name the joints."""
        a, b = robot.joints[self.first], robot.joints[self.second]
        return (
            f'the {self.quantity} of {a} and of {b} seem to be exchanged: check the names of '
            'the joints'
        )


@dataclass(frozen=True)
class ZeroOff(Hypothesis):
    """The zero of a joint is not that of the description."""

    joint: int
    degrees: float

    def motion(self, motion: Motion) -> Motion:
        """Shift the position back."""
        shift = np.zeros(motion.n_joints)
        shift[self.joint] = -np.deg2rad(self.degrees)
        return replace(motion, q=motion.q + shift)

    def nearby(self) -> Iterator[Hypothesis]:
        """Yield angles in steps of 15 degrees."""
        for step in (-15.0, 15.0):
            yield replace(self, degrees=self.degrees + step)

    def sentence(self, robot: Robot) -> str:
        """Name the joint and the angle."""
        wrong = 180.0 - (180.0 - self.degrees) % 360.0
        remedy = f'{"subtract" if wrong > 0 else "add"} {np.deg2rad(abs(wrong)):.4g} rad'
        return (
            f'the zero of {robot.joints[self.joint]} seems to be off by about {wrong:.0f} '
            f'degrees: {remedy}'
        )


@dataclass(frozen=True)
class LateTorque(Hypothesis):
    """
    Torque comes later than the position that it belongs to, or earlier.

    Attributes
    ----------
    seconds : float
        By how much [s]; negative for earlier.
    half_width : float
        Of the 95 % interval [s].

    """

    seconds: float
    half_width: float = 0.0

    def motion(self, motion: Motion) -> Motion:
        """
        Take the motion of the time that the torque belongs to.

        The torque stays as it is, for its noise would be less between samples.

        """
        t = motion.t - self.seconds
        inside = (t >= motion.t[0]) & (t <= motion.t[-1])
        q, dq, ddq = (
            np.column_stack([np.interp(t, motion.t, column) for column in x.T])
            for x in (motion.q, motion.dq, motion.ddq)
        )
        return replace(motion, q=q, dq=dq, ddq=ddq).select(inside)

    def sentence(self, robot: Robot) -> str:
        """Say by how much."""
        side = 'later' if self.seconds > 0.0 else 'earlier'
        return (
            f'the torque seems to come about {1e3 * abs(self.seconds):.0f} ms {side} than the '
            f'position (+- {np.ceil(1e3 * self.half_width):.0f} ms): stamp both alike'
        )


@dataclass(frozen=True)
class InDegrees(Hypothesis):
    """Positions are in degrees: those of all joints that turn, or of one."""

    joint: int | None = None

    def possible(self, motions: Sequence[Motion]) -> bool:
        """Whether some position is beyond a turn, as an arm that moves by a few degrees has it."""
        joint = slice(None) if self.joint is None else self.joint
        return max(float(np.abs(one.q[:, joint]).max()) for one in motions) > 2.0 * np.pi

    def motion(self, motion: Motion) -> Motion:
        """Convert them."""
        joint = slice(None) if self.joint is None else self.joint
        return scaled(motion, joint, 'position', np.deg2rad(1.0))

    def sentence(self, robot: Robot) -> str:
        """Name the joint, if it is one alone."""
        if self.joint is None:
            return 'the positions seem to be in degrees: convert them to rad'
        joint = robot.joints[self.joint]
        return f'the position of {joint} seems to be in degrees: convert it to rad'


@dataclass(frozen=True)
class OtherGravity(Hypothesis):
    """Gravity is not the vector of the description; torque is linear in it, so data give it."""

    values: ClassVar[int] = 3
    of_masses: ClassVar[bool] = True

    vector: tuple[float, float, float] = (np.nan, np.nan, np.nan)

    def torque(self, robot: Robot, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """Leave gravity free."""
        weightless = robot.with_gravity(np.zeros(3))
        return inverse_dynamics(weightless, motion), gravity_sensitivity(robot, motion.q)

    def settled(self, values: FloatArray) -> Hypothesis:
        """Return the vector that fits."""
        return OtherGravity((float(values[0]), float(values[1]), float(values[2])))

    def material(self, robot: Robot, limits: GradeLimits) -> bool:
        """
        Whether it is too far from the description to be wrong masses, and may be a planet's.

        Masses make all weight larger or smaller, and turn it nowhere.

        """
        told, found = robot.gravity, np.array(self.vector)
        size, length = (float(np.linalg.norm(vector)) for vector in (told, found))
        if not limits.gravity_change * max(size, 1.0) < np.linalg.norm(found - told):
            return False
        weighs = length / size if size > 0.0 else np.inf
        turned = np.linalg.norm(found / max(length, 1e-9) - told / max(size, 1e-9))
        turns = turned > limits.gravity_change
        return length < _STRONGEST and bool(turns or _beyond_masses(weighs, limits))

    def sentence(self, robot: Robot) -> str:
        """Say the direction and the option that puts it right."""
        axis, option = known_gravity(np.array(self.vector), robot.gravity)
        direction = ', '.join(f'{part:.3g}' for part in axis)
        size = float(np.linalg.norm(self.vector))
        return (
            f'gravity seems to act along ({direction}) of the base with {size:.3g} m/s^2: '
            f'--gravity {option}'
        )


@dataclass(frozen=True)
class OtherUnit(Hypothesis):
    """
    Efforts are a factor from N m: a unit where it is that of every joint, else currents.

    Attributes
    ----------
    factor : float
        Of all joints together.
    of_joints : tuple of float
        Of each joint, NaN where its torque does not show it.

    """

    of_masses: ClassVar[bool] = True

    factor: float = np.nan
    of_joints: tuple[float, ...] = ()

    @property
    def disputable(self) -> bool:
        """Whether it is no unit, and masses may be what is wrong."""
        return not self._unit

    @property
    def _unit(self) -> str:
        return unit_of(self.factor, [one for one in self.of_joints if one > 0.0])

    def torque(self, robot: Robot, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """Leave the factor free."""
        described = inverse_dynamics(robot, motion)
        return np.zeros_like(described), described[:, :, np.newaxis]

    def settled(self, values: FloatArray) -> Hypothesis:
        """Return the factor that fits."""
        return OtherUnit(float(values[0]))

    def detailed(self, robot: Robot, motions: Sequence[Motion]) -> Hypothesis:
        """Return the factor of each joint, too."""
        torques = [motion.tau for motion in motions if motion.tau is not None]
        factors, correlation = torque_factors(robot, motions, torques)
        return replace(self, of_joints=tuple(np.where(correlation > FOLLOWS, factors, np.nan)))

    def material(self, robot: Robot, limits: GradeLimits) -> bool:
        """Whether it is too far from one for masses to be what is wrong."""
        return _beyond_masses(self.factor, limits)

    def sentence(self, robot: Robot) -> str:
        """Say the unit, or else the factor, and the gain of each joint."""
        if self._unit:
            return (
                f'the efforts of all joints seem to be in {self._unit} instead of N m: convert '
                'them'
            )
        gains = ','.join(
            f'{1.0 / (one if one > 0.0 else self.factor):.3g}'
            for one in self.of_joints or (self.factor,)
        )
        return (
            f'the efforts of all joints seem to be {self.factor:.2g} times the torque in N m '
            '(currents?): convert them, unless it is the masses of the description; by those they '
            f'need --current-gain {gains}'
        )


@dataclass(frozen=True)
class InUnit(Hypothesis):
    """The torque of a joint is in another unit; no load makes it a thousand times as large."""

    joint: int
    unit: str

    def motion(self, motion: Motion) -> Motion:
        """Convert it."""
        return scaled(motion, self.joint, 'torque', 1.0 / TORQUE_UNITS[self.unit])

    def sentence(self, robot: Robot) -> str:
        """Name the joint and the unit."""
        joint, right = robot.joints[self.joint], robot.torque_units[self.joint]
        wrong = effort_unit(robot, self.joint, self.unit)
        return f'the torque of {joint} seems to be in {wrong} instead of {right}: convert it'


@dataclass(frozen=True)
class Faulty(Hypothesis):
    """
    A few samples are wrong: a torque far out of the rest, a position that jumps.

    Attributes
    ----------
    what : str
        The first of them, in words.
    count : int
        How many there are.
    without : tuple of Motion
        The recording without them.

    """

    what: str
    count: int
    without: tuple[Motion, ...] = field(repr=False, compare=False)

    def stretches(self, stretches: Sequence[Motion]) -> list[Motion]:
        """Return the recording without faulty samples."""
        return list(self.without)

    def sentence(self, robot: Robot) -> str:
        """Say how many, and where the first is."""
        many = '' if self.count == 1 else f' (the first of {self.count})'
        return f'{self.what}{many}: leave out what is faulty, or record again'


def hypotheses(robot: Robot) -> Iterator[Hypothesis]:
    """Yield what may be wrong with any recording of an arm, but for delays and faulty samples."""
    yield OtherGravity()
    yield OtherUnit()
    if not np.all(robot.prismatic):
        yield InDegrees()
    for joint in range(robot.n_joints):
        yield from _of_joint(robot, joint)
    for first, second in combinations(range(robot.n_joints), 2):
        for quantity in QUANTITIES:
            yield Exchanged(first, second, quantity)


def _of_joint(robot: Robot, joint: int) -> Iterator[Hypothesis]:
    for unit in TORQUE_UNITS:
        yield InUnit(joint, unit)
    for quantity in QUANTITIES:
        yield Reversed(joint, quantity)
    if robot.prismatic[joint]:
        return
    if robot.n_joints > 1:
        yield InDegrees(joint)
    for degrees in TURNS:
        yield ZeroOff(joint, degrees)


def _beyond_masses(factor: float, limits: GradeLimits) -> bool:
    """Whether masses are not off by a factor, all of them."""
    return not 1.0 / limits.torque_factor < factor < limits.torque_factor


def known_gravity(vector: FloatArray, told: FloatArray) -> tuple[FloatArray, str]:
    """
    Write a gravity vector that was found as a person would.

    Parameters
    ----------
    vector : ndarray, shape (3,)
        As it was found [m/s^2].
    told : ndarray, shape (3,)
        As described; its magnitude is kept where the estimated one is close.

    Returns
    -------
    direction : ndarray, shape (3,)
        Unit vector; that of an axis where it is near.
    option : str
        What to give to --gravity.

    """
    size = float(np.linalg.norm(vector))
    direction = vector / size
    axis = np.round(direction)
    if np.count_nonzero(axis) == 1 and direction @ axis > np.cos(np.deg2rad(_AXIS)):
        direction = axis + 0.0
    sizes = [float(np.linalg.norm(told)), *(-value[2] for value in GRAVITIES.values())]
    near = min(sizes, key=lambda known: abs(np.log(size / max(known, 1e-9))))
    size = near if 0.75 < size / max(near, 1e-9) < 1.33 else size
    for name, value in GRAVITIES.items():
        if np.allclose(size * direction, value, atol=1e-6):
            return direction, name
    return direction, ','.join(f'{part:.3g}' for part in size * direction + 0.0)
