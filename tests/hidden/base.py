# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What it takes to hide an effect: four places where it may act, all of them empty by default.

An effect edits the description before MuJoCo compiles it, sets values of the compiled model, acts
at every step, or distorts what the sensors show. Nothing here is shared with the package under
test: the formulas of the effects are written a second time, in the direction of cause.

"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar, Self

from armid_ros.robots import Robot
import mujoco
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from tests.hidden.arrays import FloatArray, OfJoint, Signals, Sized


@dataclass(frozen=True)
class Setting:
    """
    What an effect is drawn for, so that its size suits the arm and its motion.

    Attributes
    ----------
    robot : Robot
        With the true rigid parameters.
    strength : ndarray, shape (n,)
        Size of each drive [N m].
    low, high : ndarray, shape (n,)
        Smallest and largest position in all motions [rad].
    speed : ndarray, shape (n,)
        Largest speed in all motions [rad/s].
    torque : ndarray, shape (n,)
        Rms torque of the rigid arm in all motions [N m].
    peak : ndarray, shape (n,)
        Largest torque of the rigid arm and its known friction in all motions [N m].
    postures : ndarray, shape (K, n)
        Positions throughout all motions [rad].

    """

    robot: Robot
    strength: FloatArray
    low: FloatArray
    high: FloatArray
    speed: FloatArray
    torque: FloatArray
    peak: FloatArray
    postures: FloatArray

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints."""
        return self.robot.joints

    def pick(self, rng: np.random.Generator, *, loaded: float = 0.0, first: int = 0) -> int:
        """Pick a joint, none before the first; or one with a share of the largest torque."""
        if loaded:
            return int(rng.choice(np.flatnonzero(self.torque > loaded * self.torque.max())))
        return int(rng.integers(first, self.robot.n_joints))

    def points(
        self, joint: int, offset: FloatArray, postures: FloatArray | None = None
    ) -> FloatArray:
        """Return where a point of the link of a joint comes to in the base frame, (K, 3) [m]."""
        data = self.robot.model.createData()
        places = []
        for q in self.postures if postures is None else postures:
            pin.forwardKinematics(self.robot.model, data, q)
            places.append(data.oMi[joint + 1].act(offset))
        return np.array(places)


@dataclass
class Live:
    """
    The arm while it moves.

    Attributes
    ----------
    robot : Robot
        Gives names and order of the joints.
    model, data : mujoco.MjModel, mujoco.MjData
        The arm.
    dofs : ndarray of int, shape (n,)
        Degree of freedom in MuJoCo of every joint of the robot.
    friction : ndarray, shape (n,)
        Dry friction torque of this step, to which effects add [N m].
    applied : ndarray, shape (n,)
        Torque on the joints of this step, to which effects add [N m].
    load : ndarray, shape (n,)
        Torque of the rigid arm in the step before [N m].

    """

    robot: Robot
    model: mujoco.MjModel
    data: mujoco.MjData
    dofs: npt.NDArray[np.intp]
    friction: FloatArray
    applied: FloatArray
    load: FloatArray
    memory: dict[int, FloatArray] = field(default_factory=dict)

    @classmethod
    def of(cls, robot: Robot, model: mujoco.MjModel) -> Live:
        """Return a compiled arm that has not moved yet."""
        dofs = np.array([model.joint(joint).qposadr[0] for joint in robot.joints])
        zero = np.zeros((3, robot.n_joints))
        return cls(robot, model, mujoco.MjData(model), dofs, *zero)

    @property
    def dt(self) -> float:
        """Time step [s]."""
        return float(self.model.opt.timestep)

    @property
    def t(self) -> float:
        """Time since the recording began [s]."""
        return float(self.data.time)

    @property
    def q(self) -> FloatArray:
        """Positions, shape (n,)."""
        return self.data.qpos[self.dofs]

    @property
    def dq(self) -> FloatArray:
        """Velocities, shape (n,)."""
        return self.data.qvel[self.dofs]


class HiddenEffect(Sized, ABC):
    """One hidden effect with its true parameters."""

    #: Name in the catalogue, or of something the catalogue does not have.
    name: ClassVar[str]
    #: Whether the parameters of the rigid body explain it, once they are free.
    rigid: ClassVar[bool] = False
    #: Names in the catalogue of what it is a limit of: they make the same torque.
    limit_of: ClassVar[tuple[str, ...]] = ()
    #: Whether it acts at every step; those that do not cost no time.
    acts: ClassVar[bool] = False
    #: Whether it repeats from period to period.
    repeats: ClassVar[bool] = True
    #: Whether the catalogue has it.
    in_catalogue: ClassVar[bool] = True
    #: Known effects that the nominal model must lack, as this is one of them.
    replaces: ClassVar[tuple[str, ...]] = ()
    #: Known effects that the plant must have.
    needs: ClassVar[tuple[str, ...]] = ()
    #: Step of the integration [s].
    dt: ClassVar[float] = 1e-3

    joints: tuple[str, ...] = ()

    @classmethod
    @abstractmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        """Draw one of ordinary size in a joint, a pair or the whole arm."""

    def edit(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        """Change the description of the arm."""

    def prepare(self, live: Live) -> None:
        """Change the compiled model."""

    def act(self, live: Live) -> None:
        """Add torque or friction in this step."""

    def distort(self, signals: Signals, robot: Robot) -> Signals:
        """Change what the sensors show."""
        return signals


class OneJoint(OfJoint, HiddenEffect):
    """An effect in one joint with one value that the gap goes by."""


@dataclass(frozen=True)
class InPair(HiddenEffect):
    """An effect in a pair of joints."""

    pair: tuple[str, str]
    value: float

    @property
    def joints(self) -> tuple[str, ...]:
        return self.pair
