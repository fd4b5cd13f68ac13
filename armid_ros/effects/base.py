# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The base class of effects: a physical cause of joint torque in addition to the rigid body.

The simulation uses how an effect acts (``action``). The identification uses how the torques depend
on its parameters (``columns``). The diagnosis checks whether this dependence explains a residual.
An effect on joints has its quantities once per joint. An effect on the whole arm has no joints,
and has its quantities once.

Quantities are amplitudes: the torque is linear or nearly linear in them. Nonlinear parameters,
such as a Stribeck velocity, are shapes. The shape values are attributes of the effect, and the
columns depend on them.

"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Protocol, Self

from armid_ros.effects.action import Action, Displacement
from armid_ros.effects.quantities import joint_unit, Quantity, Shape
from armid_ros.effects.traits import Traits
from armid_ros.errors import meant, ModelError
from armid_ros.estimate import ParameterName
from armid_ros.model import LinkFrames
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Effect(ABC):
    """
    Base class of physical effects, which act on some joints of an arm or on the whole arm.

    Attributes
    ----------
    joints : tuple of str
        The joints on which the effect acts; empty for an effect on the whole arm.
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
    #: Descriptions and prior knowledge; shipped effects have them in `traits.py`.
    traits: ClassVar[Traits] = Traits()
    #: Whether the torque of a joint at rest is undetermined between two levels.
    holds_at_rest: ClassVar[bool] = False
    #: Whether the torque is exactly linear in the quantities; if not, columns are first-order.
    linear: ClassVar[bool] = True
    #: Whether the columns of a sample depend on that sample only, not on its neighbours.
    instantaneous: ClassVar[bool] = True
    #: Whether the effect changes the rigid body or its gravity.
    changes_body: ClassVar[bool] = False
    #: Whether the effect is learned from the residual and has no physical cause.
    learned: ClassVar[bool] = False
    #: Whether the torque changes smoothly with position and velocity.
    smooth: ClassVar[bool] = False
    #: Whether the effect is the same on every day, as its input is measured.
    lasting: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Set default shape parameters, or check number and range of the given values."""
        defaults = tuple(s.default for s in self.shapes) * len(self.owners)
        values = tuple(float(value) for value in self.shape) or defaults
        if len(values) != len(defaults):
            raise ModelError(
                f'{self.name}: {len(values)} shape values are given instead of {len(defaults)}; '
                f'needed for each joint: {", ".join(s.name for s in self.shapes) or "none"}'
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
        Create the effect for a robot, on given joints or on the default joints of the effect.

        Raises
        ------
        ModelError
            If the robot has no such joint.

        """
        chosen = cls._default_joints(robot) if joints is None else joints
        known = cls._possible_joints(robot)
        unknown = [name for name in chosen if name not in known]
        if unknown:
            moved = dict(zip(robot.links, robot.moving, strict=True)).get(unknown[0])
            named = f'; {moved} moves that link: {cls.name}@{moved}' if moved else ''
            raise ModelError(
                f"{cls.name}: {robot.name} has no joint '{unknown[0]}'; "
                f'its joints are {", ".join(known)}{named or meant(unknown[0], known)}'
            )
        effect = cls(tuple(chosen))
        return effect.with_shape(effect._default_shape(robot)) if cls.shapes else effect

    @classmethod
    def _possible_joints(cls, robot: Robot) -> tuple[str, ...]:
        """Return the names of the joints on which the effect can act: joints with an actuator."""
        return robot.joints

    @classmethod
    def _default_joints(cls, robot: Robot) -> tuple[str, ...]:
        return cls._possible_joints(robot)

    def in_usual_place(self, robot: Robot) -> bool:
        """Return whether all joints of the effect are among its default joints."""
        default = self._default_joints(robot)
        return bool(self.joints) == bool(default) and set(self.joints) <= set(default)

    @classmethod
    def places(cls, robot: Robot) -> tuple[tuple[str, ...], ...]:
        """
        Return all places where the effect can act: single joints, pairs, or () for the whole arm.

        Raises
        ------
        ModelError
            If the effect is impossible on the robot.

        """
        joints = cls._default_joints(robot)
        return tuple((joint,) for joint in joints) or ((),)

    @classmethod
    def as_change(cls) -> type[Effect]:
        """Return the effect class that models a change of this effect since the baseline."""
        return cls

    def particulars(self) -> dict[str, Any]:
        """Return the effect's own entries for model.yaml, such as reference temperatures."""
        return {}

    def with_particulars(self, entry: Mapping[str, Any]) -> Self:
        """Return a copy of the effect with the entries that `particulars` wrote to model.yaml."""
        return self

    def named_as(self, values: FloatArray, arm: Arm) -> tuple[tuple[Effect, FloatArray], ...]:
        """Return the equivalent effects of the catalogue for a report, each with its values."""
        return ((self, values),)

    def _default_shape(self, robot: Robot) -> FloatArray:
        """Return the default shape parameters for a robot, shape (number of owners, S)."""
        return self.shape_values

    @property
    def shape_values(self) -> FloatArray:
        """Values of the S shape parameters, one row for each joint or one for the whole arm."""
        return np.array(self.shape).reshape(len(self.owners), len(self.shapes))

    def with_shape(self, values: npt.ArrayLike) -> Effect:
        """
        Return a copy of the effect with other shape parameters.

        Parameters
        ----------
        values : array_like, shape (S,) or (number of owners, S)
            Shape parameters, the same for all owners or separate for each owner.

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
                f'{self.name}: shapes need an array of size {size}, not {np.shape(values)}; its '
                f'columns are {", ".join(s.name for s in self.shapes) or "none"}'
            ) from None
        return replace(self, shape=tuple(spread.ravel().tolist()))

    def spread(self, robot: Robot) -> FloatArray:
        """Return the largest expected absolute values of the P parameters, shape (P,)."""
        return np.full(len(self.parameters(robot)), np.inf)

    def shape_parameters(self, robot: Robot) -> tuple[ParameterName, ...]:
        """Return name, joint and unit of each shape parameter, joint by joint."""
        return tuple(
            ParameterName(s.name, owner, joint_unit(s.unit, owner, robot))
            for owner in self.owners
            for s in self.shapes
        )

    def shape_starts(self, unexplained: Unexplained, arm: Arm) -> tuple[FloatArray, ...]:
        """
        Return start values for the search of shape parameters: an array (owners, G) per shape.

        Parameters
        ----------
        unexplained : Unexplained
            The residual that the shape should explain.
        arm : Arm
            The arm without the effect.

        """
        return tuple(np.tile(s.grid, (len(self.owners), 1)) for s in self.shapes)

    @property
    def owners(self) -> tuple[str, ...]:
        """Names of the joints that have parameters of their own; ('',) for the whole arm."""
        return self.joints or ('',)

    def parameters(self, robot: Robot) -> tuple[ParameterName, ...]:
        """Return name, joint and unit of each of the P parameters, joint by joint."""
        return tuple(
            ParameterName(q.name, owner, joint_unit(q.unit, owner, robot), self.name)
            for owner in self.owners
            for q in self.quantities
        )

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the lower and the upper physical bounds of the parameters, shape (P,) each."""
        lower = np.array([q.lower for q in self.quantities] * len(self.owners))
        upper = np.array([q.upper for q in self.quantities] * len(self.owners))
        return lower, upper

    def adds_to(self, robot: Robot) -> tuple[int, ...]:
        """Return the indices of the rigid-body parameters that the effect changes; () if none."""
        return ()

    @property
    def reference_temperatures(self) -> dict[str, float]:
        """Reference temperatures by joint name [degC]; empty if the effect has none."""
        return {}

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points outside the arm to which springs of the effect are attached."""
        return ()

    def along(self, motion: Motion) -> Self:
        """Return a copy of the effect with the recorded signals it needs, such as temperatures."""
        return self

    def referred_to(self, temperatures: Mapping[str, float]) -> Self:
        """Return a copy with other reference temperatures [degC], if the effect has any."""
        return self

    @abstractmethod
    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """
        Return the regressor: derivatives of the joint torques with respect to the parameters.

        Parameters
        ----------
        motion : Motion
            The recorded motion; a whole stretch without gaps, unless the effect is instantaneous.
        arm : Arm
            The arm model, with or without this effect.

        Returns
        -------
        ndarray, shape (N, n, P)
            dtau/dtheta, exact for an effect that is linear in its parameters. Effects on torque
            readings are not applied; see ``ArmModel.columns_of``.

        """

    def checked_columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the regressor of `columns`; raise a ModelError if its shape is not (N, n, P)."""
        columns = self.columns(motion, arm)
        wanted = (*motion.q.shape, len(self.owners) * len(self.quantities))
        if np.shape(columns) != wanted:
            raise ModelError(
                f"effect '{self.name}': columns() returned an array of shape {np.shape(columns)} "
                f'instead of {wanted} (samples, joints of the arm, parameters)'
            )
        return columns

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """
        Return the terms that the effect adds to plant and sensors, for given parameter values.

        By default, the torque on the link side is columns @ values. This is correct for a torque
        that is linear in the values and depends on time, position and velocity only.

        Parameters
        ----------
        values : ndarray, shape (P,)
            Parameter values.
        arm : Arm
            The arm, with the preceding effects applied.

        """
        joints = arm.robot.joints

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            rows = np.reshape(q, (-1, len(joints)))
            times = np.broadcast_to(np.ravel(t), (len(rows),))
            motion = Motion(joints, times, rows, np.reshape(dq, rows.shape), np.zeros_like(rows))
            return np.asarray((self.checked_columns(motion, arm) @ values).reshape(np.shape(q)))

        return Action(link_torque=torque if np.any(values) else None)

    def plausible(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """
        Return whether the combination of fitted values within bounds is physically plausible.

        ``std``, shape (P,), has standard deviations for white noise. The arm does not contain
        the effect.

        """
        return True

    def indices(self, motion_joints: tuple[str, ...]) -> list[int]:
        """Return the indices of the effect's joints among the joints of a motion or robot."""
        return [motion_joints.index(joint) for joint in self.joints]


@dataclass(frozen=True)
class Unexplained:
    """
    Residual torques of a model in all recordings, which an additional effect should explain.

    Attributes
    ----------
    motion : Motion
        All N samples, with the recordings concatenated.
    q : ndarray, shape (M, n)
        Joint positions at the M samples that are compared [rad or m].
    residual : ndarray, shape (M, n)
        Residual torque [N m].
    weight : ndarray, shape (M, n)
        One over the standard deviation of the noise, zero for an unused torque [1/(N m)].
    nuisance : ndarray, shape (M, n, f)
        Columns of parameters that are fitted together with any effect.

    """

    motion: Motion
    q: FloatArray
    residual: FloatArray
    weight: FloatArray
    nuisance: FloatArray


class Arm(Protocol):
    """Interface of an arm model (rigid body with effects), such as `armid_ros.arm.ArmModel`."""

    @property
    def robot(self) -> Robot:
        """The robot as described, without effects."""

    @property
    def body(self) -> Robot:
        """The robot with all effects that change its rigid body, such as a payload."""

    def values_of(self, effect: Effect) -> FloatArray:
        """Return the parameter values of one effect of the model, shape (P,)."""

    def action(self) -> Action:
        """Return the combined action of all effects on plant and sensors."""

    def link_motion(self, motion: Motion) -> Motion:
        """Return the true motion of the links that belongs to a recorded motion."""

    def link_frames(self, motion: Motion) -> LinkFrames:
        """Return the frames of all links at each sample of a recorded motion."""

    def smoothed(self, motion: Motion) -> Motion:
        """Return a recorded motion without the frequencies above its band limit [Hz]."""

    def load(self, motion: Motion) -> FloatArray:
        """Return the torque of the rigid body along a motion of the links, (N, n) [N m]."""

    def load_derivatives(self, motion: Motion) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the derivatives of the rigid-body torque by q, dq and ddq, (N, n, n) each."""

    def body_columns(self, motion: Motion) -> FloatArray:
        """Return the regressor of the rigid body along a recorded motion, (N, n, 10 n)."""

    def gravity_columns(self, motion: Motion) -> FloatArray:
        """Return the derivatives of the rigid-body torque by the gravity vector, (N, n, 3)."""

    def joint_torque(self, motion: Motion) -> FloatArray:
        """Return the joint torques without sensor errors along a recorded motion, (N, n) [N m]."""

    def torque_before(self, effect: Effect, motion: Motion) -> FloatArray:
        """Return the torque that is the input of a sensor effect in a motion, (N, n) [N m]."""

    def torque_change(self, motion: Motion, change: Displacement) -> FloatArray:
        """Return the first-order torque change by link displacements, (N, n, ...) [N m]."""
