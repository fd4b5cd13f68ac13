# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Comparison of the torque of an exported file, as MuJoCo computes it, with that of the arm."""

from __future__ import annotations

from typing import Any
import warnings

from armid_ros.arm.arm_model import ArmModel
from armid_ros.arm.export import Exported
from armid_ros.model import inverse_dynamics, random_motion
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import held_joints
import numpy as np

#: Number of random states that are compared.
STATES = 50


def torque_check(exported: Exported, arm: ArmModel, seed: int = 0) -> dict[str, Any]:
    """
    Compare the torque of an exported file in MuJoCo with that of the arm, in random states.

    Parameters
    ----------
    exported : Exported
        A URDF or MJCF of the arm.
    arm : ArmModel
        The arm.
    seed : int
        Seed of the states.

    Returns
    -------
    dict
        'program', 'states', the largest 'difference' [N m or N] and its 'share' of the largest
        torque, and 'shapes' with the reason if MuJoCo cannot load the shapes of an MJCF; or
        'not_checked' with the reason. Dry friction has its value in motion.

    """
    try:
        import mujoco
    except ImportError:
        return {'not_checked': 'MuJoCo is not installed'}
    robot = arm.body
    motion = random_motion(robot, np.random.default_rng(seed), STATES)
    placed = {
        key: np.array([exported.values.get(key, {}).get(joint, 0.0) for joint in robot.joints])
        for key in ('damping', 'friction', 'armature')
    }
    wanted = inverse_dynamics(robot, motion) + placed['damping'] * motion.dq
    wanted = wanted + placed['armature'] * motion.ddq + placed['friction'] * np.sign(motion.dq)
    held = {joint.name: joint.position for joint in held_joints(robot)}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')
            spec = mujoco.MjSpec.from_string(exported.text)
            shapes = _shapes(spec) if exported.text.startswith('<mujoco') else {}
            for element in (*spec.geoms, *spec.meshes, *spec.materials, *spec.textures):
                spec.delete(element)
            spec.option.gravity = robot.gravity
            found = _inverse(mujoco, spec.compile(), motion, held)
    except (ValueError, RuntimeError) as error:
        return {'not_checked': f'MuJoCo: {" ".join(str(error).split())}'}
    difference = float(np.abs(found - wanted).max())
    return {
        'program': f'MuJoCo {mujoco.__version__}',
        'states': STATES,
        'difference': difference,
        'share': difference / float(np.abs(wanted).max()),
        **shapes,
    }


def _shapes(spec: Any) -> dict[str, str]:
    """Return the reason why MuJoCo does not load the shapes of a file; empty if it does."""
    try:
        spec.compile()
    except (ValueError, RuntimeError) as error:
        return {'shapes': f'not loaded: {" ".join(str(error).split())}'}
    return {}


def _inverse(mujoco: Any, model: Any, motion: Motion, held: dict[str, float]) -> FloatArray:
    """Return torques of MuJoCo's inverse dynamics, shape (N, n), without contacts and limits."""
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    kind = mujoco.mjtObj.mjOBJ_JOINT
    joints = [mujoco.mj_name2id(model, kind, joint) for joint in motion.joints]
    dofs, places = model.jnt_dofadr[joints], model.jnt_qposadr[joints]
    for name, position in held.items():
        joint = mujoco.mj_name2id(model, kind, name)
        if joint >= 0:
            data.qpos[model.jnt_qposadr[joint]] = position
    torque = np.empty_like(motion.q)
    for k in range(len(motion)):
        data.qpos[places], data.qvel[dofs] = motion.q[k], motion.dq[k]
        data.qacc[dofs] = motion.ddq[k]
        mujoco.mj_inverse(model, data)
        torque[k] = data.qfrc_inverse[dofs]
    return np.asarray(torque + model.dof_frictionloss[dofs] * np.sign(motion.dq))
