# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Libraries that only some formats need."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from armid_ros.errors import RecordingError


def imported(library: str, path: Path, format_name: str) -> Any:
    """Import a library; RecordingError says how to install it."""
    try:
        return import_module(library)
    except ImportError:
        raise RecordingError(
            f'{path}: {format_name} is read by {library.split(".")[0]}, which is not installed: '
            "pip install 'armid_ros[convert]'"
        ) from None
