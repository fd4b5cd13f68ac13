# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The library that only learning needs."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from armid_ros.errors import IdentificationError


def imported(library: str) -> Any:
    """Import a library; IdentificationError says how to install it."""
    try:
        return import_module(library)
    except ImportError:
        raise IdentificationError(
            'learning a residual needs scikit-learn, which is not installed: '
            "pip install 'armid_ros[residual]'"
        ) from None


def require_libraries() -> None:
    """
    Check that it is installed, before minutes of work.

    Raises
    ------
    IdentificationError
        If it is not; the message says how to install it.

    """
    imported('sklearn')
