# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Hybrid dynamics of a tied pair: some joints follow torques, all others a prescribed motion.

That is how the source checks its torques: one joint walks by its torque, the rest of both bodies
as prescribed. With every joint driven by torques alone the pair is an inverted pendulum that
nothing holds, and falls.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armid_ros.errors import TrajectoryError
from armid_ros.model.spring_ties import tie_geometry
from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.exo.plant.leg_pair import pair_torques, PairMotion, TiedPair
import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline

#: Torques of the driven joints, shape (d,) [N m], at a time [s].
DrivingTorque = Callable[[float], FloatArray]


def splined(t: FloatArray, tau: FloatArray, rate: float) -> DrivingTorque:
    """
    Sample torques at a rate and draw cubic splines through the samples.

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


def drive_by_torque(
    pair: TiedPair,
    motion: Motion,
    other_motion: Motion,
    driven: Sequence[str],
    torque: DrivingTorque,
) -> Motion:
    """
    Integrate the driven joints of the machine; everything else moves as prescribed.

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
        Their torques.

    Returns
    -------
    Motion
        Of the machine at every other sample: one Runge-Kutta step of order 4 spans two.

    Raises
    ------
    TrajectoryError
        If the number of samples is even.

    """
    if len(motion) % 2 == 0:
        raise TrajectoryError(f'{len(motion)} samples; steps of two take an odd number')
    columns = [pair.robot.index(joint) for joint in driven]
    model = pair.robot.model
    data = model.createData()

    def acceleration(k: int, q: FloatArray, dq: FloatArray) -> FloatArray:
        state = [np.array(part[k]) for part in (motion.q, motion.dq, motion.ddq)]
        state[0][columns], state[1][columns], state[2][columns] = q, dq, 0.0
        load = pin.rnea(model, data, *state) - _spring_torque(pair, other_motion, k, *state[:2])
        inertia = pin.crba(model, data, state[0])
        tau = torque(float(motion.t[k]))
        return np.asarray(np.linalg.solve(inertia[np.ix_(columns, columns)], tau - load[columns]))

    q, dq = np.array(motion.q[0, columns]), np.array(motion.dq[0, columns])
    rows = [(q, dq, acceleration(0, q, dq))]
    for k in range(0, len(motion) - 2, 2):
        q, dq = _step(acceleration, k, float(motion.t[k + 2] - motion.t[k]), q, dq)
        rows.append((q, dq, acceleration(k + 2, q, dq)))
    result = [np.array(part[::2]) for part in (motion.q, motion.dq, motion.ddq)]
    for values, part in zip(result, zip(*rows, strict=True), strict=True):
        values[:, columns] = part
    return replace(motion, t=motion.t[::2], q=result[0], dq=result[1], ddq=result[2], tau=None)


@dataclass(frozen=True)
class GaitCheck:
    """
    One joint driven by its torque, against what was prescribed.

    Attributes
    ----------
    joint : str
        The driven joint.
    t : ndarray, shape (N,)
        Time [s].
    prescribed, followed : ndarray, shape (N,)
        Position [rad].

    """

    joint: str
    t: FloatArray
    prescribed: FloatArray
    followed: FloatArray

    @property
    def error(self) -> FloatArray:
        """How far the joint is off, shape (N,) [rad]."""
        return self.followed - self.prescribed


def check_gait(
    pair: TiedPair, motions: PairMotion, joint: str, rate: float, believed: TiedPair | None = None
) -> GaitCheck:
    """
    Let one joint of the machine walk by its torque, as the source does.

    Parameters
    ----------
    pair : TiedPair
        The machines as they are.
    motions : PairMotion
        What was prescribed.
    joint : str
        The joint that follows its torque.
    rate : float
        Torque samples per second, joined by cubic splines.
    believed : TiedPair, optional
        The machines that the torques are computed for; by default those that there are.

    """
    own, other = motions
    column = pair.robot.index(joint)
    tau = pair_torques(believed or pair, own, other).tau[:, [column]]
    moved = drive_by_torque(pair, own, other, [joint], splined(own.t, tau, rate))
    return GaitCheck(joint, moved.t, own.q[::2, column], moved.q[:, column])


def _step(
    acceleration: Callable[[int, FloatArray, FloatArray], FloatArray],
    k: int,
    h: float,
    q: FloatArray,
    dq: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Advance over samples k to k + 2, of which k + 1 is the middle."""
    a1 = acceleration(k, q, dq)
    v2 = dq + 0.5 * h * a1
    a2 = acceleration(k + 1, q + 0.5 * h * dq, v2)
    v3 = dq + 0.5 * h * a2
    a3 = acceleration(k + 1, q + 0.5 * h * v2, v3)
    v4 = dq + h * a3
    a4 = acceleration(k + 2, q + h * v3, v4)
    return q + h / 6.0 * (dq + 2.0 * (v2 + v3) + v4), dq + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)


def _spring_torque(
    pair: TiedPair, other_motion: Motion, k: int, q: FloatArray, dq: FloatArray
) -> FloatArray:
    """Return what the springs do to the machine's joints at sample k of the other one."""
    now = tie_geometry(pair.robot, q[np.newaxis], pair.other, other_motion.q[[k]], pair.ties)
    own = np.einsum('sxj,j->sx', now.jacobian[0], dq)
    far = np.einsum('sxj,j->sx', now.other_jacobian[0], other_motion.dq[k])
    force = pair.law(now.way[0], own - far)
    return np.asarray(np.einsum('sxj,sx->j', now.jacobian[0], force))
