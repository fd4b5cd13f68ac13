# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The check of model.yaml that all its readers share.

It rejects unknown keys, invalid numbers and wrong units. The error names the line and the
parameter.

"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from armid_ros.effects import CATALOGUE, Quantity, Shape
from armid_ros.effects.quantities import written_units
from armid_ros.errors import ModelError
from armid_ros.files import finite, parsed_yaml, yaml_line
from armid_ros.model.rigid_body import link_unit

SCHEMA = 'armid/model/1'
_NEEDED = 'schema', 'robot', 'gravity', 'rigid_parameters', 'effects'
_KEYS = *_NEEDED, 'misfit'
_NEEDED_OF_PARAMETER = 'name', 'joint', 'value'
_KEYS_OF_PARAMETER = *_NEEDED_OF_PARAMETER, 'std', 'unit'
_NEEDED_OF_EFFECT = 'name', 'joints', 'parameters'


def checked_model(text: str) -> dict[str, Any]:
    """
    Return a validated document of a model.yaml: keys, numbers and units.

    Parameters
    ----------
    text : str
        Content of the file.

    Raises
    ------
    ModelError
        If the document is invalid; the message names the line, and the parameter with its joint.

    """
    document = parsed_yaml(text, ModelError)
    if not isinstance(document, dict) or document.get('schema') != SCHEMA:
        raise ModelError(f"not an arm model; its 'schema' has to be {SCHEMA}")
    strange = [key for key in document if key not in _KEYS]
    if strange:
        line = yaml_line(text, (strange[0],))
        raise ModelError(
            f"line {line}: no key '{str(strange[0])[:40]}' is known; a model has "
            f'{", ".join(_KEYS)}'
        )
    _require(document, _NEEDED, 'a model')
    for place, row, units in _rows(document, text):
        key, fault = _fault(row, units)
        if fault:
            raise ModelError(f'line {yaml_line(text, (*place, key))}: {fault}')
    return document


def wrong_unit(row: Mapping[str, Any], units: Collection[str]) -> str:
    """Return the error on a wrong unit of a parameter; empty if right or not given."""
    if not units or row.get('unit', next(iter(units))) in units:
        return ''
    expected = ' or '.join(f"'{unit}'" for unit in units)
    return f"{_called(row)} has the unit '{row['unit']}'; it has to be {expected}"


def _rows(
    document: Mapping[str, Any], text: str
) -> Iterator[tuple[tuple[str | int, ...], Any, tuple[str, ...]]]:
    """Yield the place of each parameter, the parameter, and its permitted units (empty: any)."""
    for k, row in enumerate(document['rigid_parameters']):
        yield ('rigid_parameters', k), row, link_unit(_name(row))
    for k, entry in enumerate(document['effects']):
        if not isinstance(entry, dict):
            line = yaml_line(text, ('effects', k))
            raise ModelError(f'line {line}: an effect has {", ".join(_NEEDED_OF_EFFECT)}')
        _require(entry, _NEEDED_OF_EFFECT, f"effect '{str(entry.get('name'))[:40]}'")
        kind = CATALOGUE.find(str(entry['name']))
        known: tuple[Quantity | Shape, ...] = (*kind.quantities, *kind.shapes)
        units = {one.name: written_units(one.unit) for one in known}
        for part in ('parameters', 'shapes'):
            for place, row in enumerate(entry.get(part, ())):
                yield ('effects', k, part, place), row, units.get(_name(row), ())


def _fault(row: Any, units: tuple[str, ...]) -> tuple[str, str]:
    """Return the key and error of a wrong parameter; the error is empty if it is right."""
    if not isinstance(row, dict):
        keys = ', '.join(_KEYS_OF_PARAMETER)
        return '', f'a parameter has {keys}; here is {str(row)[:40]!r}'
    called = _called(row)
    strange = [str(key) for key in row if key not in _KEYS_OF_PARAMETER]
    if strange:
        known = ', '.join(_KEYS_OF_PARAMETER)
        return strange[0], (
            f"{called}: no key '{strange[0][:40]}' is known; a parameter has {known}"
        )
    missing = [key for key in _NEEDED_OF_PARAMETER if key not in row]
    if missing:
        return 'name', f"{called}: no '{missing[0]}'"
    try:
        finite(row['value'], called)
    except ValueError as fault:
        return 'value', str(fault)
    return 'unit', wrong_unit(row, units)


def _require(content: Mapping[str, Any], keys: Collection[str], whose: str) -> None:
    missing = [key for key in keys if key not in content]
    if missing:
        raise ModelError(f"{whose}: no '{missing[0]}'; it needs {', '.join(keys)}")


def _name(row: Any) -> str:
    return str(row.get('name')) if isinstance(row, dict) else ''


def _called(row: Mapping[str, Any]) -> str:
    return f"parameter '{row.get('name')}' of joint '{row.get('joint')}'"
