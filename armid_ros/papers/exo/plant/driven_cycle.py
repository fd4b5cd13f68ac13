# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
One joint walks a whole cycle by its torque, on the ground, with hips that nothing holds.

The source puts computed torques into another engine and reads off how far hip and knee are from
the gait. Here the torque of one joint is sampled and splined and drives it; the other joints move
as prescribed, and the machine's hips go wherever springs, weight and ground push them.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.model.kinematics import points_motion
from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.exo.plant.gait_cycle import GaitCycle, walking_torques
from armid_ros.papers.exo.plant.leg_pair import TiedPair
from armid_ros.papers.exo.plant.torque_driven import DrivingTorque, GaitCheck, splined
from armid_ros.papers.exo.plant.walkers import contacts, floating, leg_length
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin

_PLANE = np.array([0, 2])


@dataclass(frozen=True)
class DrivenCycle:
    """
    A cycle of which one joint was walked by its torque.

    Attributes
    ----------
    check : GaitCheck
        The joint against what was prescribed.
    motion : Motion
        Positions of the machine at the samples of the check.

    """

    check: GaitCheck
    motion: Motion


def check_cycle(
    cycle: GaitCycle,
    joint: str,
    rate: float,
    believed: TiedPair | None = None,
    ground_forces: FloatArray | None = None,
) -> DrivenCycle:
    """
    Let one joint of the machine walk a cycle by its torque.

    Parameters
    ----------
    cycle : GaitCycle
        What was prescribed, and what acts then.
    joint : str
        The joint that follows its torque.
    rate : float
        Torque samples per second, joined by cubic splines.
    believed : TiedPair, optional
        The machines that the torques are computed for; by default those that there are.
    ground_forces : ndarray, shape (N, 4, 2), optional
        Forces on heels and toes that the torques are computed for [N]; by default those that
        there are.

    """
    own = cycle.motions.own
    robot = cycle.pair.robot
    free = [robot.index(name) for name in driven_joints(robot, joint)]
    torque = driving_torque(cycle, joint, rate, believed, ground_forces)
    body = _Body(cycle, free)
    x = np.concatenate([own.q[0, free], own.dq[0, free]])
    states = [x]
    for k in range(0, len(own) - 2, 2):
        h = float(own.t[k + 2] - own.t[k])
        taus = [torque(float(own.t[k + part])) for part in range(3)]
        a = body.rate(k, x, taus[0])
        b = body.rate(k + 1, x + 0.5 * h * a, taus[1])
        c = body.rate(k + 1, x + 0.5 * h * b, taus[1])
        d = body.rate(k + 2, x + h * c, taus[2])
        x = x + h / 6.0 * (a + 2.0 * (b + c) + d)
        states.append(x)
    moved = own.select(slice(None, None, 2))
    q = np.array(moved.q)
    q[:, free] = np.array(states)[:, :3]
    check = GaitCheck(joint, moved.t, moved.q[:, free[2]], q[:, free[2]])
    return DrivenCycle(check, replace(moved, q=q))


def driven_joints(robot: Robot, joint: str) -> list[str]:
    """Return what moves freely when a joint is driven: hips forward and up, and the joint."""
    return [*(robot.joints[place] for place in floating(robot)[:2]), joint]


def driving_torque(
    cycle: GaitCycle,
    joint: str,
    rate: float,
    believed: TiedPair | None = None,
    ground_forces: FloatArray | None = None,
) -> DrivingTorque:
    """Return nothing for the hips, and the splined torque of a joint, shape (3,) [N, N m]."""
    tau = cycle.torques.tau
    if believed is not None or ground_forces is not None:
        on_feet = cycle.ground if ground_forces is None else ground_forces
        pair = believed or cycle.pair
        tau = walking_torques(pair, cycle.motions, on_feet, cycle.other_ground).tau
    curve = splined(cycle.motions.own.t, tau[:, [cycle.pair.robot.index(joint)]], rate)
    return lambda t: np.concatenate([[0.0, 0.0], curve(t)])


class _Body:
    """The machine of a cycle, of which some joints move freely and all others as prescribed."""

    def __init__(self, cycle: GaitCycle, free: list[int]):
        pair = cycle.pair
        robot = pair.robot
        self._pair, self._ground, self._free = pair, cycle.soil, free
        self._own = cycle.motions.own
        self._model = robot.model.copy()
        self._model.gravity = robot.model.gravity
        joints, points = contacts(robot, leg_length(robot))
        ends = [
            *zip(joints, points, strict=True),
            *((tie.joint, np.array(tie.point)) for tie in pair.ties),
        ]
        self._frames = [
            self._model.addFrame(
                pin.Frame(
                    f'end {k}',
                    robot.index(joint) + 1,
                    0,
                    pin.SE3(np.eye(3), point),
                    pin.FrameType.OP_FRAME,
                )
            )
            for k, (joint, point) in enumerate(ends)
        ]
        self._feet = len(joints)
        self._data = self._model.createData()
        other = cycle.motions.other
        far, jacobian = points_motion(
            pair.other,
            [tie.other_joint for tie in pair.ties],
            np.array([tie.other_point for tie in pair.ties]),
            other.q,
        )
        self._far = far[..., _PLANE]
        self._far_speed = np.einsum('nsxj,nj->nsx', jacobian, other.dq)[..., _PLANE]

    def rate(self, k: int, x: FloatArray, tau: FloatArray) -> FloatArray:
        """Return speeds and accelerations of the free joints at sample k."""
        model, data, free = self._model, self._data, self._free
        q, dq, ddq = (np.array(part[k]) for part in (self._own.q, self._own.dq, self._own.ddq))
        count = len(free)
        q[free], dq[free], ddq[free] = x[:count], x[count:], 0.0
        load = pin.rnea(model, data, q, dq, ddq)
        inertia = pin.crba(model, data, q)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        place = np.array([data.oMf[frame].translation for frame in self._frames])[:, _PLANE]
        jacobian = np.array(
            [pin.getFrameJacobian(model, data, frame, aligned)[_PLANE] for frame in self._frames]
        )
        speed = jacobian @ dq
        feet = slice(self._feet)
        ties = slice(self._feet, None)
        touch = self._ground.force(place[feet, 1], speed[feet, 1], speed[feet, 0])
        spring = self._pair.law(place[ties] - self._far[k], speed[ties] - self._far_speed[k])
        outside = np.einsum('cxj,cx->j', jacobian, np.concatenate([touch, spring]))
        push = tau - load[free] + outside[free]
        return np.concatenate([x[count:], np.linalg.solve(inertia[np.ix_(free, free)], push)])
