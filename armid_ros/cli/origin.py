# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where a result comes from, as its report tells it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import datetime
from pathlib import Path
import shlex
import sys
from typing import Any

from armid_ros.report.provenance import hash_files, Provenance, versions


def provenance(
    paths: Iterable[Path], settings: Mapping[str, Any] | None = None, seed: int | None = None
) -> Provenance:
    """
    Return the provenance of the running command.

    Parameters
    ----------
    paths : iterable of Path
        What it reads; files and folders.
    settings : mapping of str to object, optional
        What it uses.
    seed : int, optional
        Of its random numbers.

    """
    return Provenance(
        files=hash_files(paths),
        versions=versions(),
        settings={name: _text(value) for name, value in (settings or {}).items()},
        seed=seed,
        command=shlex.join(['armid', *sys.argv[1:]]),
        created=datetime.now().astimezone().isoformat(' ', 'seconds'),
    )


def _text(value: Any) -> str:
    if isinstance(value, list):
        return ', '.join(map(_text, value))
    return f'{value:.6g}' if isinstance(value, float) else str(value)
