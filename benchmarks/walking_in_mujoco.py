# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The walking leg pair in MuJoCo: a whole cycle on the ground of the source's Table 3.

MuJoCo reads both bodies from their descriptions; the springs are tendons. The ground is
implemented here independently, as a force on heels and toes at every stage of the integrator.
Prescribed joints have so large an armature that other torques do not move them, and their state is
reset after every step. The hips of both machines are free, and a joint may follow a torque.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from xml.etree import ElementTree

from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.gait_cycle import GaitCycle
from armid_ros.papers.exo.plant.leg_pair import TiedPair
import mujoco
import numpy as np
from scipy.interpolate import CubicHermiteSpline

from tests.hidden.leg_pair import side_by_side

#: Inertia of a prescribed joint [kg m^2].
_HEAVY = 1e8
_FOOT = 0.2572
_MACHINES, _LEGS = ('exo', 'human'), ('right', 'left')


@dataclass(frozen=True)
class Walked:
    """
    A simulated cycle.

    Attributes
    ----------
    driven : ndarray, shape (N,)
        Position of the joint that follows a torque [rad]; empty without one.
    hips : ndarray, shape (N, 2, 2)
        Positions of the hips of machine and wearer, forward and up [m].
    feet : ndarray, shape (N, 2, 2, 2)
        Force on machine and wearer, right and left foot, forward and up [N].

    """

    driven: FloatArray
    hips: FloatArray
    feet: FloatArray


def ground(height: float, speed: FloatArray) -> FloatArray:
    """Return the ground force on a point, (3,) [N]: 100 N/mm^1.5, 1 N s/mm, friction 0.3."""
    if height >= 0.0:
        return np.zeros(3)
    up = max(1e5 * 10.0**1.5 * (-height) ** 1.5 - 1e3 * speed[2], 0.0)
    return np.array([-0.3 * np.tanh(speed[0] / 0.01) * up, 0.0, up])


def walk_in_mujoco(
    cycle: GaitCycle, joint: str | None = None, torque: Callable[[float], float] | None = None
) -> Walked:
    """Simulate a cycle of both; a joint of the machine follows a torque, if one is given."""
    model = _model(cycle.pair)
    own, other = cycle.motions
    step = float(own.t[1] - own.t[0])
    model.opt.timestep = step
    places = np.array([model.joint(n).qposadr[0] for n in (*own.joints, *other.joints)])
    hips = [model.joint(f'{m}_{n}').qposadr[0] for m in _MACHINES for n in ('forward', 'up')]
    driven = [] if joint is None else [model.joint(joint).qposadr[0]]
    held = np.setdiff1d(np.arange(model.nv), [*hips, *driven])
    model.dof_armature[held] = _HEAVY
    curves = [
        (CubicHermiteSpline(m.t, m.q, m.dq), CubicHermiteSpline(m.t, m.dq, m.ddq))
        for m in (own, other)
    ]

    def reference(t: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        parts = np.empty((3, model.nv))
        rows = [np.stack([place(t), speed(t), speed(t, 1)]) for place, speed in curves]
        parts[:, places] = np.hstack(rows)
        return parts[0], parts[1], parts[2]

    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], _ = reference(0.0)
    sites = [model.site(f'{m}_{s}_{e}').id for m in _MACHINES for s in _LEGS for e in range(2)]
    forces, jacobian = np.zeros((len(sites), 3)), np.zeros((3, model.nv))

    def push(engine: mujoco.MjModel, now: mujoco.MjData) -> None:
        for number, site in enumerate(sites):
            mujoco.mj_jacSite(engine, now, jacobian, None, site)
            forces[number] = ground(now.site_xpos[site][2], jacobian @ now.qvel)
            now.qfrc_passive[:] += jacobian.T @ forces[number]

    path, way, feet = [], [], []
    mujoco.set_mjcb_passive(push)
    try:
        for number in range(len(own)):
            mujoco.mj_forward(model, data)
            path.append(data.qpos[driven].copy())
            way.append(data.qpos[hips].copy())
            feet.append(forces.reshape(2, 2, 2, 3).sum(axis=2)[..., [0, 2]])
            middle = (number + 0.5) * step
            data.qfrc_applied[:] = 0.0
            data.qfrc_applied[held] = _HEAVY * reference(middle)[2][held]
            if torque is not None:
                data.qfrc_applied[driven] = torque(middle)
            mujoco.mj_step(model, data)
            q, dq, _ = reference((number + 1) * step)
            data.qpos[held], data.qvel[held] = q[held], dq[held]
    finally:
        mujoco.set_mjcb_passive(None)
    return Walked(
        np.array(path)[:, 0] if driven else np.empty(0),
        np.array(way).reshape(-1, 2, 2),
        np.array(feet),
    )


def _model(pair: TiedPair) -> mujoco.MjModel:
    whole = side_by_side(pair.robot.urdf, pair.other.urdf)
    spec = mujoco.MjSpec.from_string(_with_masses(whole))
    for number, tie in enumerate(pair.ties):
        tendon = spec.add_tendon(name=tie.name, springlength=[0.0, pair.slack[number]])
        ends = ((pair.robot, tie.joint, tie.point), (pair.other, tie.other_joint, tie.other_point))
        for side, (robot, joint, point) in enumerate(ends):
            body = spec.body(robot.links[robot.index(joint)])
            body.add_site(name=f'{tie.name}_{side}', pos=point)
            tendon.wrap_site(f'{tie.name}_{side}')
    for machine in _MACHINES:
        for side in _LEGS:
            for end, ahead in enumerate((0.0, _FOOT)):
                body = spec.body(f'{machine}_{side}_foot')
                body.add_site(name=f'{machine}_{side}_{end}', pos=[ahead, 0.0, 0.0])
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT
    model = spec.compile()
    model.tendon_stiffness[:] = pair.stiffness
    return model


def _with_masses(urdf: str) -> str:
    """Return the URDF with 1 nanogram for links without mass, which MuJoCo would reject."""
    root = ElementTree.fromstring(urdf)
    for link in root.findall('link'):
        if not link.get('name').endswith('ground') and link.find('inertial') is None:
            parts = ElementTree.SubElement(link, 'inertial')
            ElementTree.SubElement(parts, 'mass', value='1e-9')
            small = dict.fromkeys(('ixx', 'iyy', 'izz'), '1e-12')
            ElementTree.SubElement(parts, 'inertia', small, ixy='0', ixz='0', iyz='0')
    return ElementTree.tostring(root, encoding='unicode')
