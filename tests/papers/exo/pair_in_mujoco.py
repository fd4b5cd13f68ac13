# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The human-exoskeleton pair in MuJoCo: a cycle on the ground, and a joint that follows a torque.

MuJoCo reads both descriptions itself; the springs are tendons. Prescribed joints follow the
reference. Their armature is so large that other torques do not move them, a torque accelerates it,
and their state is reset to the reference after every step. The ground of the source's Table 3 is
implemented here independently, as a force on heels and toes at every stage of the integrator.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.gait_cycle import GaitCycle
from armid_ros.papers.exo.plant.leg_pair import PairMotion, TiedPair
import mujoco
import numpy as np
from scipy.interpolate import CubicHermiteSpline

from tests.hidden.descriptions import side_by_side

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


def walk_in_mujoco(
    cycle: GaitCycle, joint: str | None = None, torque: Callable[[float], float] | None = None
) -> Walked:
    """Simulate a cycle of both; a joint of the machine follows a torque, if one is given."""
    spec = _specification(cycle.pair)
    names = [f'{machine}_{side}' for machine in _MACHINES for side in _LEGS]
    for name in names:
        for end, ahead in enumerate((0.0, _FOOT)):
            spec.body(f'{name}_foot').add_site(name=f'{name}_{end}', pos=[ahead, 0.0, 0.0])
    model = spec.compile()
    model.tendon_stiffness[:] = cycle.pair.stiffness
    sites = [model.site(f'{name}_{end}').id for name in names for end in range(2)]
    hips = [int(model.joint(f'{m}_{n}').qposadr[0]) for m in _MACHINES for n in ('forward', 'up')]
    driven = [] if joint is None else [int(model.joint(joint).qposadr[0])]
    forces, jacobian = np.zeros((len(sites), 3)), np.zeros((3, model.nv))

    def push(engine: mujoco.MjModel, now: mujoco.MjData) -> None:
        for number, site in enumerate(sites):
            mujoco.mj_jacSite(engine, now, jacobian, None, site)
            forces[number] = _ground(now.site_xpos[site][2], jacobian @ now.qvel)
            now.qfrc_passive[:] += jacobian.T @ forces[number]

    path, way, feet = [], [], []
    mujoco.set_mjcb_passive(push)
    try:
        for data in _states(model, cycle.motions, [*hips, *driven], driven, torque):
            path.append(data.qpos[driven])
            way.append(data.qpos[hips])
            feet.append(forces.reshape(2, 2, 2, 3).sum(axis=2)[..., [0, 2]])
    finally:
        mujoco.set_mjcb_passive(None)
    return Walked(np.ravel(path), np.array(way).reshape(-1, 2, 2), np.array(feet))


def _ground(height: float, speed: FloatArray) -> FloatArray:
    """Return the ground force on a point, (3,) [N]: 100 N/mm^1.5, 1 N s/mm, friction 0.3."""
    if height >= 0.0:
        return np.zeros(3)
    up = max(1e5 * 10.0**1.5 * (-height) ** 1.5 - 1e3 * speed[2], 0.0)
    return np.array([-0.3 * np.tanh(speed[0] / 0.01) * up, 0.0, up])


def _states(
    model: mujoco.MjModel,
    motions: PairMotion,
    free: Sequence[int],
    driven: Sequence[int],
    torque: Callable[[float], float] | None,
) -> Iterator[mujoco.MjData]:
    """Simulate, and yield the state of the engine at each sample of the reference."""
    own, other = motions
    step = model.opt.timestep = float(own.t[1] - own.t[0])
    places = [model.joint(name).qposadr[0] for name in (*own.joints, *other.joints)]
    held = np.setdiff1d(np.arange(model.nv), free)
    model.dof_armature[held] = _HEAVY
    curves = [
        (CubicHermiteSpline(m.t, m.q, m.dq), CubicHermiteSpline(m.t, m.dq, m.ddq)) for m in motions
    ]

    def reference(t: float) -> FloatArray:
        parts = np.empty((3, model.nv))
        rows = [np.stack([place(t), speed(t), speed(t, 1)]) for place, speed in curves]
        parts[:, places] = np.hstack(rows)
        return parts

    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], _ = reference(float(own.t[0]))
    mujoco.mj_forward(model, data)
    yield data
    for start in own.t[:-1]:
        middle = start + step / 2.0
        data.qfrc_applied[:] = 0.0
        data.qfrc_applied[held] = _HEAVY * reference(middle)[2, held]
        if torque is not None:
            data.qfrc_applied[driven] = torque(middle)
        mujoco.mj_step(model, data)
        data.qpos[held], data.qvel[held] = reference(start + step)[:2, held]
        mujoco.mj_forward(model, data)
        yield data


def _specification(pair: TiedPair) -> mujoco.MjSpec:
    """Return both machines on the ground with their ties, which have no stiffness yet."""
    root = ElementTree.fromstring(side_by_side(pair.robot.urdf, pair.other.urdf))
    for link in root.findall('link'):
        # MuJoCo rejects links without mass, so they get 1 microgram
        if not link.get('name').endswith('ground') and link.find('inertial') is None:
            parts = ElementTree.SubElement(link, 'inertial')
            ElementTree.SubElement(parts, 'mass', value='1e-9')
            small = dict.fromkeys(('ixx', 'iyy', 'izz'), '1e-12')
            ElementTree.SubElement(parts, 'inertia', small, ixy='0', ixz='0', iyz='0')
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding='unicode'))
    for tie, slack in zip(pair.ties, pair.slack, strict=True):
        tendon = spec.add_tendon(name=tie.name, springlength=[0.0, slack])
        ends = ((pair.robot, tie.joint, tie.point), (pair.other, tie.other_joint, tie.other_point))
        for side, (robot, joint, point) in enumerate(ends):
            body = spec.body(robot.links[robot.index(joint)])
            body.add_site(name=f'{tie.name}_{side}', pos=point)
            tendon.wrap_site(f'{tie.name}_{side}')
    spec.option.gravity = pair.robot.gravity
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT
    return spec
