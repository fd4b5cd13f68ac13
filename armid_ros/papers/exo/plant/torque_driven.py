# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Simulation of a gait cycle in which one joint of the exoskeleton follows a torque.

The source checks its torques in this way: one joint is driven by its torque, and all others are
prescribed. If all joints are driven by torques alone, the pair is an inverted pendulum and falls.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.exo.plant.gait_cycle import GaitCycle, Rate, runge_kutta
from armid_ros.papers.exo.plant.walkers import contacts, floating, ground_force
import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline


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


def driving_torque(
    cycle: GaitCycle, joint: str, rate: float, tau: FloatArray | None = None
) -> CubicSpline:
    """
    Return the torque of a joint as a function of time [s]: cubic splines at a given rate.

    Parameters
    ----------
    cycle : GaitCycle
        Gait cycle.
    joint : str
        Joint of the exoskeleton.
    rate : float
        Samples kept per second.
    tau : ndarray, shape (N, n), optional
        Torques of the machine [N m]; by default those of the cycle.

    """
    t, own = cycle.own.motion.t, cycle.own.tau if tau is None else tau
    knots = np.linspace(t[0], t[-1], max(4, round((t[-1] - t[0]) * rate) + 1))
    return CubicSpline(knots, CubicSpline(t, own[:, cycle.pair.robot.index(joint)])(knots))


def check_cycle(
    cycle: GaitCycle, joint: str, rate: float, tau: FloatArray | None = None
) -> GaitCheck:
    """
    Simulate a gait cycle in which a given torque drives one joint of the exoskeleton.

    The source does this check in another simulator and gives the errors of hip and knee. The hips
    are free, and the feet touch the ground. A Runge-Kutta step of order 4 spans two samples, so
    the result has every other sample.

    Parameters
    ----------
    cycle : GaitCycle
        Prescribed motion, and its forces.
    joint : str
        The joint that follows its torque.
    rate : float
        Torque samples per second, joined by cubic splines.
    tau : ndarray, shape (N, n), optional
        Torques of the machine [N m]; by default those of the cycle.

    """
    robot, motion = cycle.pair.robot, cycle.own.motion
    free = [*floating(robot)[:2], robot.index(joint)]
    slope = _forward_dynamics(cycle, free, driving_torque(cycle, joint, rate, tau))
    x = np.concatenate([motion.q[0, free], motion.dq[0, free]])
    rows = []
    for k in range(0, len(motion) - 2, 2):
        now, after = runge_kutta(slope, k, float(motion.t[k + 2] - motion.t[k]), x)
        rows.append((x, now))
        x = after
    rows.append((x, slope(len(motion) - 1, x)))
    states, slopes = (np.array(part) for part in zip(*rows, strict=True))
    q, dq, ddq = (np.array(part[::2]) for part in (motion.q, motion.dq, motion.ddq))
    q[:, free], dq[:, free], ddq[:, free] = states[:, :3], states[:, 3:], slopes[:, 3:]
    moved = replace(motion, t=motion.t[::2], q=q, dq=dq, ddq=ddq, tau=None)
    return GaitCheck(joint, motion.q[::2, free[2]], moved)


def _forward_dynamics(
    cycle: GaitCycle, free: list[int], torque: Callable[[float], FloatArray]
) -> Rate:
    """Return a function for the state derivative of the hips and of the driven joint."""
    pair, robot, own, tied = cycle.pair, cycle.pair.robot, cycle.own.motion, len(cycle.pair.ties)
    ends = [(tie.joint, np.array(tie.point)) for tie in pair.ties]
    ends += zip(*contacts(robot), strict=True)
    model, operational = pin.Model(robot.model), pin.FrameType.OP_FRAME
    frames = [
        model.addFrame(
            pin.Frame(f'end {k}', robot.index(joint) + 1, pin.SE3(np.eye(3), point), operational)
        )
        for k, (joint, point) in enumerate(ends)
    ]
    data, count = model.createData(), len(free)
    far = pair.geometry(*cycle.motions).other_position
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
        feet, moving = place[tied:], jacobian[tied:] @ dq
        force = np.zeros_like(place)
        force[:tied] = pair.forces(place[:tied] - far[k])
        force[tied:, ::2] = ground_force(feet[:, 2], moving[:, 2], moving[:, 0])
        push = np.einsum('cxj,cx->j', jacobian, force)[free] - load[free]
        push[-1] += torque(float(own.t[k]))  # no force acts on the hips
        return np.concatenate([x[count:], np.linalg.solve(inertia[np.ix_(free, free)], push)])

    return rate
