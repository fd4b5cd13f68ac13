# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
model.yaml: an arm model as a file for people and simulators.

Schema armid/model/1: ``robot`` (shipped name or path of the description), ``gravity`` [m/s^2],
``rigid_parameters`` and ``effects``, each a list of parameters with name, joint, value, std, unit.
A std of null means that the data did not determine the parameter on its own. An effect with
nonlinear parameters also has ``shapes``. An effect that ties the arm to another machine also has
``partner`` and ``ties``: points of both machines, in the frames of their joints [m]. An identified
model also has ``misfit``; see `Misfit`.

"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from armid_ros.arm.arm_model import ArmModel
from armid_ros.arm.misfit import Misfit
from armid_ros.arm.model_check import checked_model, SCHEMA, wrong_unit
from armid_ros.arm.words import in_words
from armid_ros.effects import CATALOGUE, Kind
from armid_ros.effects.tied import tied_kind
from armid_ros.errors import ModelError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.files import finite, is_file, read_text, reading, write_file
from armid_ros.motion import FloatArray
from armid_ros.robots import load_robot, Robot
import numpy as np
import yaml


def parameter_table(
    names: Sequence[ParameterName], values: FloatArray, std: Sequence[float | None]
) -> list[dict[str, Any]]:
    """Return parameters as rows of name, joint, value, std, unit, ready for YAML or JSON."""
    return [
        {
            'name': name.name,
            'joint': name.joint,
            'value': float(value),
            'std': None if s is None else float(s),
            'unit': name.unit,
        }
        for name, value, s in zip(names, values, std, strict=True)
    ]


def model_text(
    arm: ArmModel, robot: str, estimate: Estimate | None = None, misfit: Misfit | None = None
) -> str:
    """
    Return the content of model.yaml.

    Parameters
    ----------
    arm : ArmModel
        The model.
    robot : str
        Shipped name or path of the description.
    estimate : Estimate, optional
        Estimate with the standard deviations; only parameters that were estimated by themselves,
        and not in a group, have one.
    misfit : Misfit, optional
        Misfit of the model.

    """
    arm = in_words(arm)
    known: dict[tuple[str, str], float] = {}
    if estimate is not None:
        for name, std in zip(estimate.parameters, estimate.std, strict=True):
            known[name.name, name.joint] = float(std)
    std = [known.get((name.name, name.joint)) for name in arm.parameters]
    table = parameter_table(arm.parameters, arm.theta, std)
    size = len(arm.robot.rigid_parameters)
    effects, start = [], size
    for effect, values in zip(arm.effects, arm.values, strict=True):
        rows = table[start : start + len(values)]
        entry: dict[str, Any] = {'name': effect.name, 'joints': list(effect.joints)}
        entry['parameters'] = rows
        if effect.shapes:
            shapes = effect.shape_parameters(arm.robot)
            std = [known.get((name.name, name.joint)) for name in shapes]
            entry['shapes'] = parameter_table(shapes, np.array(effect.shape), std)
        effects.append(entry | effect.particulars())
        start += len(values)
    document: dict[str, Any] = {
        'schema': SCHEMA,
        'robot': robot,
        'gravity': [float(g) for g in arm.robot.gravity],
        'rigid_parameters': table[:size],
        'effects': effects,
    }
    if misfit is not None:
        document['misfit'] = misfit.document()
    return str(yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=99))


def save_model(
    path: str | Path,
    arm: ArmModel,
    robot: str,
    estimate: Estimate | None = None,
    misfit: Misfit | None = None,
) -> None:
    """
    Write model.yaml.

    Parameters
    ----------
    path : str or Path
        The file.
    arm : ArmModel
        The model.
    robot : str
        Shipped name or path of the description; a relative path starts at the folder of the file.
    estimate : Estimate, optional
        Estimate with the standard deviations.
    misfit : Misfit, optional
        Misfit of the model.

    Raises
    ------
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import armid_ros as ar
    >>> arm = ar.ArmModel.of('my_arm.urdf', effects='viscous_friction:viscous_coefficient=0.3')
    >>> ar.save_model('rubbing.yaml', arm, 'my_arm.urdf')
    >>> print(ar.load_model('rubbing.yaml').values[0])
    [0.3 0.3 0.3]

    """
    write_file(path, model_text(arm, robot, estimate, misfit))


def load_model(path: str | Path, robot: Robot | ArmModel | str | Path | None = None) -> ArmModel:
    """
    Read model.yaml.

    Parameters
    ----------
    path : str or Path
        The file.
    robot : robot, model, name or path, optional
        Description to use instead of the one in the file; its inertial parameters and gravity
        are replaced by those of the file.

    Returns
    -------
    ArmModel
        The robot with the masses and effects of the file.

    Raises
    ------
    ModelError
        If the file is invalid; the message names the file and the fault.
    RobotError
        If the description does not exist, or cannot be used.

    Examples
    --------
    >>> import armid_ros as ar
    >>> arm = ar.load_model('monday_result/model.yaml')
    >>> [effect.name for effect in arm.effects]
    ['viscous_friction', 'coulomb_friction', 'torque_offset']

    """
    path = Path(path)
    if path.is_dir():
        inside = path / 'model.yaml'
        hint = f'name the model in it, {inside}' if inside.is_file() else 'there is no model.yaml'
        raise ModelError(f'{path}: a folder; {hint}')
    if isinstance(robot, ArmModel):
        robot = robot.robot
    elif isinstance(robot, (str, Path)):
        robot = load_robot(str(robot))
    text = read_text(path, ModelError)
    with reading(path, ModelError):
        document = checked_model(text)
        if robot is None:
            source = str(document['robot'])
            beside = path.parent / source
            robot = load_robot(str(beside) if is_file(beside) else source)
        return _arm(document, robot)


def read_model(text: str, robot: Robot, source: str) -> ArmModel:
    """
    Return the arm model that the text of a model.yaml describes.

    Parameters
    ----------
    text : str
        Content of a model.yaml, see `model_text`.
    robot : Robot
        The description; its inertial parameters and gravity are replaced by those of the text.
    source : str
        Name of the source of the text, for messages.

    Raises
    ------
    ModelError
        If the text is invalid; the message names the source and the fault.

    """
    with reading(source, ModelError):
        return _arm(checked_model(text), robot)


def _gravity(given: Any) -> FloatArray:
    try:
        x, y, z = given
        return np.array([finite(part, 'gravity') for part in (x, y, z)])
    except (TypeError, ValueError):
        raise ModelError(
            "'gravity' has to be three finite numbers [m/s^2] in the frame of the base, as "
            f'[0, 0, -9.81], not {str(given)[:40]!r}'
        ) from None


def _arm(document: dict[str, Any], robot: Robot) -> ArmModel:
    arm = ArmModel(robot.with_gravity(_gravity(document['gravity'])))
    arm = arm.with_theta(_values(document['rigid_parameters'], arm.parameters))
    for entry in document['effects']:
        kind: Kind = CATALOGUE.find(str(entry['name']))
        if 'ties' in entry:
            kind = tied_kind(kind.name, entry)
        effect = kind.on(robot, tuple(entry['joints'])).with_particulars(entry)
        if 'shapes' in entry:
            shape = _values(entry['shapes'], effect.shape_parameters(robot))
            effect = effect.with_shape(shape.reshape(effect.shape_values.shape))
        arm = arm.with_effect(effect, _values(entry['parameters'], effect.parameters(robot)))
    return arm


def _values(rows: Sequence[dict[str, Any]], names: Sequence[ParameterName]) -> FloatArray:
    table: dict[tuple[str, str], float] = {}
    for row in rows:
        key = str(row['name']), str(row['joint'])
        if key in table:
            raise ModelError(f"parameter '{key[0]}' of joint '{key[1]}' is given twice")
        table[key] = finite(row['value'], f"parameter '{key[0]}' of joint '{key[1]}'")
    missing = [name for name in names if (name.name, name.joint) not in table]
    if missing:
        raise ModelError(
            f"parameter '{missing[0].name}' of joint '{missing[0].joint}' is missing; "
            'is the file of another robot?'
        )
    units = {(name.name, name.joint): [name.unit] for name in names}
    for row in rows:
        said = wrong_unit(row, units.get((str(row['name']), str(row['joint'])), ()))
        if said:
            raise ModelError(said)
    return np.array([table[name.name, name.joint] for name in names])
