# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Reading of NAME.mechanism.yaml: couplings of joints that the URDF lacks."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from armid_ros.errors import RobotError
from armid_ros.files import load_yaml, read_text, reading
from armid_ros.robots.description import parse_xml
import numpy as np

#: Suffix of the file in the folder of NAME.urdf, NAME.urdf.xacro or NAME.xml.
SUFFIX = '.mechanism.yaml'


def with_mechanism(text: str, path: Path) -> str:
    """
    Return a URDF with the coupled joints of NAME.mechanism.yaml in its folder, if it exists.

    The additional elements of the result are ignored by other readers of a URDF.

    Raises
    ------
    RobotError
        If the file cannot be read, or has other contents.

    """
    name = path.name
    for end in ('.xacro', '.urdf', '.xml'):
        name = name.removesuffix(end)
    path = path.with_name(name + SUFFIX)
    if not path.is_file():
        return text
    with reading(path, RobotError):
        document = load_yaml(read_text(path, RobotError))
        if not isinstance(document, dict) or document.keys() - {'mimic', 'motors', 'loops'}:
            raise RobotError('has to be a mapping with mimic, motors and loops')
        try:
            lines = _elements(document, text)
        except (AttributeError, KeyError, TypeError) as error:
            raise RobotError(f'an entry of mimic, motors or loops is malformed: {error}') from None
    head, end, tail = text.rpartition('</robot>')
    return ''.join([head, *(f'  {line}\n' for line in lines), end, tail])


def _elements(document: Mapping[str, Any], urdf: str) -> list[str]:
    """Return the elements of a URDF for the contents of a file of coupled joints."""

    def tag(kind: str, /, *inside: str, **attributes: Any) -> str:
        pairs = ''.join(f' {key}={quoteattr(str(value))}' for key, value in attributes.items())
        return f'<{kind}{pairs}>{"".join(inside)}</{kind}>'

    root, lines = parse_xml(urdf), []
    carried = {child.get('link') for child in root.iterfind('joint/child')}
    base = next(
        link.get('name') for link in root.iterfind('link') if link.get('name') not in carried
    )
    for name, limits in (document.get('motors') or {}).items():
        ends = {'lower': -np.inf, 'upper': np.inf, 'effort': np.inf, 'velocity': np.inf}
        inside = tag('parent', link=base), tag('child', link=f'{name}_motor')
        limit = tag('limit', **(ends | (limits or {})))
        lines.append(tag('link', name=f'{name}_motor'))
        lines.append(tag('joint', *inside, limit, name=name, type='revolute'))
    for name, factors in (document.get('mimic') or {}).items():
        offset = factors.pop('offset', 0.0)
        for leader, factor in factors.items():
            values = {'joint': leader, 'multiplier': factor, 'offset': offset}
            lines.append(tag('mimic', follower=name, **values))
            offset = 0.0
    for loop in document.get('loops') or ():
        points = [
            tag('point', link=link, xyz=' '.join(map(str, xyz)))
            for link, xyz in loop['points'].items()
        ]
        lines.append(tag('loop', *points, passive=' '.join(loop['passive'])))
    return lines
