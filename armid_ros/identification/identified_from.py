# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Recordings from which a model was identified, as listed in its identification.json.

They are the baseline of a diagnosis. The file has a size and a digest of each, as another
recording may have replaced it at the same path.

"""

from __future__ import annotations

from collections.abc import Mapping
import hashlib
from pathlib import Path
from typing import Any

from armid_ros.errors import ModelError
from armid_ros.files import is_file, load_json, read_text, reading

#: File that tools rewrite without changing the data.
_NOT_DATA = 'metadata.yaml'


def _content(path: Path) -> dict[str, Any]:
    """Return size of a file or folder [bytes], and SHA-256 of the ends of its files."""
    inside = sorted(path.rglob('*')) if path.is_dir() else [path]
    digest, total = hashlib.sha256(), 0
    end = 1 << 20  # bytes, enough for time stamps at the begin and the index at the end
    for file in inside:
        if not file.is_file() or file.name == _NOT_DATA:
            continue
        size = file.stat().st_size
        total += size
        digest.update(f'{size};'.encode())
        with file.open('rb') as stream:
            digest.update(stream.read(end))
            stream.seek(max(end, size - end))
            digest.update(stream.read(end))
    return {'size': total, 'digest': digest.hexdigest()}


def with_contents(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return identification.json with sizes and digests of existing recordings."""
    there = [(name, Path(name)) for name in _names(document)]
    rows = [{'bag': name, **_content(path)} for name, path in there if path.exists()]
    return {**document, 'recordings': rows}


def identified_from(path: str | Path) -> tuple[Path, ...]:
    """
    Return the existing recordings of an identification, held-out ones included.

    Parameters
    ----------
    path : str or Path
        Path of model.yaml; the identification.json in its folder names the recordings. Relative
        paths start in the working directory, in that folder, or in its parent.

    Raises
    ------
    ModelError
        If identification.json cannot be read.

    """
    return tuple(_found(Path(path)))


def require_as_identified(path: str | Path) -> None:
    """
    Raise an error if recordings changed since the identification.

    Parameters
    ----------
    path : str or Path
        Path of model.yaml. Recordings without size and digest in the file are not checked.

    Raises
    ------
    ModelError
        With the recording and the remedy.

    """
    for place, known in _found(Path(path)).items():
        if known is not None and _content(place) != known:
            raise ModelError(
                f'{place}: is not the recording any more that {path} was identified from, its '
                'content is another. Name the baseline (--baseline), ask without one '
                '(--no-baseline), or identify the arm again'
            )


def _found(model: Path) -> dict[Path, dict[str, Any] | None]:
    """Return the existing recordings of a model, with their digests if known."""
    beside = model.with_name('identification.json')
    if not is_file(beside):
        return {}
    text = read_text(beside, ModelError)
    with reading(beside, ModelError):
        document = load_json(text)
        known = {
            str(row['bag']): {'size': int(row['size']), 'digest': str(row['digest'])}
            for row in document.get('recordings', [])
        }
        starts = (Path(), beside.parent, beside.parent.parent)
        places = [(name, [start / name for start in starts]) for name in _names(document)]
    return {
        place: known.get(name)
        for name, some in places
        if (place := next((one for one in some if one.exists()), None)) is not None
    }


def _names(document: Mapping[str, Any]) -> list[str]:
    """Return the recordings that a document names, held-out ones last."""
    validation = (row['bag'] for row in document.get('validation', []))
    return [str(name) for name in (*document['training']['bags'], *validation) if name]
