# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Export of an identified arm as URDF and MJCF."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from armid_ros.arm.arm_model import ArmModel
from armid_ros.effects import Effect
from armid_ros.model.mjcf_export import export_mjcf
from armid_ros.model.urdf_export import export_urdf
import numpy as np


@dataclass(frozen=True)
class Exported:
    """
    An exported description of an arm.

    Attributes
    ----------
    text : str
        Content of the file.
    without_place : tuple of str
        Parameters of effects that the format cannot contain, one per line; a comment in the file
        lists them too.
    left_out : tuple of str
        Parts of the description that the file lacks.
    values : mapping of str to mapping of str to float
        'damping' [N m s/rad], 'friction' [N m] and 'armature' [kg m^2] of the file, by joint.

    """

    text: str
    without_place: tuple[str, ...]
    left_out: tuple[str, ...]
    values: Mapping[str, Mapping[str, float]]


def arm_urdf(arm: ArmModel) -> Exported:
    """
    Return the URDF of the arm with identified inertial parameters and friction.

    A payload is part of the link that carries it. Text expanded from xacro stays expanded.

    Raises
    ------
    ModelError
        If the parameters of a link are not physically consistent.

    """
    found, missing = place_values(arm, lambda effect: effect.traits.urdf_attribute)
    text = export_urdf(
        arm.body,
        damping=found.get('damping'),
        friction=found.get('friction'),
        remarks=_remarks('a URDF', missing),
    )
    left_out = ('ros2_control',) if '<ros2_control' in arm.robot.urdf else ()
    robot = arm.robot  # friction that was not identified keeps its described values
    described = {'damping': robot.urdf_damping, 'friction': robot.urdf_friction}
    values = {
        key: dict(zip(robot.joints, own.tolist(), strict=True)) | found.get(key, {})
        for key, own in described.items()
    }
    return Exported(text, missing, left_out, values)


def arm_mjcf(arm: ArmModel) -> Exported:
    """
    Return a MuJoCo model of the arm with its shapes.

    Raises
    ------
    ModelError
        If the parameters of a link are not physically consistent.

    """
    found, missing = place_values(arm, lambda effect: effect.traits.mjcf_attribute)
    found['friction'] = found.pop('frictionloss', {})
    text, left_out = export_mjcf(
        arm.body,
        damping=found.get('damping'),
        friction=found.get('friction'),
        armature=found.get('armature'),
        remarks=_remarks('MuJoCo', missing),
    )
    return Exported(text, missing, left_out, found)


def place_values(
    arm: ArmModel, attribute: Callable[[Effect], str]
) -> tuple[dict[str, dict[str, float]], tuple[str, ...]]:
    """
    Return values by attribute and joint, and a line for each that has no place in a format.

    The attribute names the place of an effect, and is empty if there is none. Effects that change
    the body are part of it, and in neither.

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


def _remarks(form: str, missing: tuple[str, ...]) -> tuple[str, ...]:
    if not missing:
        return ()
    return (f'identified by armid_ros; {form} has no place for', *missing)
