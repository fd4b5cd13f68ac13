# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Export of an identified arm as a description for simulators: URDF, MJCF and SDF."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.arm.export import arm_mjcf, arm_urdf
from armid_ros.motion import FloatArray
from armid_ros.report.page import render
from armid_ros.robots import held_joints
import numpy as np
import pinocchio as pin


def urdf_or_mjcf(arm: ArmModel, kind: str, source: str) -> tuple[str, tuple[str, ...]]:
    """Return the URDF or MJCF text of an arm, and the parameters that the text omits."""
    exported, root = (arm_urdf(arm), '<robot') if kind == 'urdf' else (arm_mjcf(arm), '<mujoco')
    comment = f'<!-- written by armid export, from {source.replace("--", "- -")} -->'
    return exported.text.replace(root, f'{comment}\n{root}', 1), exported.without_place


def arm_sdf(arm: ArmModel, source: str) -> tuple[str, tuple[str, ...]]:
    """
    Return the SDF 1.8 text of an arm that is fixed to the world, and what the text omits.

    Links have the inertial parameters of the arm; joints have limits, and damping and friction as
    in identified.urdf. The source of the arm is for the comment.
    Source: SDFormat specification 1.8, joint and link.

    Raises
    ------
    ModelError
        If the parameters of a link are not those of a body.

    """
    robot, urdf = arm.body.tree, arm_urdf(arm)
    coupled = [joint for joint in robot.joints if joint not in arm.robot.joints]
    left_out = (
        *(f'the coupling of joint {joint} to driven ones' for joint in coupled),
        *urdf.without_place,
        'shapes of links, which identified.urdf has',
        *(f'joint {joint.name}, which is locked' for joint in held_joints(robot)),
        f'gravity {_numbers(robot.gravity)} m/s^2 in the frame of {robot.base}, for the world',
    )
    lines = (f'written by armid export, from {source}; not in it:', *left_out)
    values = {
        'robot': robot,
        'lines': [line.replace('--', '- -') for line in lines],
        'limits': {
            'lower': robot.lower,
            'upper': robot.upper,
            'effort': robot.torque_limit,
            'velocity': robot.velocity_limit,
        },
        'friction': urdf.values,
        'numbers': _numbers,
        'angles': pin.rpy.matrixToRpy,
        'infinity': np.inf,
    }
    return str(render('model.sdf', values, 'armid_ros.cli.export')) + '\n', left_out


def _numbers(values: FloatArray) -> str:
    return ' '.join(repr(float(value)) for value in values)
