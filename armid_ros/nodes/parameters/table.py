# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables of node parameters, for descriptors, checks and documentation."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
import math
import re
from typing import Any

from armid_ros.errors import ArmidError, meant
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

#: Parameters that ROS declares on every node.
_ROS = ('use_sim_time', 'start_type_description_service')

Value = bool | int | float | str | list[str] | list[float]
#: Returns the value of a parameter by its name.
Values = Callable[[str], Any]


@dataclass(frozen=True)
class NodeParameter:
    """
    One parameter of a node.

    Attributes
    ----------
    name : str
        Its name.
    default : bool, int, float, str, list of str or list of float
        Default value, which also fixes the type. ROS cannot infer the type of an empty list, so
        that [''] stands for no names; [] is accepted for it.
    description : str
        Description of the parameter.
    unit : str
        SI unit of a number.
    limits : tuple of two floats, or None
        Range of a number.
    choices : tuple of str
        Permitted texts; empty if any text is permitted.
    read_only : bool
        Whether the parameter cannot change at run time.
    check : callable, or None
        Raises ArmidError for an invalid value inside the range.

    """

    name: str
    default: Value
    description: str
    unit: str = ''
    limits: tuple[float, float] | None = None
    choices: tuple[str, ...] = ()
    read_only: bool = True
    check: Callable[[Any], object] | None = None

    def descriptor(self) -> ParameterDescriptor:
        """Return the ROS parameter descriptor."""
        descriptor = ParameterDescriptor(description=self.text(), read_only=self.read_only)
        if self.limits is not None and isinstance(self.default, float):
            ends = dict(zip(('from_value', 'to_value'), self.limits, strict=True))
            descriptor.floating_point_range = [FloatingPointRange(**ends)]
        elif self.limits is not None:
            ends = dict(zip(('from_value', 'to_value'), map(int, self.limits), strict=True))
            descriptor.integer_range = [IntegerRange(**ends)]
        return descriptor

    def text(self) -> str:
        """Return the description with unit and choices."""
        unit = f' [{self.unit}]' if self.unit else ''
        choices = f' One of: {", ".join(self.choices)}.' if self.choices else ''
        return f'{self.description}{unit}{choices}'

    def objection(self, value: object) -> str:
        """Return why a value of the right type and range is invalid; empty if it is valid."""
        if isinstance(value, float) and not math.isfinite(value):
            return f"parameter '{self.name}' must be a finite number"
        if self.choices and value not in self.choices:
            return f"parameter '{self.name}' is '{value}', not one of {', '.join(self.choices)}"
        if self.check is not None:
            try:
                self.check(value)
            except ArmidError as error:
                return f"parameter '{self.name}': {error}"
        return ''


class ParameterError(ArmidError):
    """A node was started with an invalid parameter."""


def declare(node: Node, table: Iterable[NodeParameter]) -> None:
    """
    Declare the parameters of a table on a node, and check later changes.

    Raises
    ------
    ParameterError
        If an override has the wrong type, is out of range or invalid. The message contains the
        remedy.

    """
    entries = {entry.name: entry for entry in table}

    def validate(parameters: list[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            if parameter.name in entries:
                reason = entries[parameter.name].objection(parameter.value)
                if reason:
                    return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(validate)
    given = overrides(node)
    for entry in entries.values():
        nothing, default = entry.name in given and not _has_type(given[entry.name]), entry.default
        if nothing:
            if not (isinstance(default, list) and all(isinstance(one, str) for one in default)):
                raise ParameterError(f"parameter '{entry.name}' is empty; {_instead(entry)}")
            default = ['']
        try:
            node.declare_parameter(
                entry.name, default, entry.descriptor(), ignore_override=nothing
            )
        except InvalidParameterTypeException as error:
            raise ParameterError(_explain_type(entry, str(error))) from error
        except InvalidParameterValueException as error:
            raise ParameterError(_explain_value(entry, str(error))) from error


def overrides(node: Node) -> Mapping[str, Parameter]:
    """Return the parameter overrides of a node by name, declared or not."""
    given: Mapping[str, Parameter] = node._parameter_overrides
    return given


def unknown(node: Node) -> str:
    """Return a text that names overrides that the node does not have; empty if none."""
    mine = {name for name in node.get_parameters_by_prefix('') if not _of_ros(name)}
    wrong = [name for name in overrides(node) if name not in mine and not _of_ros(name)]
    if not wrong:
        return ''
    named = '; '.join(f"no parameter is named '{name}'{meant(name, mine)}" for name in wrong)
    return f'{named}; left out, see --help'


def as_declared(node: Node, parameter: Parameter) -> Parameter:
    """Convert integers and empty lists to the declared type of a parameter."""
    floats = {
        Parameter.Type.DOUBLE: (Parameter.Type.INTEGER, float),
        Parameter.Type.DOUBLE_ARRAY: (Parameter.Type.INTEGER_ARRAY, lambda v: list(map(float, v))),
    }
    if node.has_parameter(parameter.name):
        declared = node.get_parameter(parameter.name).type_
        whole, convert = floats.get(declared, (None, None))
        if declared == Parameter.Type.STRING_ARRAY and not _has_type(parameter):
            return Parameter(parameter.name, declared, [''])
        if parameter.type_ == whole and convert is not None:
            return Parameter(parameter.name, declared, convert(parameter.value))
    return parameter


def is_as(node: Node, parameter: Parameter) -> bool:
    """Return whether a parameter of a node already has a value."""
    if not node.has_parameter(parameter.name):
        return False
    now = node.get_parameter(parameter.name).get_parameter_value()
    return bool(now == parameter.get_parameter_value())


def _has_type(parameter: Parameter) -> bool:
    """Return whether the type of a value is known; it is unknown for an empty list."""
    return parameter.type_ is not Parameter.Type.NOT_SET and parameter.value != []


def _instead(entry: NodeParameter) -> str:
    """Return a hint with an example of a valid value."""
    value = str(entry.default).lower() if isinstance(entry.default, bool) else entry.default
    return f'use a value such as {value}' if value != '' else 'give it a text, or leave it out'


def _of_ros(name: str) -> bool:
    """Return whether ROS declares a parameter on every node."""
    return name in _ROS or name.startswith('qos_overrides.')


def _explain_type(entry: NodeParameter, text: str) -> str:
    """Explain a wrong type, such as 100 instead of 100.0, with the correct form."""
    found = re.search(r"to '(.*)' of type '(\w+)'", text, re.DOTALL)
    value, given = found.groups() if found else ('?', '?')
    if isinstance(entry.default, float):
        instead = f'use {value}.0' if given == 'INTEGER' else f'use a number: {entry.default}'
    elif isinstance(entry.default, str):
        instead = f'quote it twice: -p {entry.name}:="\'{value}\'"'
    else:
        instead = _instead(entry)
    return f"parameter '{entry.name}' cannot be {value} of type {given}; {instead}"


def _explain_value(entry: NodeParameter, text: str) -> str:
    found = re.search(r'value \((.*?)\) for parameter', text, re.DOTALL)
    if found and entry.limits is not None and 'out of range' in text:
        unit = f' {entry.unit}' if entry.unit else ''
        return (
            f"parameter '{entry.name}' is {found[1]}, outside its range "
            f'{entry.limits[0]:g} to {entry.limits[1]:g}{unit}'
        )
    return text.partition('Reason: ')[2].removesuffix(f': {entry.name}') or text
