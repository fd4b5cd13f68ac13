# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The facts of a document: numbers and names, without sentences, paths, times and curves.

Two answers agree where each stored fact is in the new one. A number agrees to 0.2 % of its size or
to an absolute floor: a tenth of the standard deviation in the same record, or what `_FLOORS` says.

"""

from __future__ import annotations

from collections.abc import Iterator
import math
import re
from typing import Any

#: Relative difference that rounding and the kernel of the BLAS may make.
RELATIVE = 2e-3
#: Absolute difference of a number that stands in no record with a standard deviation.
FLOOR = 1e-6
#: Share of the standard deviation of the same record.
OF_STD = 0.1
#: A longer list of numbers is kept as its length and its root mean square.
CURVE = 16
#: A longer list of records is kept as its length and its first records.
ROWS = 24

#: A word, or words joined by a sign as in `Ixx2 - Izz2 + 0.16 m3`.
_WORD = r'(?:\d[\d.]* )?[\w.@|*:()^-]*[\w)]'
_NAME = re.compile(rf'(?=.{{1,80}}$){_WORD}(?:(?: [+|*-] |, ?){_WORD})*')
_IGNORED = re.compile(
    r'(.*(seconds|_time|path|file|folder|bag|command|version|created|hash|sha256|digest|source|urdf'
    r'|text|summary|reason|advice|hint|note|detail|description|title|unit|label|html)s?)'
    r'|candidates|detectable|not_visible|next_run|suspected|minor'  # how an answer was found
)


def facts(document: Any) -> Any:
    """
    Reduce a document to what is held.

    Parameters
    ----------
    document : dict, list, str, float, bool or None
        As `json.loads` returns it.

    """
    if isinstance(document, dict):
        kept = {
            key: facts(value) for key, value in document.items() if not _IGNORED.fullmatch(key)
        }
        return {key: value for key, value in kept.items() if value not in ('', {}, None)}
    if isinstance(document, list):
        return _list(document)
    if isinstance(document, str):
        return document if _NAME.fullmatch(document) else ''
    if isinstance(document, float):
        return float(f'{document:.6g}') if math.isfinite(document) else str(document)
    return document


def _list(items: list[Any]) -> Any:
    """Keep a short list whole, and of a long one its length and size or its beginning."""
    if len(items) > CURVE and all(_is_number(item) for item in items):
        rms = math.sqrt(math.fsum(item * item for item in items) / len(items))
        return {'length': len(items), 'rms': facts(float(rms))}
    if len(items) > CURVE and all(isinstance(item, list) for item in items):
        return {'length': len(items)}
    kept = [facts(item) for item in items[:ROWS]]
    return kept if len(items) <= ROWS else {'length': len(items), 'first': kept}


def _is_number(item: Any) -> bool:
    return isinstance(item, int | float) and not isinstance(item, bool)


def differences(stored: Any, answered: Any, where: str = '', floor: float = FLOOR) -> list[str]:
    """
    List what differs from the stored facts; empty where all agree.

    Parameters
    ----------
    stored, answered : dict, list, str, float, bool or None
        Facts; what is in the second one alone is no difference.
    where : str
        Path to them in the document.
    floor : float
        Absolute tolerance of numbers.

    """
    return list(_differences(stored, answered, where, floor))


def _differences(stored: Any, answered: Any, where: str, floor: float) -> Iterator[str]:
    if isinstance(stored, dict) and isinstance(answered, dict):
        std = stored.get('std')
        floor = max(floor, OF_STD * std) if _is_number(std) else floor
        for key, value in stored.items():
            if key in answered:
                yield from _differences(value, answered[key], f'{where}/{key}', floor)
            else:
                yield f'{where}/{key}: {value!r} is missing'
    elif isinstance(stored, list) and isinstance(answered, list):
        if len(stored) != len(answered):
            yield f'{where}: {len(answered)} entries, not {len(stored)}'
        for index, (old, new) in enumerate(zip(stored, answered, strict=False)):
            yield from _differences(old, new, f'{where}/{index}', floor)
    elif _is_number(stored) and _is_number(answered):
        if not math.isclose(stored, answered, rel_tol=RELATIVE, abs_tol=floor):
            yield f'{where}: {answered!r}, not {stored!r}'
    elif stored != answered:
        yield f'{where}: {answered!r}, not {stored!r}'
