# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Simulation of a gait cycle of exoskeleton and wearer, with ground forces on their feet.

Joint motion is prescribed by a walkable gait, and the lean of the trunks is constant. The hips
move under the forces of weight, springs, and the ground at both heels and toes, equation (27).
Foot contact follows from the simulation and is not prescribed. Torques come from Newton and Euler
with all forces. The force on the hips is zero.

The remaining moment on the trunk is an external moment that prevents a fall. The source
determines the forces on two feet by equations (20) to (22): the distances of the thighs from the
trunk divide the trunk between the legs. A foot then bears weight and inertial force of its leg
and of its share of the trunk, minus the spring forces. A single foot bears the total.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armid_ros.model import inverse_dynamics
from armid_ros.model.kinematics import points_motion
from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.papers.exo.plant.gait import Gait, read_assumptions, read_gait
from armid_ros.papers.exo.plant.leg_pair import pair_torques, PairMotion, PairTorques, TiedPair
from armid_ros.papers.exo.plant.walkers import (
    columns,
    contacts,
    floating,
    ground_force,
    leg_length,
    SEGMENTS,
    SIDES,
    walkable,
    WalkableGait,
)
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

#: Function for the rate of a state, shape (s,), at a sample of the prescribed motion.
Rate = Callable[[int, FloatArray], FloatArray]
#: Integration steps per cycle.
_STEPS_PER_CYCLE = 2400
_PLANE = np.array([0, 2])


@dataclass(frozen=True, eq=False)
class WalkingMachine:
    """
    Motion, forces and torques of exoskeleton or wearer over a gait cycle of N samples.

    Attributes
    ----------
    robot : Robot
        The machine, free to walk.
    motion : Motion
        Its motion, including the floating joints forward, up and lean.
    ground : ndarray, shape (N, 4, 2)
        Force on right heel and toe and left heel and toe, forward and up [N].
    springs : ndarray, shape (N, S, 3)
        Force of each spring on the machine [N].
    tau : ndarray, shape (N, n)
        Torques of all joints; those of the floating joints are the remaining external forces.

    """

    robot: Robot
    motion: Motion
    ground: FloatArray
    springs: FloatArray
    tau: FloatArray

    @property
    def weight(self) -> float:
        """Weight of the machine [N]."""
        mass = self.robot.rigid_parameters[::10].sum()
        return float(mass * np.linalg.norm(self.robot.gravity))

    @property
    def feet(self) -> FloatArray:
        """Ground force on right and left foot, forward and up components, (N, 2, 2) [N]."""
        return np.asarray(self.ground.reshape(-1, 2, 2, 2).sum(axis=2))

    @property
    def trunk_moment(self) -> FloatArray:
        """External moment that keeps the lean of the trunk constant, shape (N,) [N m]."""
        return np.asarray(self.tau[:, floating(self.robot)[2]])

    @property
    def support(self) -> npt.NDArray[np.int_]:
        """Number of feet on the ground, shape (N,)."""
        # smallest load of a supporting foot: 1 % of the weight
        return np.asarray(np.sum(self.feet[:, :, 1] > 0.01 * self.weight, axis=1))

    def feet_by_shares(self) -> FloatArray:
        """Return foot forces, (N, 2, 2) [N], by equations (20) to (22) of the source paper."""
        robot, motion = self.robot, self.motion
        # centroids and m (c'' - g) of all bodies
        bodies = list(robot.model.inertias)[1:]
        levers = np.array([body.lever for body in bodies])
        place, jacobian = points_motion(robot, list(robot.joints), levers, motion.q)
        speed = np.einsum('ncxj,nj->ncx', jacobian, motion.dq)
        acceleration = np.gradient(speed, motion.t, axis=0)
        mass = np.array([body.mass for body in bodies])
        taken = mass[:, np.newaxis] * (acceleration - robot.gravity)
        place, taken = place[..., _PLANE], taken[..., _PLANE]
        trunk = floating(robot)[2]
        legs = [columns(robot, side) for side in SIDES]
        # shares of the trunk, (20) to (22): the leg with the nearer thigh carries more
        far = np.linalg.norm(place[:, [leg[0] for leg in legs]] - place[:, [trunk]], axis=-1)
        shares = far[:, ::-1] / far.sum(axis=1, keepdims=True)
        feet = np.empty((len(motion), 2, 2))
        for foot, (side, own) in enumerate(zip(SIDES, legs, strict=True)):
            tied = [name.startswith(side) for name in SEGMENTS]
            feet[:, foot] = taken[:, own].sum(axis=1) + shares[:, [foot]] * taken[:, trunk]
            feet[:, foot] -= self.springs[:, tied][..., _PLANE].sum(axis=1)
        bearing = self.feet[:, :, 1] > 0.0
        for foot in range(2):
            alone = bearing[:, foot] & ~bearing[:, 1 - foot]
            feet[alone, foot] = feet[alone].sum(axis=1)
            feet[alone, 1 - foot] = 0.0
        return feet


@dataclass(frozen=True, eq=False)
class GaitCycle:
    """
    Simulated gait cycle of exoskeleton and wearer, between two right heel strikes.

    Attributes
    ----------
    pair : TiedPair
        Both machines and their springs.
    phase : ndarray, shape (N,)
        Phase of the right leg, 0 to 1.
    own, other : WalkingMachine
        The machine (exoskeleton) and its wearer.

    """

    pair: TiedPair
    phase: FloatArray
    own: WalkingMachine
    other: WalkingMachine

    @property
    def motions(self) -> PairMotion:
        """Motions of exoskeleton and wearer."""
        return PairMotion(self.own.motion, self.other.motion)

    def torques(
        self, pair: TiedPair | None = None, ground: FloatArray | None = None
    ) -> FloatArray:
        """Return joint torques of the exoskeleton, (N, n), for given straps or ground forces."""
        feet = self.own.ground if ground is None else ground
        forces = (feet, self.other.ground)
        return walking_torques(pair or self.pair, self.motions, forces).tau


def gait_cycle(pair: TiedPair) -> GaitCycle:
    """
    Simulate three gait cycles of exoskeleton and wearer, and return the last cycle.

    The gait of the wearer is the walkable gait nearest to the shipped one.

    Parameters
    ----------
    pair : TiedPair
        A pair that is free to walk: ``walking_pair``.

    """
    known = read_assumptions()
    cycle, delay = known['cycle_time'].value, known['exoskeleton_delay'].value
    wearer_gait = walkable(read_gait(), leg_length(pair.other), cycle)
    phase = np.arange(100) / 100.0
    offset = np.radians(known['walking_offset_deg'].value)
    desired = known['exoskeleton_scale'].value * wearer_gait.gait(phase) + offset
    own_gait = walkable(
        Gait.fit(phase, desired, harmonics=8),
        leg_length(pair.robot),
        cycle,
        stride=wearer_gait.stride,
        lean=wearer_gait.lean,
    )
    half = np.arange(2 * _STEPS_PER_CYCLE) / (2.0 * _STEPS_PER_CYCLE)
    robots = pair.robot, pair.other
    legs = PairMotion(
        _joint_motion(pair.robot, own_gait, half * cycle, half - delay / cycle, cycle),
        _joint_motion(pair.other, wearer_gait, half * cycle, half, cycle),
    )
    places, speeds = [], []  # planned position and velocity of the hips, machine and wearer
    for plan, lag in ((own_gait, delay), (wearer_gait, 0.0)):
        count = len(plan.hips)
        path = plan.hips + np.outer(np.arange(count) / count, [plan.stride, 0.0])
        speeds.append(np.gradient(path, axis=0)[2] * count / cycle)
        places.append(path[0] - speeds[-1] * lag)
    start = np.concatenate([*places, *speeds])
    states, rates = _walk(pair, legs, start, cycle)
    rows = np.append(np.arange(0, 2 * _STEPS_PER_CYCLE, 2), 0)
    whole, ground = [], []
    for k, (robot, motion) in enumerate(zip(robots, legs, strict=True)):
        parts = [part[rows] for part in (motion.q, motion.dq, motion.ddq)]
        hips = states[:, 0, k], states[:, 1, k], rates[:, 1, k]
        for values, moved in zip(parts, hips, strict=True):
            values[:, floating(robot)[:2]] = moved
        whole.append(Motion(motion.joints, np.linspace(0.0, cycle, len(rows)), *parts))
        place, speed = _contact_motion(robot, whole[k])
        ground.append(read_only(ground_force(place[..., 1], speed[..., 1], speed[..., 0])))
    motions = PairMotion(*whole)
    found = walking_torques(pair, motions, ground)
    own = WalkingMachine(pair.robot, motions.own, ground[0], found.forces, found.tau)
    other = WalkingMachine(pair.other, motions.other, ground[1], -found.forces, found.other_tau)
    return GaitCycle(pair, read_only(np.linspace(0.0, 1.0, _STEPS_PER_CYCLE + 1)), own, other)


def _contact_motion(robot: Robot, motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Return positions and velocities of heels and toes, each (N, 4, 2): forward and up."""
    place, jacobian = points_motion(robot, *contacts(robot), motion.q)
    speed = np.einsum('ncxj,nj->ncx', jacobian, motion.dq)
    return place[..., _PLANE], speed[..., _PLANE]


def walking_torques(
    pair: TiedPair, motions: PairMotion, ground: Sequence[FloatArray]
) -> PairTorques:
    """
    Return joint torques of both machines under strap and ground forces, by equation (27).

    Parameters
    ----------
    pair : TiedPair
        Pair that is free to walk.
    motions : PairMotion
        Motions of both machines.
    ground : sequence of ndarray, each of shape (N, 4, 2)
        Forces on heels and toes of the machine and of the other one, forward and up [N].

    """
    found = pair_torques(pair, *motions)
    robots, torques = (pair.robot, pair.other), (found.tau, found.other_tau)
    parts = []
    for robot, motion, forces, tau in zip(robots, motions, ground, torques, strict=True):
        _, jacobian = points_motion(robot, *contacts(robot), motion.q)
        parts.append(tau - np.einsum('ncxj,ncx->nj', jacobian[:, :, _PLANE], forces))
    return replace(found, tau=read_only(parts[0]), other_tau=read_only(parts[1]))


def _joint_motion(
    robot: Robot, plan: WalkableGait, t: FloatArray, phase: FloatArray, cycle: float
) -> Motion:
    """Return the planned motion of all joints of a machine, with hips at the origin."""
    parts = np.zeros((3, len(t), robot.n_joints))
    for order in range(3):
        for side, shift in zip(SIDES, (0.0, 0.5), strict=True):
            angles = plan.gait(phase + shift, order) / cycle**order
            parts[order][:, columns(robot, side)] = angles
    parts[0][:, floating(robot)[2]] = plan.lean
    return Motion(robot.joints, t, *parts)


def _walk(
    pair: TiedPair, legs: PairMotion, start: FloatArray, cycle: float
) -> tuple[FloatArray, FloatArray]:
    """
    Integrate the hip motions over three gait cycles; return states and rates of the last.

    States and rates of the last cycle have the shape (N, 2, 2, 2): position and velocity, of the
    machine and its wearer, forward and up.

    """
    robots = pair.robot, pair.other
    ends = [_contact_motion(robot, motion) for robot, motion in zip(robots, legs, strict=True)]
    contact, contact_speed = (np.stack(part, axis=1) for part in zip(*ends, strict=True))
    # weight and inertial force of the bodies if the hips do not move [N]
    pull = np.stack(
        [
            -inverse_dynamics(robot, motion)[:, floating(robot)[:2]]
            for robot, motion in zip(robots, legs, strict=True)
        ],
        axis=1,
    )
    way = pair.geometry(*legs).way[..., _PLANE]
    mass = np.array([[robot.rigid_parameters[::10].sum()] for robot in robots])

    def rate(k: int, x: FloatArray) -> FloatArray:
        k %= 2 * _STEPS_PER_CYCLE
        hips, velocity = x.reshape(2, 2, 2)
        points = contact[k] + hips[:, np.newaxis]
        moving = contact_speed[k] + velocity[:, np.newaxis]
        force = ground_force(points[..., 1], moving[..., 1], moving[..., 0]).sum(axis=1)
        spring = pair.forces(way[k] + hips[0] - hips[1]).sum(axis=0)
        force += pull[k] + np.stack([spring, -spring])
        return np.concatenate([velocity.ravel(), (force / mass).ravel()])

    h, x = cycle / _STEPS_PER_CYCLE, start
    states, rates = np.empty((2, _STEPS_PER_CYCLE + 1, 8))
    for _ in range(3):  # the last one is returned
        for step in range(_STEPS_PER_CYCLE):
            states[step] = x
            rates[step], x = runge_kutta(rate, 2 * step, h, x)
        states[-1], rates[-1] = x, rate(0, x)
    return states.reshape(-1, 2, 2, 2), rates.reshape(-1, 2, 2, 2)


def runge_kutta(rate: Rate, k: int, h: float, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Integrate a state from sample k to sample k + 2 by one Runge-Kutta step of order 4.

    Parameters
    ----------
    rate : callable
        Function that returns the time derivative of the state at a sample.
    k : int
        First sample.
    h : float
        Time from sample k to k + 2 [s].
    x : ndarray, shape (s,)
        State at sample k.

    Returns
    -------
    slope, after : ndarray, shape (s,)
        Time derivative at sample k, and state at sample k + 2.

    """
    a = rate(k, x)
    b = rate(k + 1, x + 0.5 * h * a)
    c = rate(k + 1, x + 0.5 * h * b)
    d = rate(k + 2, x + h * c)
    return a, x + h / 6.0 * (a + 2.0 * (b + c) + d)


def ground_by_shares(cycle: GaitCycle) -> FloatArray:
    """
    Return ground forces on heels and toes, (N, 4, 2) [N], by equations (20) to (22).

    The equations do not give the centre of pressure, so that of the simulated ground is used.

    """
    feet = cycle.own.feet_by_shares()
    up = cycle.own.ground[..., 1].reshape(-1, 2, 2)
    whole = up.sum(axis=2, keepdims=True)
    part = np.where(whole > 0.0, up / np.where(whole > 0.0, whole, 1.0), 0.5)
    return np.asarray((part[..., np.newaxis] * feet[:, :, np.newaxis]).reshape(-1, 4, 2))
