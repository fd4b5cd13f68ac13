# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Springs between the motors and the links of a plant with elastic transmissions.

The motor and the link of an elastic joint have different velocities. Motors carry rotor inertia,
drive torque and all friction of the arm's effects; links carry the rigid body and everything
attached to it. Rotors are assumed to turn fast about their own axes, so that their inertia does
not depend on the pose (Spong 1987).

"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.effects import Action, Transmission
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray, read_only
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class Elasticity:
    """
    Settings for the simulation of elastic joints.

    Attributes
    ----------
    substeps : int
        Number of substeps per step.
    link_damping : float or ndarray, shape (n,)
        Viscous friction of the links [N m s/rad]. No effect of the catalogue describes it, because
        catalogue friction acts on the motors.

    """

    substeps: int = 2
    link_damping: npt.ArrayLike = 0.0


@dataclass(frozen=True, eq=False)
class ElasticJoints:
    """
    The e elastic joints of an arm; velocity vectors contain e motors and then n links.

    Attributes
    ----------
    joints : ndarray, shape (e,)
        Indices of the elastic joints.
    transmission : Transmission
        Stiffness, damping and free play of the elastic joints, each of shape (e,).
    substeps : int
        Number of substeps per step.
    dt : float
        Duration of a substep [s].
    to_motors, to_twists : ndarray, shape (n, e + n), (e, e + n)
        Matrices from the velocities to those of the motors of all joints, and to the rates of the
        twists.
    rotors, damping : ndarray, shape (e + n, e + n)
        Inertia without the rigid body [kg m^2], and viscous friction [N m s/rad].
    friction : ndarray, shape (m, e + n)
        Directions of the dry friction.
    stops : tuple of ndarray, each of shape (n,)
        Stiffness and damping of the stops [N m/rad], [N m s/rad].
    sensing : Action
        Action of the effects on the readings of the motors, which the springs do not change.

    """

    joints: npt.NDArray[np.intp]
    transmission: Transmission
    substeps: int
    dt: float
    to_motors: FloatArray
    to_twists: FloatArray
    rotors: FloatArray
    damping: FloatArray
    friction: FloatArray
    stops: tuple[FloatArray, FloatArray]
    sensing: Action

    @cached_property
    def pull(self) -> FloatArray:
        """Matrix that maps twists and velocities to spring torques, (e + n, e + e + n)."""
        return self._pull_of(self.transmission.stiffness, self.transmission.damping)

    @cached_property
    def loose(self) -> bool:
        """Whether any joint has backlash."""
        return bool(np.any(self.transmission.gap))

    @classmethod
    def of(
        cls,
        arm: ArmModel,
        elasticity: Elasticity,
        directions: FloatArray,
        mass: FloatArray,
        dt: float,
    ) -> ElasticJoints:
        """
        Return the springs and matrices of the elastic joints of an arm.

        `directions` are those of dry friction, (m, n). `mass` is the inertia matrix of the links
        in the middle of the ranges, (n, n) [kg m^2]. `dt` is the step of the plant [s].

        Raises
        ------
        ModelError
            If no joint is elastic, or the motor of an elastic joint has no inertia. The message
            names the joint.

        """
        action = arm.action()
        springs = _required_springs(arm.robot, action)
        joints = np.flatnonzero(np.isfinite(springs.stiffness))
        n, e = len(mass), len(joints)
        none = np.zeros((n, n))
        to_links = np.hstack([np.zeros((n, e)), np.eye(n)])
        to_motors = to_links.copy()
        to_motors[joints] = np.eye(e, e + n)
        rotors, damping = (
            to_motors.T @ (none if x is None else x) @ to_motors
            for x in (action.inertia, action.damping)
        )
        # natural frequency of a link on its stop times the substep, small enough for the
        # integration
        free, rate = 1.0 / np.diag(np.linalg.inv(mass)), 0.1 * elasticity.substeps / dt
        rub = np.diag(np.broadcast_to(np.asarray(elasticity.link_damping, dtype=float), (n,)))
        # effects on the motor readings, which springs do not change
        kept = [
            (effect, values)
            for effect, values in zip(arm.effects, arm.values, strict=True)
            if effect.action(values, ArmModel(arm.robot)).transmission is None
        ]
        bare = ArmModel(arm.robot, tuple(e for e, _ in kept), tuple(v for _, v in kept))
        return cls(
            joints=joints,
            transmission=Transmission(
                springs.stiffness[joints], springs.damping[joints], springs.gap[joints]
            ),
            substeps=elasticity.substeps,
            dt=dt / elasticity.substeps,
            to_motors=to_motors,
            to_twists=(to_motors - to_links)[joints],
            rotors=rotors,
            damping=damping + to_links.T @ rub @ to_links,
            friction=np.ascontiguousarray(directions @ to_motors),
            stops=(read_only(free * rate**2), read_only(1.4 * free * rate)),
            sensing=bare.action(),
        )

    def _pull_of(self, stiffness: FloatArray, damping: FloatArray) -> FloatArray:
        """Return `pull` for given stiffness and damping, shape (e + n, e + e + n)."""
        w = self.to_twists
        return np.hstack([-w.T * stiffness, -self.damping - (w.T * damping) @ w])

    def meshing(self, twist: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return `pull` of the springs in contact, and torque offsets (e,) by backlash [N m]."""
        springs = self.transmission
        meshes = np.abs(twist) > springs.gap
        stiffness = np.where(meshes, springs.stiffness, 0.0)
        damping = np.where(meshes, springs.damping, 0.0)
        return self._pull_of(stiffness, damping), stiffness * springs.gap * np.sign(twist)

    def twist(self, load: FloatArray) -> FloatArray:
        """Return the twists of the springs (..., e) under loads on the joints (..., n) [N m]."""
        springs, push = self.transmission, load[..., self.joints]
        return np.asarray(push / springs.stiffness + np.sign(push) * springs.gap)

    def at_motors(self, links: FloatArray, twist: FloatArray) -> FloatArray:
        """Return motor positions (..., n) from link positions and spring twists."""
        return np.asarray(links + twist.dot(self.to_motors[:, : len(self.joints)].T))


def _required_springs(robot: Robot, action: Action) -> Transmission:
    """Return the springs of an arm; raise a ModelError if they cannot be simulated."""
    springs = action.transmission
    if springs is None or not np.any(np.isfinite(springs.stiffness)):
        raise ModelError(
            f'{robot.name}: no joint is elastic; add joint_elasticity, or simulate a rigid arm'
        )
    soft = np.isfinite(springs.stiffness)
    rotor = np.zeros(len(soft)) if action.inertia is None else np.diag(action.inertia)
    for joint in np.flatnonzero(soft & (rotor <= 0.0))[:1]:
        raise ModelError(
            f"{robot.name}: joint '{robot.joints[joint]}' is elastic, but its motor has no "
            'inertia; add rotor_inertia'
        )
    if np.any(springs.gap[~soft] > 0.0):
        raise ModelError(
            f'{robot.name}: free play of a rigid transmission cannot be integrated; add '
            'joint_elasticity to the joints with backlash'
        )
    return springs
