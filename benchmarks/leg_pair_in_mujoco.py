# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The human-exoskeleton leg pair in MuJoCo, to compare torques of two engines.

MuJoCo reads both descriptions itself; the springs are tendons. Prescribed joints follow the
reference: their armature is so large that other torques do not move them, a torque accelerates
it, and their state is reset to the reference after every step.

"""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.exo.plant.leg_pair import PairMotion, TiedPair
from armid_ros.papers.exo.plant.torque_driven import DrivingTorque
import mujoco
import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from tests.hidden.leg_pair import side_by_side

#: Inertia of a prescribed joint [kg m^2].
_HEAVY = 1e8
#: Steps of the engine per sample of the reference.
_SUBSTEPS = 4


def pair_model(pair: TiedPair) -> mujoco.MjModel:
    """Return a MuJoCo model of both machines with their ties."""
    spec = mujoco.MjSpec.from_string(side_by_side(pair.robot.urdf, pair.other.urdf))
    for number, tie in enumerate(pair.ties):
        ends = ((pair.robot, tie.joint, tie.point), (pair.other, tie.other_joint, tie.other_point))
        tendon = spec.add_tendon(name=tie.name, springlength=[0.0, pair.slack[number]])
        for side, (robot, joint, point) in enumerate(ends):
            name = f'{tie.name}_{side}'
            body = spec.body(robot.links[robot.index(joint)])
            body.add_site(name=name, pos=point)
            tendon.wrap_site(name)
    spec.option.gravity = pair.robot.gravity
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT
    model = spec.compile()
    model.tendon_stiffness[:] = pair.stiffness
    return model


def drive_in_mujoco(
    pair: TiedPair, motions: PairMotion, driven: Sequence[str], torque: DrivingTorque
) -> FloatArray:
    """
    Simulate driven joints of the machine by torques; all other joints have prescribed motion.

    Returns
    -------
    ndarray, shape (N, d)
        Positions of the driven joints at the samples of the reference [rad].

    """
    model = pair_model(pair)
    model.opt.timestep = float(np.diff(motions.own.t).mean()) / _SUBSTEPS
    names = (*pair.robot.joints, *pair.other.joints)
    columns = np.array([model.joint(name).qposadr[0] for name in names])
    free = np.array([model.joint(name).qposadr[0] for name in driven])
    model.dof_armature[:] = _HEAVY
    model.dof_armature[free] = 0.0
    held = np.setdiff1d(np.arange(model.nv), free)
    curves = [_curves(motion) for motion in motions]
    data = mujoco.MjData(model)

    def reference(t: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        parts = np.empty((3, model.nv))
        parts[:, columns] = np.hstack([[curve(t) for curve in own] for own in curves])
        return parts[0], parts[1], parts[2]

    data.qpos[:], data.qvel[:], _ = reference(float(motions.own.t[0]))
    path = [data.qpos[free].copy()]
    for step in range(_SUBSTEPS * (len(motions.own.t) - 1)):
        t = float(motions.own.t[0]) + step * model.opt.timestep
        middle = t + model.opt.timestep / 2.0
        data.qfrc_applied[:] = _HEAVY * reference(middle)[2]
        data.qfrc_applied[free] = torque(middle)
        mujoco.mj_step(model, data)
        q, dq, _ = reference(t + model.opt.timestep)
        data.qpos[held], data.qvel[held] = q[held], dq[held]
        if (step + 1) % _SUBSTEPS == 0:
            path.append(data.qpos[free].copy())
    return np.array(path)


def _curves(
    motion: Motion,
) -> tuple[CubicHermiteSpline, CubicHermiteSpline, CubicSpline]:
    return (
        CubicHermiteSpline(motion.t, motion.q, motion.dq),
        CubicHermiteSpline(motion.t, motion.dq, motion.ddq),
        CubicSpline(motion.t, motion.ddq),
    )
