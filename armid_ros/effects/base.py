# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What an effect is: one physical cause of joint torque beside the rigid body.

An effect is written once and used three times. The simulator asks how it acts (``action``), the
identifier how the torques depend on its parameters (``columns``), the diagnosis whether that
dependence explains a residual. An effect of the joints has its quantities once per joint; an
effect of the whole arm has no joints and its quantities once.

Quantities are amplitudes: the torque is linear in them, or nearly so. What it is not linear in,
such as a Stribeck velocity, is a shape: it belongs to the effect, which has columns with it.

"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar, Protocol, Self

from armid_ros.effects.action import Action, Displacement
from armid_ros.effects.quantities import joint_unit, Quantity, Shape
from armid_ros.effects.traits import TRAITS, Traits
from armid_ros.effects.unexplained import Unexplained
from armid_ros.errors import meant, ModelError
from armid_ros.estimate import ParameterName
from armid_ros.model import LinkFrames
from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Effect(ABC):
    """
    One kind of effect on some joints of an arm.

    Attributes
    ----------
    joints : tuple of str
        The joints it acts on; empty for an effect of the whole arm.
    shape : tuple of float
        Shape parameters, owner by owner; the defaults if none are given.

    Examples
    --------
    >>> import armid_ros as ar
    >>> from armid_ros.effects import joint_columns
    >>> class Hose(ar.Effect):
    ...     name = 'hose'
    ...     summary = 'hose that stiffens as it bends'
    ...     quantities = (ar.Quantity('hose_stiffness', 'N m/rad^3'),)
    ...
    ...     def columns(self, motion, arm):
    ...         return joint_columns(self, motion, motion.q**3)
    >>> Hose.on(ar.load_robot('my_arm.urdf'), ('elbow',)).joints
    ('elbow',)

    """

    joints: tuple[str, ...] = ()
    shape: tuple[float, ...] = ()

    name: ClassVar[str]
    summary: ClassVar[str]
    quantities: ClassVar[tuple[Quantity, ...]]
    shapes: ClassVar[tuple[Shape, ...]] = ()
    #: Words and prior knowledge; those of shipped effects are in a table.
    traits: ClassVar[Traits] = Traits()
    #: Whether the torque of a joint at rest is anything between two levels, and so says nothing.
    holds_at_rest: ClassVar[bool] = False
    #: Whether the torque is linear in the quantities; to the first order only where it is not.
    linear: ClassVar[bool] = True
    #: Whether the columns of a sample depend on that sample alone, or on those around it as well.
    instantaneous: ClassVar[bool] = True
    #: Whether it changes the rigid body or its gravity.
    changes_body: ClassVar[bool] = False
    #: Whether it is learned from the residual, and so names no cause.
    learned: ClassVar[bool] = False
    #: Whether its torque changes smoothly with position and velocity.
    smooth: ClassVar[bool] = False

    def __init_subclass__(cls) -> None:
        """Give a shipped effect its traits."""
        super().__init_subclass__()
        if vars(cls).get('name') in TRAITS:
            cls.traits = TRAITS[cls.name]

    def __post_init__(self) -> None:
        """Fill in the default shape and check what was given."""
        defaults = tuple(s.default for s in self.shapes) * len(self.owners)
        values = tuple(float(value) for value in self.shape) or defaults
        if len(values) != len(defaults):
            raise ModelError(
                f'{self.name}: {len(values)} shape values for {len(self.owners)} times '
                f'{", ".join(s.name for s in self.shapes) or "no shape"}'
            )
        for index, value in enumerate(values):
            shape = self.shapes[index % len(self.shapes)]
            if not shape.lower <= value <= shape.upper:
                raise ModelError(
                    f'{self.name}: {shape.name} has to be from {shape.lower:g} to '
                    f'{shape.upper:g} {shape.unit}, not {value:g}'
                )
        object.__setattr__(self, 'shape', values)

    @classmethod
    def on(cls, robot: Robot, joints: tuple[str, ...] | None = None) -> Effect:
        """
        Make the effect for a robot: on the joints named, or wherever it applies by default.

        Raises
        ------
        ModelError
            If the robot has no such joint.

        """
        chosen = cls._default_joints(robot) if joints is None else joints
        unknown = [name for name in chosen if name not in robot.joints]
        if unknown:
            raise ModelError(
                f"{cls.name}: {robot.name} has no joint '{unknown[0]}'; "
                f'its joints are {", ".join(robot.joints)}{meant(unknown[0], robot.joints)}'
            )
        effect = cls(tuple(chosen))
        return effect.with_shape(effect._default_shape(robot)) if cls.shapes else effect

    @classmethod
    def _default_joints(cls, robot: Robot) -> tuple[str, ...]:
        return robot.joints

    def in_usual_place(self, robot: Robot) -> bool:
        """Return whether it is where such an effect is as a rule: see `on`."""
        default = self._default_joints(robot)
        return bool(self.joints) == bool(default) and set(self.joints) <= set(default)

    @classmethod
    def places(cls, robot: Robot) -> tuple[tuple[str, ...], ...]:
        """
        Return the sets of joints on which it is one cause: single joints, pairs, the whole arm.

        Raises
        ------
        ModelError
            If the robot has no place for it.

        """
        joints = cls._default_joints(robot)
        return tuple((joint,) for joint in joints) or ((),)

    @classmethod
    def as_change(cls) -> type[Effect]:
        """Return what is looked for between two days: something may have been there before."""
        return cls

    def particulars(self) -> dict[str, Any]:
        """Return what model.yaml holds of it in addition to joints, parameters and shapes."""
        return {}

    def with_particulars(self, entry: Mapping[str, Any]) -> Self:
        """Return the effect with what an entry of model.yaml has of `particulars`."""
        return self

    def named_as(self, values: FloatArray, arm: Arm) -> tuple[tuple[Effect, FloatArray], ...]:
        """Return the effects, with values, that say the same in the words of the catalogue."""
        return ((self, values),)

    def when_found(self, values: FloatArray) -> tuple[Effect, FloatArray]:
        """Return what is fitted in its place once a search has found it, and first values."""
        return self, values

    def _default_shape(self, robot: Robot) -> FloatArray:
        """Return a shape to begin with on this robot, shape (number of owners, S)."""
        return self.shape_values

    @property
    def shape_values(self) -> FloatArray:
        """Shape parameters, shape (number of owners, S)."""
        return np.array(self.shape).reshape(len(self.owners), len(self.shapes))

    def shape_over_joints(self, robot: Robot) -> FloatArray:
        """Return every shape over the joints of a robot, defaults elsewhere, shape (S, n)."""
        return _spread_shape(self.shapes, self.shape, self.joints, robot.joints)

    def with_shape(self, values: npt.ArrayLike) -> Effect:
        """
        Return the effect with another shape.

        Parameters
        ----------
        values : array_like, shape (S,) or (number of owners, S)
            Shape parameters, the same for every owner or for each its own.

        Raises
        ------
        ModelError
            If a value is not possible.

        """
        size = (len(self.owners), len(self.shapes))
        try:
            spread = np.broadcast_to(np.asarray(values, dtype=float), size)
        except ValueError:
            raise ModelError(
                f'{self.name}: the shape of {size[0]} owners with '
                f'{", ".join(s.name for s in self.shapes) or "no shape"} has size {size}, '
                f'not {np.shape(values)}'
            ) from None
        return replace(self, shape=tuple(spread.ravel().tolist()))

    def spread(self, robot: Robot, found: Sequence[FloatArray] | None = None) -> FloatArray:
        """Return how large values may be, shape (P,); found ones and their std limit others."""
        return np.full(len(self.parameters(robot)), np.inf)

    def shape_parameters(self, robot: Robot) -> tuple[ParameterName, ...]:
        """Name the shape parameters, owner by owner."""
        return tuple(
            ParameterName(s.name, owner, joint_unit(s.unit, owner, robot))
            for owner in self.owners
            for s in self.shapes
        )

    def shape_starts(self, unexplained: Unexplained, arm: Arm) -> tuple[FloatArray, ...]:
        """
        Return where a search for a shape should start, for each shape (number of owners, G).

        Parameters
        ----------
        unexplained : Unexplained
            The data that the shape is to explain.
        arm : Arm
            The arm without the effect.

        """
        return tuple(np.tile(s.grid, (len(self.owners), 1)) for s in self.shapes)

    @property
    def said_as(self) -> str:
        """Return what it is called in the catalogue."""
        return self.name

    @property
    def owners(self) -> tuple[str, ...]:
        """Joints that have the quantities once each; one empty name for the whole arm."""
        return self.joints or ('',)

    def parameters(self, robot: Robot) -> tuple[ParameterName, ...]:
        """Name the P parameters, owner by owner."""
        return tuple(
            ParameterName(q.name, owner, joint_unit(q.unit, owner, robot), self.name)
            for owner in self.owners
            for q in self.quantities
        )

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return what is physically possible: lower and upper bounds, each of shape (P,)."""
        lower = np.array([q.lower for q in self.quantities] * len(self.owners))
        upper = np.array([q.upper for q in self.quantities] * len(self.owners))
        return lower, upper

    def adds_to(self, robot: Robot) -> tuple[int, ...]:
        """Return the rigid parameters that its own add to, one each; none for most effects."""
        return ()

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points beside the arm that it ends at."""
        return ()

    def along(self, motion: Motion) -> Self:
        """Return the effect with the motion of the other machine that it acts through."""
        return self

    @abstractmethod
    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """
        Differentiate the torques by the parameters, at the arm as it is.

        Parameters
        ----------
        motion : Motion
            As recorded; of a whole unbroken stretch, unless the effect is instantaneous.
        arm : Arm
            The arm as it is, with or without this effect.

        Returns
        -------
        ndarray, shape (N, n, P)
            dtau/dtheta, exact for an effect that is linear in its parameters. What torque sensors
            make of it is not in it yet: see ``ArmModel.columns_of``.

        """

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """
        Return how the effect acts on the plant with given parameter values.

        By default the links are held by columns @ values: right for a torque that is linear in the
        values and depends on time, position and velocity alone.

        Parameters
        ----------
        values : ndarray, shape (P,)
            Parameter values.
        arm : Arm
            The arm it acts on, with the effects before it applied.

        """
        joints = arm.robot.joints

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            rows = np.reshape(q, (-1, len(joints)))
            times = np.broadcast_to(np.ravel(t), (len(rows),))
            motion = Motion(joints, times, rows, np.reshape(dq, rows.shape), np.zeros_like(rows))
            return np.asarray((self.columns(motion, arm) @ values).reshape(np.shape(q)))

        return Action(link_torque=torque if np.any(values) else None)

    def plausible(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """
        Return whether values within the bounds are what one would call by this name.

        Deviations of the values, each (P,), are those of white noise; the arm is without them.

        """
        return True

    def indices(self, motion_joints: tuple[str, ...]) -> list[int]:
        """Return the columns of the effect's joints among the joints of a motion or robot."""
        return list(_places(self.joints, motion_joints))


@lru_cache(maxsize=1024)
def _places(joints: tuple[str, ...], among: tuple[str, ...]) -> tuple[int, ...]:
    """Return where joints are among others; a stream asks the same for every sample."""
    return tuple(among.index(joint) for joint in joints)


@lru_cache(maxsize=1024)
def _spread_shape(
    shapes: tuple[Shape, ...],
    values: tuple[float, ...],
    joints: tuple[str, ...],
    among: tuple[str, ...],
) -> FloatArray:
    """Return shape parameters over joints of which some have their own, shape (S, n)."""
    spread = np.tile([[s.default] for s in shapes], len(among))
    spread[:, _places(joints, among)] = np.array(values).reshape(-1, len(shapes)).T
    return read_only(spread)


class Arm(Protocol):
    """A rigid body with effects; `armid_ros.arm.ArmModel` is one."""

    @property
    def robot(self) -> Robot:
        """Its description."""

    @property
    def body(self) -> Robot:
        """Return the rigid body that effects make: with payload, under the gravity there is."""

    @property
    def middle_frames(self) -> LinkFrames:
        """Where all links are in the middle of the range of motion."""

    def values_of(self, effect: Effect) -> FloatArray:
        """Return the values of an effect, shape (P_e,)."""

    def action(self) -> Action:
        """Return how all its effects act together."""

    def link_motion(self, motion: Motion) -> Motion:
        """Return the true motion of the links where another one was recorded."""

    def link_frames(self, motion: Motion) -> LinkFrames:
        """Return where all links are along a recorded motion."""

    def smoothed(self, motion: Motion) -> Motion:
        """Return a recorded motion without what is beyond its band."""

    def load(self, motion: Motion) -> FloatArray:
        """Return what the rigid body takes along a motion of the links, (N, n) [N m]."""

    def load_derivatives(self, motion: Motion) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Differentiate the load by position, velocity, acceleration, each (N, n, n)."""

    def body_columns(self, motion: Motion) -> FloatArray:
        """Return the regressor of the load along a recorded motion, (N, n, 10 n)."""

    def gravity_columns(self, motion: Motion) -> FloatArray:
        """Differentiate the load along a recorded motion by gravity, (N, n, 3)."""

    def joint_torque(self, motion: Motion) -> FloatArray:
        """Return the true torques of a recorded motion, (N, n) [N m]."""

    def torque_before(self, effect: Effect, motion: Motion) -> FloatArray:
        """Return the torque that an effect of the sensors is given to read, (N, n) [N m]."""

    def torque_change(self, motion: Motion, change: Displacement) -> FloatArray:
        """Differentiate the true torque by changes of the links' motion."""

    def columns_of(self, effect: Effect, motion: Motion) -> FloatArray:
        """Return the sensitivities of what is read to the parameters of an effect."""
