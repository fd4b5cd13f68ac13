# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables of node parameters: defaults, ranges and descriptions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
import math
from typing import Any

from armid_ros.errors import ArmidError
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

Value = bool | int | float | str | list[str] | list[float]
#: Returns the value of a parameter by its name.
Values = Callable[[str], Any]


@dataclass(frozen=True)
class NodeParameter:
    """
    Parameter of a node: default, description, unit and allowed values.

    Attributes
    ----------
    name : str
        Name of the parameter.
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
        Function that raises an ArmidError for an invalid value.

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
        """Return the ROS descriptor of the parameter."""
        descriptor = ParameterDescriptor(description=self.text(), read_only=self.read_only)
        if self.limits is not None and isinstance(self.default, float):
            ends = dict(zip(('from_value', 'to_value'), self.limits, strict=True))
            descriptor.floating_point_range = [FloatingPointRange(**ends)]
        elif self.limits is not None:
            ends = dict(zip(('from_value', 'to_value'), map(int, self.limits), strict=True))
            descriptor.integer_range = [IntegerRange(**ends)]
        return descriptor

    def text(self) -> str:
        """Return the description of the parameter, with the unit and the allowed texts."""
        unit = f' [{self.unit}]' if self.unit else ''
        choices = f' One of: {", ".join(self.choices)}.' if self.choices else ''
        return f'{self.description}{unit}{choices}'

    def converted(self, value: Any) -> Value:
        """
        Convert a value to the type of the parameter.

        An integer is accepted for a float, one value for a list, and [] for no names.

        Raises
        ------
        ParameterError
            If the value has another type; the message has a valid value.

        """
        default, several = self.default, isinstance(self.default, list)
        kind = type(default[0] if isinstance(default, list) else default)
        one = not several or isinstance(value, str | float | int)
        items = [value] if one else list(value or ())
        if kind is str and not items:
            return ['']
        items = [float(item) if kind is float and type(item) is int else item for item in items]
        if items and all(type(item) is kind for item in items):
            typed: Value = items if several else items[0]
            return typed
        instead = f'use a value such as {str(default).lower() if kind is bool else default}'
        if kind is str:
            instead = f'use a text; quote other values twice: -p {self.name}:="\'{value}\'"'
        raise ParameterError(f"the parameter '{self.name}' cannot be {value}; {instead}")

    def require(self, value: object) -> None:
        """Raise a ParameterError if a value is not allowed."""
        if isinstance(value, float) and not math.isfinite(value):
            raise ParameterError(f"parameter '{self.name}' is {value}, not a finite number")
        if isinstance(value, int | float) and self.limits is not None:
            lower, upper = self.limits
            if not lower <= value <= upper:
                unit = f' {self.unit}' if self.unit else ''
                raise ParameterError(
                    f"parameter '{self.name}' is {value}, outside its range "
                    f'{lower:g} to {upper:g}{unit}'
                )
        if self.choices and value not in self.choices:
            known = ', '.join(self.choices)
            raise ParameterError(f"parameter '{self.name}' is '{value}', not one of {known}")
        if self.check is not None:
            try:
                self.check(value)
            except ArmidError as error:
                raise ParameterError(f"parameter '{self.name}': {error}") from error


#: Parameter that can be set while the node runs, with the arguments of `NodeParameter`.
setting = partial(NodeParameter, read_only=False)


class ParameterError(ArmidError):
    """Error in the value of a node's parameter."""


def declare(node: Node, table: Iterable[NodeParameter]) -> dict[str, NodeParameter]:
    """
    Declare the parameters of a table on a node, and return their entries by name.

    Raises
    ------
    ParameterError
        If a given value has the wrong type, or is not permitted.

    """
    entries = {entry.name: entry for entry in table}
    given = overrides(node)
    for name, entry in entries.items():
        value = entry.default
        if name in given:
            value = entry.converted(given[name].value)
            entry.require(value)
        node.declare_parameter(name, value, entry.descriptor(), ignore_override=True)
    return entries


def overrides(node: Node) -> Mapping[str, Parameter]:
    """Return the parameters that were set at the start of a node, by name."""
    given: Mapping[str, Parameter] = node._parameter_overrides
    return given
