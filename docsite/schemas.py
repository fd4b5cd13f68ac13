# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of all written files, from their JSON Schemas."""

from __future__ import annotations

from collections.abc import Iterator
import json
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator

from docsite.markdown import cell, table

FOLDER = Path(__file__).parents[1] / 'docs' / 'schemas'
SUFFIX = '.schema.json'


def schemas_page(introduction: str) -> str:
    """Return the introduction, and then the keys of every kind of file."""
    lines = [introduction]
    for path in sorted(FOLDER.glob(f'*{SUFFIX}')):
        schema = json.loads(path.read_text(encoding='utf-8'))
        lines += [f'## {schema["title"]}', '', schema['description'], '']
        lines += [f'JSON Schema: [{path.name}](../schemas/{path.name})', '']
        rows = [(f'`{key}`', kind, cell(text)) for key, kind, text in _keys(schema, schema, '')]
        lines += table(('key', 'type', 'what it holds'), rows)
    return '\n'.join(lines)


def _keys(
    whole: dict[str, Any], schema: dict[str, Any], prefix: str
) -> Iterator[tuple[str, str, str]]:
    """Return path, type and description of every key; nested keys follow their parent."""
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
    Return the faults of a document: violations of its schema, and keys without a schema.

    Parameters
    ----------
    name : str
        Of the schema, such as 'identification'.
    document : dict
        As it was read.

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
    """Return the keys of a document that are not properties of its schema."""
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
    """Return the target of a reference within a schema."""
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
