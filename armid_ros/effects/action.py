# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Actions of effects on the joints of the plant and on its sensor readings.

A plant with elastic transmissions has two sides. The motor side has all friction and the rotor
inertia. The link side has the rigid body and everything attached to it. Without elasticity, both
sides have the same motion.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from armid_ros.effects.slipping import Hysteresis
from armid_ros.motion import BlurredMotion, FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np

#: Torque of the actuators [N m] as a function of time, position and velocity.
TorqueLaw = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]

#: Dry friction [N m], or a load share [-], below this value counts as zero.
NO_FRICTION = 1e-12


class Displacement(NamedTuple):
    """Small changes of joint positions, velocities and accelerations, of shape (N, n, ...)."""

    q: FloatArray
    dq: FloatArray
    ddq: FloatArray


@dataclass(frozen=True)
class DryFriction:
    """
    Dry friction of joints; its torque at zero velocity can be any value between two levels.

    Attributes
    ----------
    directions : ndarray, shape (m, n)
        Velocity of each of m friction elements as a combination of the joint velocities.
    lower, upper : ndarray, shape (m,)
        Torque while the element moves backwards, and forwards [N m]; lower <= upper.
    load_share : ndarray, shape (m,), or None
        Widening of both levels per torque of the rigid body [-]: the lower falls, the upper rises.

    """

    directions: FloatArray
    lower: FloatArray
    upper: FloatArray
    load_share: FloatArray | None = None

    def torque(self, dq: FloatArray, load: FloatArray) -> FloatArray:
        """
        Return the friction torques (..., n) [N m]; at rest, the mean of lower and upper level.

        Parameters
        ----------
        dq : ndarray, shape (..., n)
            Joint velocities.
        load : ndarray, shape (..., n)
            Torque of the rigid body [N m].

        """
        half = (self.upper - self.lower) / 2 + self.widening(load)
        middle = (self.upper + self.lower) / 2
        return np.asarray((half * np.sign(dq @ self.directions.T) + middle) @ self.directions)

    def largest(self, load: FloatArray) -> FloatArray:
        """Return the largest possible friction torque of each joint under a load, (..., n)."""
        half = (self.upper - self.lower) / 2 + self.widening(load)
        return np.asarray(half @ np.abs(self.directions))

    def widening(self, load: FloatArray) -> FloatArray:
        """Return the increase of each element's friction level by a load, (..., m) [N m]."""
        if self.load_share is None:
            return np.zeros((*load.shape[:-1], len(self.lower)))
        return np.asarray(self.load_share * np.abs(load @ self.directions.T))


def direction(motion: Motion, joints: Sequence[int] | None = None) -> FloatArray:
    """
    Return the direction of motion of each joint, or of a shaft that joints share, from -1 to 1.

    Parameters
    ----------
    motion : Motion
        N samples of n joints.
    joints : sequence of int, optional
        Joints whose velocities add up to the velocity of a shaft.

    Returns
    -------
    ndarray, shape (N, n), or (N,) of a shaft
        -1, 0 or 1 [-]; in between for a `BlurredMotion`.

    """
    velocity = motion.dq if joints is None else motion.dq[:, list(joints)].sum(axis=1)
    if not isinstance(motion, BlurredMotion):
        return np.asarray(np.sign(velocity))
    width = motion.width if joints is None else motion.width[list(joints)].min()
    return np.asarray(np.tanh(velocity / width))


@dataclass(frozen=True)
class Transmission:
    """
    Springs, dampers and free play between motors and links.

    The link of a joint is twisted against its motor by x = q_motor - q_link. Beyond the gap it
    carries the torque K (x - gap) + D dx. Within the gap the torque is zero. Position readings
    are those of the motors.

    Attributes
    ----------
    stiffness : ndarray, shape (n,)
        K [N m/rad]; infinite for a rigid transmission.
    damping : ndarray, shape (n,)
        D [N m s/rad].
    gap : ndarray, shape (n,)
        Free play to either side, half the backlash [rad].

    """

    stiffness: FloatArray
    damping: FloatArray
    gap: FloatArray


@dataclass(frozen=True)
class Action:
    """
    Terms that effects add to the equations of plant and sensors; absent terms are None.

    On the motor side, the actuators have to supply damping @ dq + inertia @ ddq + dry friction +
    hysteresis + torque(t, q, dq). On the link side, they have to supply the torque of the rigid
    body + link_torque(t, q, dq).

    Attributes
    ----------
    damping : ndarray, shape (n, n), or None
        Viscous matrix [N m s/rad].
    inertia : ndarray, shape (n, n), or None
        Constant inertia added at the joints [kg m^2].
    dry_friction : DryFriction, or None
        Dry friction, which can stick.
    hysteresis : Hysteresis, or None
        Friction with a state, such as presliding.
    torque, link_torque : callable (t, q, dq) -> ndarray (..., n), or None
        Any other torque that depends smoothly on the state [N m].
    robot : Robot, or None
        The rigid body that replaces the nominal rigid body.
    transmission : Transmission, or None
        Springs and gaps between motors and links.
    drive : callable ndarray (..., n) -> ndarray (..., n), or None
        Function from the commanded torque, which the drives report, to the actual torque.
    displacement : callable Motion -> Displacement, or None
        Function from the recorded motion to the true minus the recorded motion of the links.
    reading : callable (Motion, ndarray (N, n)) -> ndarray (N, n), or None
        Function from a motion and its true torque to the torque readings. The torque of the
        motion, if any, is the torque that the drives report.
    reading_memory : float
        Time span of the past torque on which a reading depends [s].

    """

    damping: FloatArray | None = None
    inertia: FloatArray | None = None
    dry_friction: DryFriction | None = None
    hysteresis: Hysteresis | None = None
    torque: TorqueLaw | None = None
    link_torque: TorqueLaw | None = None
    robot: Robot | None = None
    transmission: Transmission | None = None
    drive: Callable[[FloatArray], FloatArray] | None = None
    displacement: Callable[[Motion], Displacement] | None = None
    reading: Callable[[Motion, FloatArray], FloatArray] | None = None
    reading_memory: float = 0.0

    def effort(self, motors: Motion, links: Motion, load: FloatArray) -> FloatArray:
        """
        Return the motor torque needed in addition to the rigid-body torque, (N, n) [N m].

        Parameters
        ----------
        motors, links : Motion
            True motion on both sides of the transmissions; the same if they are rigid.
        load : ndarray, shape (N, n)
            Torque of the rigid body [N m].

        """
        tau = np.zeros_like(load)
        if self.damping is not None:
            tau += motors.dq @ self.damping.T
        if self.inertia is not None:
            tau += motors.ddq @ self.inertia.T
        if self.dry_friction is not None:
            tau += self.dry_friction.torque(motors.dq, load)
        if self.hysteresis is not None:
            tau += self.hysteresis.torque(self.hysteresis.along(motors.q, motors.dq))
        if self.torque is not None:
            tau += self.torque(motors.t, motors.q, motors.dq)
        if self.link_torque is not None:
            tau += self.link_torque(links.t, links.q, links.dq)
        return tau

    def torque_derivatives(self, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """Return the derivatives of `torque` with respect to q and dq, (N, n, n) each."""
        assert self.torque is not None
        return law_derivatives(self.torque, motion)


def law_derivatives(law: TorqueLaw, motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of a torque function with respect to q and dq, (N, n, n) each."""
    n = motion.n_joints
    size = 1e-6  # of the differences [rad, m, rad/s or m/s]
    slopes = np.empty((2, len(motion), n, n))
    for argument, joint in np.ndindex(2, n):
        ends = []
        for step in (size, -size):
            state = [motion.q.copy(), motion.dq.copy()]
            state[argument][:, joint] += step
            ends.append(law(motion.t, *state))
        slopes[argument, :, :, joint] = (ends[0] - ends[1]) / (2.0 * size)
    return slopes[0], slopes[1]


def merge_actions(robot: Robot, actions: Sequence[Action]) -> Action:
    """
    Combine the actions of several effects on one robot into a single action.

    Matrices and torques are summed. Dry friction along one direction becomes one element.
    Actions on readings are applied in the given order.

    """
    zero = np.zeros((robot.n_joints, robot.n_joints))
    readings = [a.reading for a in actions if a.reading is not None]
    drives = [a.drive for a in actions if a.drive is not None]
    displacements = [a.displacement for a in actions if a.displacement is not None]
    slipping = [a.hysteresis for a in actions if a.hysteresis]
    transmissions = [a.transmission for a in actions if a.transmission]

    def reading(motion: Motion, tau: FloatArray) -> FloatArray:
        for read in readings:
            tau = read(motion, tau)
        return tau

    def drive(tau: FloatArray) -> FloatArray:
        for give in drives:
            tau = give(tau)
        return tau

    def displacement(motion: Motion) -> Displacement:
        parts = [displace(motion) for displace in displacements]
        return Displacement(*(np.sum(arrays, axis=0) for arrays in zip(*parts, strict=True)))

    hysteresis = transmission = None
    if slipping:
        hysteresis = Hysteresis(
            np.vstack([springs.directions for springs in slipping]),
            np.concatenate([springs.level for springs in slipping]),
            np.concatenate([springs.distance for springs in slipping]),
        )
    if transmissions:  # in series: compliances and gaps are summed
        with np.errstate(divide='ignore'):
            stiffness = 1.0 / np.sum([1.0 / part.stiffness for part in transmissions], axis=0)
        transmission = Transmission(
            stiffness,
            np.sum([part.damping for part in transmissions], axis=0),
            np.sum([part.gap for part in transmissions], axis=0),
        )
    return Action(
        damping=sum((a.damping for a in actions if a.damping is not None), zero),
        inertia=sum((a.inertia for a in actions if a.inertia is not None), zero),
        dry_friction=_merge_friction([a.dry_friction for a in actions if a.dry_friction]),
        hysteresis=hysteresis,
        torque=sum_laws([a.torque for a in actions if a.torque is not None]),
        link_torque=sum_laws([a.link_torque for a in actions if a.link_torque is not None]),
        robot=robot,
        transmission=transmission,
        drive=drive if drives else None,
        displacement=displacement if displacements else None,
        reading=reading if readings else None,
        reading_memory=sum(a.reading_memory for a in actions),
    )


def sum_laws(laws: Sequence[TorqueLaw]) -> TorqueLaw | None:
    """Return the sum of torque functions as a function of t, q and dq; None if there are none."""

    def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
        return np.asarray(sum(law(t, q, dq) for law in laws))

    if len(laws) < 2:
        return laws[0] if laws else None
    return torque


def _merge_friction(elements: list[DryFriction]) -> DryFriction | None:
    """Merge dry-friction elements of equal direction by adding their levels."""
    if not elements:
        return None
    directions = np.vstack([e.directions for e in elements])
    unique, inverse = np.unique(directions, axis=0, return_inverse=True)
    sums = np.zeros((3, len(unique)))
    for row, values in enumerate(
        (
            [e.lower for e in elements],
            [e.upper for e in elements],
            [np.zeros(len(e.lower)) if e.load_share is None else e.load_share for e in elements],
        )
    ):
        np.add.at(sums[row], inverse.ravel(), np.concatenate(values))
    active = np.any(np.abs(sums) > NO_FRICTION, axis=0)
    lower, upper, share = sums[:, active]
    return DryFriction(unique[active], lower, upper, share if np.any(share) else None)
