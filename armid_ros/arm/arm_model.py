# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The arm model: a rigid body plus a list of effects with their parameter values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from armid_ros.effects import (
    Action,
    Displacement,
    Effect,
    merge_actions,
    parse_effect,
    TorqueReading,
)
from armid_ros.effects.action import law_derivatives
from armid_ros.effects.timing import smoothed
from armid_ros.errors import ModelError
from armid_ros.estimate import ParameterName
from armid_ros.files.cells import parted
from armid_ros.model import (
    BaseParameters,
    gravity_sensitivity,
    group_columns,
    inverse_dynamics,
    inverse_dynamics_derivatives,
    levelled,
    LinkFrames,
    random_motion,
    regressor,
    rigid_parameter_names,
)
from armid_ros.motion import FloatArray, Motion, MovingPoints, read_only
from armid_ros.robots import load_robot, Robot
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, repr=False)
class ArmModel:
    """
    Rigid body with effects: tau = Y pi + sum of tau_e(motion; theta_e) over all effects e.

    Motions are sensor readings, and the model includes the errors of these sensors.

    Attributes
    ----------
    robot : Robot
        The rigid body, with its inertial parameters and its gravity.
    effects : tuple of Effect
        Effects in addition to the rigid body.
    values : tuple of ndarray, each of shape (P_e,)
        Parameter values of every effect, zero by default.
    quasi_static : bool
        Whether the torque of the rigid body is its weight alone, as in slow motion without
        inertia torques: tau = Y(q, 0, 0) pi + effects.

    Examples
    --------
    >>> import armid_ros as ar
    >>> friction = ['viscous_friction:viscous_coefficient=0.3', 'coulomb_friction']
    >>> ar.ArmModel.of('my_arm.urdf', effects=friction, gravity='moon')
    ArmModel of arm: 3 joints (waist, shoulder, elbow)
      gravity 0, 0, -1.62 m/s^2, 5 kg moving
      viscous_friction: 0.3, 0.3, 0.3
      coulomb_friction: 0, 0, 0

    """

    robot: Robot
    effects: tuple[Effect, ...] = ()
    values: tuple[FloatArray, ...] = ()
    quasi_static: bool = False

    def __post_init__(self) -> None:
        """Set missing parameter values to zero, check their number, and make them read-only."""
        sizes = [len(effect.parameters(self.robot)) for effect in self.effects]
        values = self.values or tuple(np.zeros(size) for size in sizes)
        object.__setattr__(self, 'values', tuple(read_only(v) for v in values))
        if [v.shape for v in self.values] != [(size,) for size in sizes]:
            raise ModelError(
                f'{self.robot.name}: the effects {", ".join(e.name for e in self.effects)} need '
                f'arrays of {sizes} values, but the given arrays have shapes '
                f'{[v.shape for v in self.values]}'
            )

    @classmethod
    def of(
        cls,
        robot: Robot | str | Path,
        *,
        effects: str | Sequence[str | Effect] = (),
        gravity: str | Sequence[float] = 'earth',
        joints: Sequence[str] | None = None,
    ) -> ArmModel:
        """
        Create an arm model from a robot description and a list of effects.

        Parameters
        ----------
        robot : Robot, str or Path
            A robot, the name of a shipped robot, or the path of a URDF or xacro.
        effects : str or sequence of str or Effect
            Effects, or their names in the catalogue; one string may list several names with
            commas. A name may have joints, 'payload@wrist'. The name of a single effect may have
            values, 'viscous_friction:viscous_coefficient=0.1'.
        gravity : str or sequence of float
            'earth', 'moon', or a vector in the base frame [m/s^2]; not used for a Robot.
        joints : sequence of str, optional
            Driven joints; all but grippers by default.

        Raises
        ------
        RobotError or ModelError
            If the description cannot be used, or the catalogue has no such effect.

        """
        if not isinstance(robot, Robot):
            robot = load_robot(robot, gravity=gravity, joints=joints)
        arm = cls(robot)
        if isinstance(effects, str):
            effects = [effects] if ':' in effects else [e for e in parted(effects) if e.strip()]
        for k, effect in enumerate(effects):
            if effect in effects[:k]:
                raise ModelError(f"the effect '{effect}' is given twice; give each effect once")
            if isinstance(effect, Effect):
                arm = arm.with_effect(effect)
            else:
                arm = arm.with_effect(*parse_effect(effect, robot))
        return arm

    def __repr__(self) -> str:
        """Return robot, gravity, moving mass and effects as a few lines of text."""
        gravity = ', '.join(f'{value:g}' for value in self.robot.gravity)
        lines = [
            f'ArmModel of {self.robot.name}: {self.robot.n_joints} joints '
            f'({", ".join(self.robot.joints)})',
            f'  gravity {gravity} m/s^2, {self.robot.rigid_parameters[::10].sum():.4g} kg moving',
        ]
        for effect, values in zip(self.effects, self.values, strict=True):
            shown = ', '.join(f'{value:.4g}' for value in values[:6])
            lines.append(f'  {effect.name}: {shown}{" ..." if len(values) > 6 else ""}')
        return '\n'.join(lines)

    def with_effect(self, effect: Effect, values: npt.ArrayLike | None = None) -> ArmModel:
        """Return the arm with an additional effect, whose parameters are zero by default."""
        if values is None:
            values = np.zeros(len(effect.parameters(self.robot)))
        array = np.asarray(values, dtype=float)
        return replace(self, effects=(*self.effects, effect), values=(*self.values, array))

    @property
    def parameters(self) -> tuple[ParameterName, ...]:
        """Names of the P standard parameters: rigid-body parameters, then effect parameters."""
        names = list(rigid_parameter_names(self.robot))
        for effect in self.effects:
            names.extend(effect.parameters(self.robot))
        return tuple(names)

    @property
    def theta(self) -> FloatArray:
        """Values of the P standard parameters, shape (P,)."""
        return np.concatenate([self.robot.rigid_parameters, *self.values])

    def with_theta(self, theta: npt.ArrayLike) -> ArmModel:
        """Return the arm with other values of the standard parameters, shape (P,)."""
        theta = np.asarray(theta, dtype=float)
        size = len(self.robot.rigid_parameters)
        cuts = np.cumsum([size, *(len(v) for v in self.values)])
        parts = np.split(theta, cuts)[:-1]
        return replace(self, robot=self.robot.with_inertias(parts[0]), values=tuple(parts[1:]))

    def values_of(self, effect: Effect) -> FloatArray:
        """Return the parameter values of an effect; zeros for an effect that the arm lacks."""
        for own, values in zip(self.effects, self.values, strict=True):
            if own == effect:
                return values
        return np.zeros(len(effect.parameters(self.robot)))

    def action(self) -> Action:
        """Return the combined action of all effects on rigid body, joint torques and sensors."""
        return self._acting

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields for pickling, without cached functions."""
        return {part.name: getattr(self, part.name) for part in fields(self)}

    @cached_property
    def _acting(self) -> Action:
        """Combined action of all effects, which is computed once."""
        robot = self.robot
        pairs = list(zip(self.effects, self.values, strict=True))
        for effect, values in pairs:
            if effect.changes_body:
                robot = effect.action(values, ArmModel(robot)).robot or robot
        bare = replace(self, robot=robot, effects=(), values=())
        actions = [e.action(values, bare) for e, values in pairs if not e.changes_body]
        return merge_actions(robot, actions)

    @property
    def body(self) -> Robot:
        """Rigid body, including all effects that change its inertia, such as a payload."""
        assert self._acting.robot is not None
        return self._acting.robot

    def along(self, motion: Motion) -> ArmModel:
        """Return the arm with its effects set to the signals of a motion, such as temperatures."""
        effects = tuple(effect.along(motion) for effect in self.effects)
        known = all(new is old for new, old in zip(effects, self.effects, strict=True))
        return self if known else replace(self, effects=effects)

    def link_motion(self, motion: Motion) -> Motion:
        """Return the motion of the links: recorded motion plus displacements of the effects."""
        displacement = self._acting.displacement
        if displacement is None:
            return motion
        change = displacement(motion)
        return replace(
            motion, q=motion.q + change.q, dq=motion.dq + change.dq, ddq=motion.ddq + change.ddq
        )

    def link_frames(self, motion: Motion) -> LinkFrames:
        """Return the frames of all links in each sample of a recorded motion."""
        return LinkFrames.of(self.robot, self.link_motion(motion).q)

    def load(self, motion: Motion) -> FloatArray:
        """Return the rigid-body torque for a motion of the links, shape (N, n) [N m]."""
        return inverse_dynamics(self.body, self.rigid_body_motion(motion))

    def body_columns(self, motion: Motion) -> FloatArray:
        """Return the rigid-body regressor along a recorded motion, shape (N, n, 10 n)."""
        return regressor(self.body, self.rigid_body_motion(self.link_motion(motion)))

    def gravity_columns(self, motion: Motion) -> FloatArray:
        """Return the derivatives of the rigid-body torque by the gravity vector, (N, n, 3)."""
        return gravity_sensitivity(self.body, self.link_motion(motion).q)

    def smoothed(self, motion: Motion) -> Motion:
        """Return a recorded motion without frequencies above its band limit ``band_hz``."""
        return smoothed(motion)

    def load_derivatives(self, motion: Motion) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the derivatives of the rigid-body torque by q, dq and ddq, (N, n, n) each."""
        return inverse_dynamics_derivatives(self.body, self.rigid_body_motion(motion))

    def link_slopes(self, motion: Motion) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return derivatives of the joint torque by q, dq and ddq of the links, (N, n, n) each."""
        link = self.link_motion(motion)
        slopes = self.load_derivatives(link)
        by_q, by_dq, by_ddq = (self.with_load_friction(motion, by) for by in slopes)
        if self.quasi_static:
            by_dq, by_ddq = np.zeros_like(by_dq), np.zeros_like(by_ddq)
        law = self.along(motion).action().link_torque
        if law is not None:
            more = law_derivatives(law, link)
            by_q, by_dq = by_q + more[0], by_dq + more[1]
        return by_q, by_dq, by_ddq

    def joint_torque(self, motion: Motion) -> FloatArray:
        """Return the true joint torque along a recorded motion, shape (N, n) [N m or N]."""
        link = self.link_motion(motion)
        load = self.load(link)
        return load + self.along(motion).action().effort(motion, link, load)

    def torque(
        self, motion: Motion | npt.ArrayLike, dq: npt.ArrayLike = 0.0, ddq: npt.ArrayLike = 0.0
    ) -> FloatArray:
        """
        Predict the torque readings of the actuators along a recorded motion.

        Parameters
        ----------
        motion : Motion, or array of shape (N, n) or (n,)
            Recorded motion, or positions alone [rad or m]. The torque of a motion is used only for
            drives that report more torque than they supply.
        dq, ddq : array_like of the same shape
            Velocities and accelerations, if `motion` is positions; zero by default.

        Returns
        -------
        ndarray, shape (N, n) or (n,)
            Torque reading of the actuators [N m or N].

        Raises
        ------
        ModelError
            If an effect depends on past samples, and `motion` is positions without times.

        """
        if not isinstance(motion, Motion):
            past = [effect.name for effect in self.effects if not effect.instantaneous]
            if past:
                raise ModelError(
                    f'the effects {", ".join(past)} depend on earlier samples; give an ar.Motion, '
                    'which has times, instead of positions'
                )
            states = Motion.of_states(self.robot.joints, motion, dq, ddq)
            return self.torque(states).reshape(np.shape(motion))
        tau = self.joint_torque(motion)
        reading = self._acting.reading
        return tau if reading is None else reading(motion, tau)

    def rigid_columns(self, motion: Motion) -> FloatArray:
        """Return derivatives of the torque readings by the rigid-body parameters, (N, n, 10 n)."""
        columns = self.body_columns(motion)
        return self._as_read(motion, self.with_load_friction(motion, columns))

    def columns_of(self, effect: Effect, motion: Motion) -> FloatArray:
        """
        Return derivatives of the torque readings by the parameters of one effect.

        Parameters
        ----------
        effect : Effect
            Effect of the arm, or a candidate effect.
        motion : Motion
            Recorded motion; a complete stretch without gaps unless the effect is instantaneous.

        Returns
        -------
        ndarray, shape (N, n, P_e)
            Derivative of ``torque`` at the present parameter values of the arm.

        """
        columns = effect.checked_columns(motion, self)
        if effect.changes_body:
            columns = self.with_load_friction(motion, columns)
        return self._as_read(motion, columns, effect)

    def effect_columns(self, motion: Motion) -> FloatArray:
        """Return derivatives of the torque readings by all effect parameters, (N, n, P - 10 n)."""
        blocks = [self.columns_of(effect, motion) for effect in self.effects]
        none = [] if blocks else [np.empty((len(motion), motion.n_joints, 0))]
        return np.concatenate(blocks or none, axis=2)

    def columns(self, motion: Motion) -> FloatArray:
        """
        Return derivatives of the torque readings by all ``parameters``, shape (N, n, P).

        The result is the derivative of ``torque``. Effects that depend on the load of a joint use
        the load at the present parameter values.

        """
        return np.concatenate([self.rigid_columns(motion), self.effect_columns(motion)], axis=2)

    def torque_change(self, motion: Motion, change: Displacement) -> FloatArray:
        """
        Return changes of the true joint torque due to small changes of the motion of links.

        Parameters
        ----------
        motion : Motion
            Recorded motion.
        change : Displacement
            Changes of position, velocity and acceleration, each (N, n, P).

        Returns
        -------
        ndarray, shape (N, n, P)

        """
        by_q, by_dq, by_ddq = self.link_slopes(motion)
        return np.asarray(by_q @ change.q + by_dq @ change.dq + by_ddq @ change.ddq)

    def torque_before(self, effect: Effect, motion: Motion) -> FloatArray:
        """Return the torque at the input of a sensor effect, along a motion, (N, n) [N m]."""
        tau = self.joint_torque(motion)
        for own, values in self._readings:
            if own == effect:
                break
            tau = own.read(values, motion, tau)
        return tau

    def neighbours(self, period: float) -> int:
        """Return the number of neighbouring samples on each side that affect a torque reading."""
        action = self._acting
        if action.displacement is None and action.reading_memory == 0.0:  # noqa: RUF069 - of laws, never computed
            return 0
        # four more samples on either side for second derivatives by finite differences
        return int(np.ceil(action.reading_memory / period)) + 4

    @cached_property
    def _readings(self) -> list[tuple[TorqueReading, FloatArray]]:
        """Effects of torque sensors, with their parameter values."""
        pairs = zip(self.effects, self.values, strict=True)
        return [(e, values) for e, values in pairs if isinstance(e, TorqueReading)]

    def _as_read(
        self, motion: Motion, columns: FloatArray, after: Effect | None = None
    ) -> FloatArray:
        """Convert derivatives of the true torque to derivatives of the torque readings."""
        readings = self._readings
        if isinstance(after, TorqueReading):
            known = [own for own, _ in readings]
            first = known.index(after) + 1 if after in known else len(known)
        else:
            first = 0
        if not any(np.any(values) for _, values in readings[first:]):
            return columns
        tau = self.joint_torque(motion)
        for position, (own, values) in enumerate(readings):
            if position >= first:
                columns = own.transfer(values, motion, tau, columns)
            tau = own.read(values, motion, tau)
        return columns

    def with_load_friction(self, motion: Motion, columns: FloatArray) -> FloatArray:
        """Add the derivatives of load-dependent friction to derivatives of the load (N, n, P)."""
        friction = self._acting.dry_friction
        if friction is None or friction.load_share is None:
            return columns
        along = friction.directions.T
        load = self.load(self.link_motion(motion))
        gain = friction.load_share * np.sign(load @ along) * np.sign(motion.dq @ along)
        return np.asarray(columns + along @ (gain[:, :, np.newaxis] * (along.T @ columns)))

    def rigid_body_motion(self, motion: Motion) -> Motion:
        """Return a motion, with zero velocity and acceleration if the arm is ``quasi_static``."""
        return motion.at_rest() if self.quasi_static else motion

    def base_parameters(
        self, rng: np.random.Generator, free: npt.NDArray[np.intp] | None = None
    ) -> BaseParameters:
        """
        Return the base parameters of rigid body and effects, for sufficiently rich motions.

        Parameters
        ----------
        rng : numpy.random.Generator
            Draws the random states of the regressor.
        free : ndarray of int, optional
            Indices of the ``parameters`` that may change; all by default.

        """
        motion = random_motion(self.robot, rng)
        names = tuple(name for effect in self.effects for name in effect.points)
        if names:
            size = (len(motion), len(names), 3)
            points = MovingPoints(names, rng.normal(size=size), rng.normal(size=size))
            motion = replace(motion, partner=points)
        every = self.parameters
        free = np.arange(len(every)) if free is None else free
        level = replace(self, robot=levelled(self.robot))
        columns = level.columns(motion)[:, :, free].reshape(-1, len(free))
        return group_columns(columns, tuple(every[k] for k in free)).among(every, free)
