# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Machines with coupled joints in MuJoCo, and recordings of their motion by MuJoCo alone."""

from pathlib import Path

from armid_ros.motion import Motion
from armid_ros.robots import load_robot, Robot
import mujoco
import numpy as np

RATE = 5000.0  # Hz
RECORDED = 250.0  # Hz


def body(name: str, pos: str, joint: str, inertial: tuple, *inside: str) -> str:
    """Return a body with one joint: `inertial` is mass, centre, and a radius of gyration [m]."""
    mass, centre, radius = inertial
    xx, yy, zz = (mass * radius**2 * share for share in (1.0, 1.2, 0.8))
    turned = f'{xx} {yy} {zz} {0.1 * xx} {-0.05 * xx} {0.07 * xx}'
    return (
        f'<body name="{name}" pos="{pos}">{joint}'
        f'<inertial pos="{centre}" mass="{mass}" fullinertia="{turned}"/>{"".join(inside)}</body>'
    )


def hinge(name: str, axis: str, reach: float = 0.7) -> str:
    """Return a hinge with a range to both sides."""
    return f'<joint name="{name}" axis="{axis}" range="{-reach} {reach}"/>'


def mjcf(tree: str, driven: tuple[str, ...], extra: str) -> str:
    """Return a machine with motors on its driven joints."""
    motors = ''.join(f'<motor name="{j}" joint="{j}" ctrlrange="-300 300"/>' for j in driven)
    return (
        '<mujoco><compiler angle="radian" autolimits="true"/>'
        f'<option timestep="{1.0 / RATE}" integrator="RK4" tolerance="1e-12"/>'
        f'<worldbody>{tree}</worldbody>{extra}<actuator>{motors}</actuator></mujoco>'
    )


STIFF = f'solref="{2.0 / RATE} 1" solimp="0.9999 0.9999 0.001 0.5 2"'


def linkage(crank: float, tail: float) -> str:
    """Return an arm of four joints whose elbow is moved by a crank, a rod and a tail."""
    forearm = body(
        'forearm',
        '0 0 0.4',
        '<joint name="elbow" axis="0 1 0"/>',
        (3.0, '0.2 0.01 0.02', 0.12),
        body('flange', '0.45 0 -0.05', hinge('j4', '0 0 1', 1.5), (0.8, '0.03 0.02 -0.06', 0.05)),
    )
    rod = body('rod', f'-{crank} 0 0', '<joint name="p" axis="0 1 0"/>', (0.7, '0 0 0.2', 0.1))
    shoulder = body(
        'column',
        '0 0 0.2',
        hinge('j1', '0 0 1', 1.5),
        (5.0, '0.02 0 -0.05', 0.1),
        body('arm', '0.1 0 0.1', hinge('j2', '0 1 0'), (4.0, '0.02 0.01 0.18', 0.13), forearm),
        body('crank', '0.1 0 0.1', hinge('j3', '0 1 0'), (1.5, '-0.05 0.02 0', 0.06), rod),
    )
    loop = f'<connect body1="rod" body2="forearm" anchor="{crank - tail} 0 0.4" {STIFF}/>'
    return mjcf(shoulder, ('j1', 'j2', 'j3', 'j4'), f'<equality>{loop}</equality>')


def wrist() -> str:
    """Return two joints and a differential wrist with two motors on the forearm."""
    roll = body('hand', '0.05 0 0', hinge('roll', '1 0 0', 1.5), (1.2, '0.06 0.02 0.03', 0.06))
    pitch = body('cross', '0.3 0 0', hinge('pitch', '0 1 0', 1.0), (0.6, '0.02 0 0', 0.04), roll)
    motors = [
        body(f'rotor_{k}', f'0.1 {y} 0', f'<joint name="{k}" axis="0 1 0"/>', (0.3, '0 0 0', 0.04))
        for k, y in (('left', 0.05), ('right', -0.05))
    ]
    tree = body(
        'upper',
        '0 0 0.3',
        hinge('j1', '0 0 1', 1.5),
        (3.0, '0.1 0 0', 0.1),
        body('fore', '0.3 0 0', hinge('j2', '0 1 0', 1.0), (2.0, '0.15 0 0', 0.1), pitch, *motors),
    )
    tendons = ''.join(
        f'<fixed name="{joint}_tendon"><joint joint="{joint}" coef="1"/><joint joint="left" '
        f'coef="-0.5"/><joint joint="right" coef="{coefficient}"/></fixed>'
        for joint, coefficient in (('pitch', -0.5), ('roll', 0.5))
    )
    equal = ''.join(f'<tendon tendon1="{j}_tendon" {STIFF}/>' for j in ('pitch', 'roll'))
    extra = f'<tendon>{tendons}</tendon><equality>{equal}</equality>'
    return mjcf(tree, ('j1', 'j2', 'left', 'right'), extra)


WRIST_YAML = """
mimic:
  pitch: {left: 0.5, right: 0.5}
  roll: {left: 0.5, right: -0.5}
"""


def gripper() -> str:
    """Return two joints and a gripper whose second finger follows the driven one."""
    slide = '<joint name="{}" type="slide" axis="0 {} 0" range="-0.05 0.05"/>'
    fingers = [
        body(f, f'0.1 {y} 0', slide.format(f, axis), (mass, f'0.05 {0.1 * y} 0.01', 0.03))
        for f, y, axis, mass in (('finger', 0.04, 1, 0.6), ('follower', -0.04, -1, 0.4))
    ]
    tree = body(
        'upper',
        '0 0 0.3',
        hinge('j1', '0 1 0', 1.0),
        (3.0, '0.1 0 0', 0.1),
        body('hand', '0.3 0 0', hinge('j2', '1 0 0', 1.5), (1.5, '0.08 0 0', 0.06), *fingers),
    )
    same = f'<joint joint1="follower" joint2="finger" polycoef="0.01 0.8 0 0 0" {STIFF}/>'
    return mjcf(tree, ('j1', 'j2', 'finger'), f'<equality>{same}</equality>')


MACHINES = {
    'palletiser': linkage(0.15, 0.12),
    'parallelogram': linkage(0.15, 0.15),
    'wrist': wrist(),
    'gripper': gripper(),
}


def described(name: str, folder: Path) -> Path:
    """Write the description of a machine; return its path."""
    path = folder / f'{name}.xml'
    path.write_text(MACHINES[name])
    if name == 'wrist':
        (folder / 'wrist.mechanism.yaml').write_text(WRIST_YAML)
    return path


def load(name: str, folder: Path) -> Robot:
    """Load a machine with the joints of its motors as driven ones."""
    model = mujoco.MjModel.from_xml_string(MACHINES[name])
    joints = [model.actuator(k).name for k in range(model.nu)]
    return load_robot(described(name, folder), joints=joints)


def compiled(name: str, payload: tuple[str, float] | None = None) -> mujoco.MjModel:
    """Compile a machine, with a point mass [kg] at the centre of one body."""
    model = mujoco.MjModel.from_xml_string(MACHINES[name])
    if payload is not None:
        model.body_mass[model.body(payload[0]).id] += payload[1]
        mujoco.mj_setConst(model, mujoco.MjData(model))
    model.dof_solref[:] = [2.0 / RATE, 1.0]  # of dry friction, as stiff as it can be
    model.dof_solimp[:] = [0.9999, 0.9999, 0.001, 0.5, 2.0]
    return model


def recorded(
    model: mujoco.MjModel, robot: Robot, desired: Motion, gain: float = 60.0
) -> tuple[Motion, np.ndarray]:
    """
    Move a machine in MuJoCo along a desired motion at RATE with a controller of every motor.

    Returns
    -------
    Motion
        True motion and torque of the driven joints at RECORDED, after half a second.
    ndarray
        Positions of all joints of MuJoCo at these samples.

    """
    data = mujoco.MjData(model)
    dofs = [int(model.jnt_dofadr[model.joint(joint).id]) for joint in robot.joints]
    motors = [model.actuator(joint).id for joint in robot.joints]
    every, rows = int(RATE / RECORDED), []
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    inertia = np.diag(mass)[dofs]
    for k in range(len(desired)):
        wanted = desired.ddq[k] + gain**2 * (desired.q[k] - data.qpos[dofs])
        data.ctrl[motors] = inertia * (wanted + 2.0 * gain * (desired.dq[k] - data.qvel[dofs]))
        if k % every == 0 and k >= 0.5 * RATE:
            mujoco.mj_forward(model, data)
            state = data.qpos[dofs], data.qvel[dofs], data.qacc[dofs], data.ctrl[motors], data.qpos
            rows.append([np.array(part) for part in state])
        mujoco.mj_step(model, data)
    q, dq, ddq, tau, positions = (np.array([row[part] for row in rows]) for part in range(5))
    t = np.arange(len(rows)) / RECORDED
    return Motion(robot.joints, t, q, dq, ddq, tau), positions
