# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Simulation in which some joints follow torques and all others a prescribed motion.

The source checks its torques in this way: one joint is driven by its torque, and all others are
prescribed. If all joints are driven by torques alone, the pair is an inverted pendulum and falls.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armid_ros.errors import TrajectoryError
from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.exo.plant.leg_pair import PairMotion, TiedPair
from armid_ros.papers.exo.plant.walkers import contacts, ground_force
import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline

#: Torques of the driven joints, shape (d,) [N m], at a time [s].
DrivingTorque = Callable[[float], FloatArray]
#: Function for the rate of a state, shape (s,), at a sample of the prescribed motion.
Rate = Callable[[int, FloatArray], FloatArray]


def splined(t: FloatArray, tau: FloatArray, rate: float) -> DrivingTorque:
    """
    Return torques as a function of time: cubic splines through samples at a given rate.

    Parameters
    ----------
    t : ndarray, shape (N,)
        Time [s].
    tau : ndarray, shape (N, d)
        Torques [N m].
    rate : float
        Samples kept per second.

    """
    count = max(4, round((t[-1] - t[0]) * rate) + 1)
    knots = np.linspace(t[0], t[-1], count)
    curve = CubicSpline(knots, CubicSpline(t, tau)(knots))
    return lambda time: np.asarray(curve(time))


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


def drive_by_torque(
    pair: TiedPair,
    motion: Motion,
    other_motion: Motion,
    driven: Sequence[str],
    torque: DrivingTorque,
    *,
    on_ground: bool = False,
) -> Motion:
    """
    Simulate joints of the exoskeleton that torques drive; other joints move as prescribed.

    Parameters
    ----------
    pair : TiedPair
        The machines and their springs.
    motion, other_motion : Motion
        Prescribed motion on an even time base of an odd number of samples; the driven joints
        start from it.
    driven : sequence of str
        Joints of the machine that follow torques.
    torque : callable
        Function that returns their torques.
    on_ground : bool
        Whether the pair is free to walk, with ground under its feet.

    Returns
    -------
    Motion
        Motion of the machine at every other sample; a Runge-Kutta step of order 4 spans two.

    Raises
    ------
    TrajectoryError
        If the number of samples is even.

    """
    if len(motion) % 2 == 0:
        raise TrajectoryError(
            f'the motion has {len(motion)} samples; integration steps span two samples, so the '
            'number must be odd'
        )
    columns = [pair.robot.index(joint) for joint in driven]
    rate = _forward_dynamics(pair, PairMotion(motion, other_motion), columns, torque, on_ground)
    x = np.concatenate([motion.q[0, columns], motion.dq[0, columns]])
    rows = []
    for k in range(0, len(motion) - 2, 2):
        slope, after = runge_kutta(rate, k, float(motion.t[k + 2] - motion.t[k]), x)
        rows.append((x, slope))
        x = after
    rows.append((x, rate(len(motion) - 1, x)))
    states, slopes = (np.array(part) for part in zip(*rows, strict=True))
    count = len(columns)
    result = [np.array(part[::2]) for part in (motion.q, motion.dq, motion.ddq)]
    result[0][:, columns], result[1][:, columns] = states[:, :count], states[:, count:]
    result[2][:, columns] = slopes[:, count:]
    return replace(motion, t=motion.t[::2], q=result[0], dq=result[1], ddq=result[2], tau=None)


def _forward_dynamics(
    pair: TiedPair,
    motions: PairMotion,
    free: list[int],
    torque: DrivingTorque,
    on_ground: bool,
) -> Rate:
    """Return a function for the state derivative of the joints with indices `free`."""
    robot, own, tied = pair.robot, motions.own, len(pair.ties)
    ends = [(tie.joint, np.array(tie.point)) for tie in pair.ties]
    if on_ground:
        ends += zip(*contacts(robot), strict=True)
    model, operational = pin.Model(robot.model), pin.FrameType.OP_FRAME
    frames = [
        model.addFrame(
            pin.Frame(f'end {k}', robot.index(joint) + 1, pin.SE3(np.eye(3), point), operational)
        )
        for k, (joint, point) in enumerate(ends)
    ]
    data, count = model.createData(), len(free)
    far = pair.geometry(own, motions.other).other_position
    aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def rate(k: int, x: FloatArray) -> FloatArray:
        q, dq, ddq = (np.array(part[k]) for part in (own.q, own.dq, own.ddq))
        q[free], dq[free], ddq[free] = x[:count], x[count:], 0.0
        load = pin.rnea(model, data, q, dq, ddq)
        inertia = pin.crba(model, data, q)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        place = np.array([data.oMf[frame].translation for frame in frames])
        jacobian = np.array(
            [pin.getFrameJacobian(model, data, frame, aligned)[:3] for frame in frames]
        )
        force = np.zeros_like(place)
        force[:tied] = pair.forces(place[:tied] - far[k])
        if on_ground:
            feet, moving = place[tied:], jacobian[tied:] @ dq
            force[tied:, ::2] = ground_force(feet[:, 2], moving[:, 2], moving[:, 0])
        push = torque(float(own.t[k])) - load[free]
        push += np.einsum('cxj,cx->j', jacobian, force)[free]
        return np.concatenate([x[count:], np.linalg.solve(inertia[np.ix_(free, free)], push)])

    return rate


@dataclass(frozen=True)
class GaitCheck:
    """
    Motion of one torque-driven joint, and the error relative to the prescribed motion.

    Attributes
    ----------
    joint : str
        The driven joint.
    prescribed : ndarray, shape (N,)
        Its prescribed position [rad].
    motion : Motion
        Motion of the machine.

    """

    joint: str
    prescribed: FloatArray
    motion: Motion

    @property
    def followed(self) -> FloatArray:
        """Position of the torque-driven joint, shape (N,) [rad]."""
        return np.asarray(self.motion.q[:, self.motion.joints.index(self.joint)])

    @property
    def error(self) -> FloatArray:
        """Position error of the torque-driven joint, shape (N,) [rad]."""
        return self.followed - self.prescribed

    @property
    def most(self) -> float:
        """Largest position error of the torque-driven joint [deg]."""
        return float(np.degrees(np.abs(self.error).max()))
