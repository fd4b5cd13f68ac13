# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of all written files, from their JSON Schemas and the schemas of fleet tables."""

from __future__ import annotations

from collections.abc import Iterator
import json
from pathlib import Path
from typing import Any

from armid_ros.fleet import diagnose, results, watch
from jsonschema import Draft202012Validator

from docsite.markdown import cell, table

FOLDER = Path(__file__).parents[1] / 'docs' / 'schemas'
SUFFIX = '.schema.json'
#: Arrow schemas of the Parquet files that armid fleet writes, by data set.
FLEET_TABLES = {
    'bags': results.BAGS,
    'parameters': results.PARAMETERS,
    'arms': results.ARMS,
    'refused': results.REFUSED,
    'watch/arms': watch.ARMS,
    'watch/changes': watch.CHANGES,
    'watch/wear': watch.WEAR,
    'watch/diagnoses': diagnose.DIAGNOSES,
}


def schemas_page(introduction: str) -> str:
    """Return the introduction, the keys of every JSON file, and the columns of fleet tables."""
    lines = [introduction]
    for path in sorted(FOLDER.glob(f'*{SUFFIX}')):
        schema = json.loads(path.read_text(encoding='utf-8'))
        lines += [f'## {schema["title"]}', '', schema['description'], '']
        lines += [f'JSON Schema: [{path.name}](../schemas/{path.name})', '']
        rows = [(f'`{key}`', kind, cell(text)) for key, kind, text in _keys(schema, schema, '')]
        lines += table(('key', 'type', 'meaning'), rows)
    lines += ['## Tables of armid fleet', '']
    lines += table(
        ('data set', 'columns with Arrow types'),
        [
            (name, ', '.join(f'`{field.name}` ({field.type})' for field in schema))
            for name, schema in FLEET_TABLES.items()
        ],
    )
    return '\n'.join(lines)


def _keys(
    whole: dict[str, Any], schema: dict[str, Any], prefix: str
) -> Iterator[tuple[str, str, str]]:
    """Yield path, type and description of each key of a schema; a parent precedes its children."""
    for name, found in schema.get('properties', {}).items():
        one = resolved(whole, found)
        key = f'{prefix}{name}'
        optional = '' if name in schema.get('required', ()) else ' (not always)'
        yield (
            key,
            f'{_kind(one)}{optional}',
            found.get('description') or one.get('description', ''),
        )
        items = resolved(whole, one.get('items', {}))
        if items:
            yield from _keys(whole, items, f'{key}[].')
        yield from _keys(whole, one, f'{key}.')


def faults(name: str, document: dict[str, Any]) -> list[str]:
    """
    Return the faults of a JSON document: violations of its schema, and keys without a schema.

    Parameters
    ----------
    name : str
        Name of the schema, such as 'identification'.
    document : dict
        The content of the JSON file.

    """
    schema = json.loads((FOLDER / f'{name}{SUFFIX}').read_text(encoding='utf-8'))
    wrong = [
        f'{error.json_path}: {error.message}'
        for error in Draft202012Validator(schema).iter_errors(document)
    ]
    return sorted({*wrong, *_undescribed(schema, schema, document, '$')})


def _undescribed(
    whole: dict[str, Any], schema: dict[str, Any], document: Any, where: str
) -> Iterator[str]:
    """Yield the keys of a JSON document that are not properties of its schema."""
    schema = resolved(whole, schema)
    for choice in schema.get('anyOf', ()):
        if choice.get('type') != 'null':
            schema = resolved(whole, choice)
    if isinstance(document, list):
        for item in document:
            yield from _undescribed(whole, schema.get('items', {}), item, f'{where}[]')
    elif isinstance(document, dict) and 'additionalProperties' not in schema:
        known = schema.get('properties', {})
        for key, value in document.items():
            if key in known:
                yield from _undescribed(whole, known[key], value, f'{where}.{key}')
            else:
                yield f'{where}.{key}: is in no schema'


def resolved(whole: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    """Return the part of a JSON schema that a `$ref` names; a schema without `$ref` as it is."""
    reference = schema.get('$ref')
    if reference is None:
        return schema
    found: dict[str, Any] = whole
    for step in reference.removeprefix('#/').split('/'):
        found = found[step]
    return found


def _kind(schema: dict[str, Any]) -> str:
    if 'const' in schema:
        return f'`{schema["const"]}`'
    if 'enum' in schema:
        return ', '.join(f'`{value}`' for value in schema['enum'])
    kind = schema.get('type', 'any')
    return ' or '.join(kind) if isinstance(kind, list) else kind
