# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
model.yaml: the file of an arm model, for people and simulators.

Schema armid/model/1: ``robot`` (shipped name or path of the description), ``gravity`` [m/s^2],
``rigid_parameters`` and ``effects``, each a list of parameters with name, joint, value, std, unit.
A std of null means that the data did not determine the parameter individually. An effect with
nonlinear parameters also has ``shapes``. An effect that ties the arm to another machine also has
``partner`` and ``ties``: points of both machines, in the frames of their joints [m]. An identified
model also has ``misfit``; see `Misfit`.

"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from armid_ros.arm.arm_model import ArmModel
from armid_ros.arm.misfit import Misfit, misfit_of_block
from armid_ros.effects import CATALOGUE, Effect, Quantity, Shape
from armid_ros.effects.quantities import written_units
from armid_ros.effects.tied import tied_as_written
from armid_ros.errors import ModelError
from armid_ros.estimate import Estimate, parameter_table, ParameterName
from armid_ros.files import finite, is_file, load_yaml, read_text, reading, write_file, yaml_line
from armid_ros.model.rigid_body import link_unit
from armid_ros.motion import FloatArray
from armid_ros.robots import load_robot, Robot
import numpy as np
import yaml

SCHEMA = 'armid/model/1'
_NEEDED = 'schema', 'robot', 'gravity', 'rigid_parameters', 'effects'
_KEYS = *_NEEDED, 'misfit'
_NEEDED_OF_PARAMETER = 'name', 'joint', 'value'
_KEYS_OF_PARAMETER = *_NEEDED_OF_PARAMETER, 'std', 'unit'
_NEEDED_OF_EFFECT = 'name', 'joints', 'parameters'


def model_text(
    arm: ArmModel, robot: str, estimate: Estimate | None = None, misfit: Misfit | None = None
) -> str:
    """
    Return an arm model as the text of a model.yaml.

    Parameters
    ----------
    arm : ArmModel
        The model.
    robot : str
        Name of a shipped robot, or path of the description.
    estimate : Estimate, optional
        Estimate with the standard deviations; only parameters that were estimated individually,
        not in a group, have a standard deviation.
    misfit : Misfit, optional
        Misfit of the model.

    """
    arm = _with_catalogue_effects(arm)
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
    Write an arm model to a file model.yaml.

    Parameters
    ----------
    path : str or Path
        The file.
    arm : ArmModel
        The model.
    robot : str
        Name of a shipped robot, or path of the description, relative to the folder of the file.
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
    Read an arm model from a file model.yaml.

    Parameters
    ----------
    path : str or Path
        The file.
    robot : robot, model, name or path, optional
        Description to use instead of that in the file; its inertial parameters and gravity are
        replaced by those in the file.

    Returns
    -------
    ArmModel
        The robot with the inertial parameters, gravity and effects in the file.

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
        hint = f'give {inside}' if inside.is_file() else 'the folder has no model.yaml'
        raise ModelError(f'{path}: this is a folder, not a model.yaml; {hint}')
    if isinstance(robot, ArmModel):
        robot = robot.robot
    elif isinstance(robot, (str, Path)):
        robot = load_robot(str(robot))
    text = read_text(path, ModelError)
    with reading(path, ModelError):
        document = checked_model(text)
        if robot is None:
            source = str(document['robot'])
            local = path.parent / source
            robot = load_robot(str(local) if is_file(local) else source)
        return _arm(document, robot)


def load_misfit(path: str | Path) -> Misfit | None:
    """
    Read the misfit from a model.yaml; return None if the file has no misfit.

    Parameters
    ----------
    path : str or Path
        The model.yaml.

    Raises
    ------
    ModelError
        If the file is invalid; the message names the file and the fault.

    """
    path = Path(path)
    text = read_text(path, ModelError)
    with reading(path, ModelError):
        block = checked_model(text).get('misfit')
        return None if block is None else misfit_of_block(block)


def read_model(text: str, robot: Robot, source: str) -> ArmModel:
    """
    Parse the text of a model.yaml, and return the arm model.

    Parameters
    ----------
    text : str
        Content of a model.yaml, see `model_text`.
    robot : Robot
        The description; its inertial parameters and gravity are replaced by those of the text.
    source : str
        Name of the source of the text, for error messages.

    Raises
    ------
    ModelError
        If the text is invalid; the message names the source and the fault.

    """
    with reading(source, ModelError):
        return _arm(checked_model(text), robot)


def add_effect(arm: ArmModel, effect: Effect, values: FloatArray) -> ArmModel:
    """Add an effect to an arm; if the arm has this effect already, add the values."""
    there = _find_effect(arm, effect)
    if there is None:
        named = effect.named_as(values, arm)
        if all(one.linear and _find_effect(arm, one) for one, _ in named):
            for one, own_values in named:
                arm = add_effect(arm, one, own_values)
            return arm
        return arm.with_effect(effect, values)
    position, rows = there
    changed = arm.values[position].copy()
    changed[rows] += values
    return replace(arm, values=(*arm.values[:position], changed, *arm.values[position + 1 :]))


def _find_effect(arm: ArmModel, effect: Effect) -> tuple[int, list[int]] | None:
    """Find an effect in an arm; return its index and the indices of its parameters, or None."""
    wanted = [(p.name, p.joint) for p in effect.parameters(arm.robot)]
    for position, own in enumerate(arm.effects):
        if isinstance(effect, type(own)) and not own.shapes and not own.points:
            names = [(p.name, p.joint) for p in own.parameters(arm.robot)]
            if set(wanted) <= set(names):
                return position, [names.index(name) for name in wanted]
    return None


def _with_catalogue_effects(arm: ArmModel) -> ArmModel:
    """Replace internal effects of a search by equivalent effects of the catalogue."""
    # a gravity vector, for example, becomes a tilt of the base and a magnitude of gravity
    converted = replace(arm, effects=(), values=())
    for effect, values in zip(arm.effects, arm.values, strict=True):
        named = effect.named_as(values, arm)
        if len(named) == 1 and named[0][0] == effect:
            converted = converted.with_effect(effect, values)
            continue
        for one, own_values in named:
            converted = add_effect(converted, one, own_values)
    return converted


def checked_model(text: str) -> dict[str, Any]:
    """
    Parse the text of a model.yaml, and check its keys, numbers and units.

    Parameters
    ----------
    text : str
        Content of the file.

    Raises
    ------
    ModelError
        If the document is invalid; the message names the line, and the parameter with its joint.

    """
    document = load_yaml(text)
    if not isinstance(document, dict) or document.get('schema') != SCHEMA:
        raise ModelError(f"'schema' has to be {SCHEMA}; give a model.yaml of armid identify")
    strange = [key for key in document if key not in _KEYS]
    if strange:
        line = yaml_line(text, (strange[0],))
        raise ModelError(
            f"line {line}: the key '{str(strange[0])[:40]}' is not known; the keys of a model are "
            f'{", ".join(_KEYS)}'
        )
    _require(document, _NEEDED, 'the model')
    for place, row, units in _rows(document, text):
        key, problem = _problem(row, units)
        if problem:
            raise ModelError(f'line {yaml_line(text, (*place, key))}: {problem}')
    return document


def _wrong_unit(row: Mapping[str, Any], units: Collection[str]) -> str:
    """Return an error message if the unit of a parameter is wrong; '' if right or absent."""
    if not units or row.get('unit', next(iter(units))) in units:
        return ''
    expected = ' or '.join(f"'{unit}'" for unit in units)
    return f"{_called(row)} has the unit '{row['unit']}'; it has to be {expected}"


def _rows(
    document: Mapping[str, Any], text: str
) -> Iterator[tuple[tuple[str | int, ...], Any, tuple[str, ...]]]:
    """Yield keys, content and permitted units of each parameter in the content of model.yaml."""
    for k, row in enumerate(document['rigid_parameters']):
        unit = link_unit(_name(row))
        yield ('rigid_parameters', k), row, (unit,) if unit else ()
    for k, entry in enumerate(document['effects']):
        if not isinstance(entry, dict):
            line = yaml_line(text, ('effects', k))
            raise ModelError(f'line {line}: an effect needs keys {", ".join(_NEEDED_OF_EFFECT)}')
        _require(entry, _NEEDED_OF_EFFECT, f"effect '{str(entry.get('name'))[:40]}'")
        kind = CATALOGUE.find(str(entry['name']))
        known: tuple[Quantity | Shape, ...] = (*kind.quantities, *kind.shapes)
        units = {one.name: written_units(one.unit) for one in known}
        for part in ('parameters', 'shapes'):
            for place, row in enumerate(entry.get(part, ())):
                yield ('effects', k, part, place), row, units.get(_name(row), ())


def _problem(row: Any, units: tuple[str, ...]) -> tuple[str, str]:
    """Return key and message of a fault in the entry of a parameter; ('', '') if no fault."""
    keys = ', '.join(_KEYS_OF_PARAMETER)
    if not isinstance(row, dict):
        return '', f'a parameter has {keys}, but this entry is {str(row)[:40]!r}'
    called = _called(row)
    strange = [str(key) for key in row if key not in _KEYS_OF_PARAMETER]
    if strange:
        return strange[0], f"{called}: unknown key '{strange[0][:40]}'; the keys are {keys}"
    missing = [key for key in _NEEDED_OF_PARAMETER if key not in row]
    if missing:
        return 'name', f"{called}: '{missing[0]}' is missing"
    try:
        finite(row['value'], called)
    except ValueError as fault:
        return 'value', str(fault)
    return 'unit', _wrong_unit(row, units)


def _require(content: Mapping[str, Any], keys: Collection[str], part: str) -> None:
    """Raise ModelError if a part of model.yaml lacks a required key."""
    missing = [key for key in keys if key not in content]
    if missing:
        raise ModelError(f"{part}: key '{missing[0]}' is missing; required: {', '.join(keys)}")


def _name(row: Any) -> str:
    """Return the parameter name in an entry of model.yaml; empty for a malformed entry."""
    return str(row.get('name')) if isinstance(row, dict) else ''


def _called(row: Mapping[str, Any]) -> str:
    """Return the parameter name and joint of an entry as text for error messages."""
    return f"parameter '{row.get('name')}' of joint '{row.get('joint')}'"


def _arm(document: dict[str, Any], robot: Robot) -> ArmModel:
    """Return the arm model that the content of a checked model.yaml describes."""
    try:
        gravity = [finite(part, 'gravity') for part in document['gravity']]
        arm = ArmModel(robot.with_gravity(np.array(gravity).reshape(3)))
    except (TypeError, ValueError):
        raise ModelError(
            "'gravity' has to be three finite numbers [m/s^2] in the base frame, such as "
            f'[0, 0, -9.81], not {str(document["gravity"])[:40]!r}'
        ) from None
    arm = arm.with_theta(_values(document['rigid_parameters'], arm.parameters))
    for entry in document['effects']:
        kind = CATALOGUE.find(str(entry['name']))
        effect: Effect
        if 'ties' in entry:
            effect = tied_as_written(entry, robot)
        else:
            effect = kind.on(robot, tuple(entry['joints'])).with_particulars(entry)
        if 'shapes' in entry:
            shape = _values(entry['shapes'], effect.shape_parameters(robot))
            effect = effect.with_shape(shape.reshape(effect.shape_values.shape))
        arm = arm.with_effect(effect, _values(entry['parameters'], effect.parameters(robot)))
    return arm


def _values(rows: Sequence[dict[str, Any]], names: Sequence[ParameterName]) -> FloatArray:
    """Return parameter values from entries of model.yaml, with one entry for each of `names`."""
    table: dict[tuple[str, str], dict[str, Any]] = {}
    units = {(name.name, name.joint): [name.unit] for name in names}
    for row in rows:
        key = str(row['name']), str(row['joint'])
        if key in table:
            raise ModelError(f'{_called(row)} occurs twice; remove one of the entries')
        table[key] = row
        if wrong := _wrong_unit(row, units.get(key, ())):
            raise ModelError(wrong)
    missing = [name for name in names if (name.name, name.joint) not in table]
    if missing:
        raise ModelError(
            f"parameter '{missing[0].name}' of joint '{missing[0].joint}' is missing; check that "
            'the file belongs to this robot'
        )
    return np.array([float(table[name.name, name.joint]['value']) for name in names])
