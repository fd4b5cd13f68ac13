# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Export of an identified arm as URDF or MJCF, and a check of the file in MuJoCo."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any
import warnings

from armid_ros.arm.arm_model import ArmModel
from armid_ros.effects import Effect
from armid_ros.model import inverse_dynamics, random_motion
from armid_ros.model.mjcf_export import export_mjcf
from armid_ros.model.urdf_export import export_urdf
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import held_joints
import numpy as np


@dataclass(frozen=True)
class Exported:
    """
    Exported URDF or MJCF text, and the parameters of the arm that the format cannot contain.

    Attributes
    ----------
    text : str
        Content of the URDF or MJCF file.
    without_place : tuple of str
        Parameters of effects that the format cannot contain, one per line; a comment in the file
        lists them too.
    left_out : tuple of str
        Parts of the original description that the file lacks.
    values : mapping of str to mapping of str to float
        'damping' [N m s/rad], 'friction' [N m] and 'armature' [kg m^2] in the file, by joint.

    """

    text: str
    without_place: tuple[str, ...]
    left_out: tuple[str, ...]
    values: Mapping[str, Mapping[str, float]]


def arm_urdf(arm: ArmModel) -> Exported:
    """
    Return the URDF of the arm with identified inertial parameters and friction.

    A payload becomes part of the link that carries it. A URDF from xacro stays expanded.

    Raises
    ------
    ModelError
        If the parameters of a link are not physically consistent.

    """
    found, missing = place_values(arm, lambda effect: effect.traits.urdf_attribute)
    remarks = ('identified by armid_ros; a URDF has no place for', *missing) if missing else ()
    text = export_urdf(arm.body, found, remarks)
    left_out = ('ros2_control',) if '<ros2_control' in arm.robot.urdf else ()
    robot = arm.robot.tree  # friction without identified values keeps the described ones
    described = {'damping': robot.urdf_damping, 'friction': robot.urdf_friction}
    values = {
        key: dict(zip(robot.joints, own.tolist(), strict=True)) | found.get(key, {})
        for key, own in described.items()
    }
    return Exported(text, missing, left_out, values)


def arm_mjcf(arm: ArmModel) -> Exported:
    """
    Return a MuJoCo model of the arm with identified inertial parameters and friction.

    Raises
    ------
    ModelError
        If the parameters of a link are not physically consistent.

    """
    found, missing = place_values(arm, lambda effect: effect.traits.mjcf_attribute)
    remarks = ('identified by armid_ros; MuJoCo has no place for', *missing) if missing else ()
    text, left_out = export_mjcf(arm.body, found, remarks)
    found['friction'] = found.pop('frictionloss', {})
    return Exported(text, missing, left_out, found)


def place_values(
    arm: ArmModel, attribute: Callable[[Effect], str]
) -> tuple[dict[str, dict[str, float]], tuple[str, ...]]:
    """
    Return effect values for the attributes of a file format, and texts on all other values.

    The function ``attribute`` returns the attribute of the format for an effect, or an empty text.
    Effects that change the rigid body are part of its inertial parameters, and appear in neither
    result.

    """
    found: dict[str, dict[str, float]] = {}
    missing = []
    for effect, values in zip(arm.effects, arm.values, strict=True):
        if attribute(effect):
            own = found.setdefault(attribute(effect), {})
            for joint, value in zip(effect.joints, values, strict=True):
                own[joint] = own.get(joint, 0.0) + float(value)
        elif not effect.changes_body:
            names = [*effect.parameters(arm.robot), *effect.shape_parameters(arm.robot)]
            numbers = [*values, *np.ravel(effect.shape_values)]
            for parameter, value in zip(names, numbers, strict=True):
                where = f' of {parameter.joint}' if parameter.joint else ''
                text = f'{effect.name}: {parameter.name}{where} = {float(value)!r}'
                missing.append(f'{text} {parameter.unit}'.rstrip())
    return found, tuple(missing)


def torque_check(exported: Exported, arm: ArmModel) -> dict[str, Any]:
    """
    Compare MuJoCo's joint torques for an exported file with the torques of the arm.

    Parameters
    ----------
    exported : Exported
        A URDF or MJCF of the arm.
    arm : ArmModel
        The arm.

    Returns
    -------
    dict
        'program', 'states', the largest 'difference' [N m or N] and its 'share' of the largest
        torque, and 'shapes' with the reason if MuJoCo cannot load the shapes of an MJCF. If
        nothing was compared, 'not_checked' with the reason. Dry friction has its value in motion.

    """
    try:
        import mujoco
    except ImportError:
        return {'not_checked': 'MuJoCo is not installed'}
    robot = arm.body.tree
    motion = random_motion(robot, np.random.default_rng(0), 50)
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
            shapes: dict[str, str] = {}
            if exported.text.startswith('<mujoco'):
                try:
                    spec.compile()
                except (ValueError, RuntimeError) as error:
                    shapes = {'shapes': f'not loaded: {" ".join(str(error).split())}'}
            for element in (*spec.geoms, *spec.meshes, *spec.materials, *spec.textures):
                spec.delete(element)
            spec.option.gravity = robot.gravity
            found = _inverse(mujoco, spec.compile(), motion, held)
    except (ValueError, RuntimeError) as error:
        return {'not_checked': f'MuJoCo: {" ".join(str(error).split())}'}
    difference = float(np.abs(found - wanted).max())
    return {
        'program': f'MuJoCo {mujoco.__version__}',
        'states': len(motion),
        'difference': difference,
        'share': difference / float(np.abs(wanted).max()),
        **shapes,
    }


def _inverse(mujoco: Any, model: Any, motion: Motion, held: dict[str, float]) -> FloatArray:
    """Return joint torques by MuJoCo's inverse dynamics, without contacts and joint limits."""
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
