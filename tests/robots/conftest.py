# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the package example-robot-data has its robots."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import files
from pathlib import Path

import pytest


@pytest.fixture(scope='session')
def example_robot() -> Callable[[str], Path]:
    """Return a function that finds a URDF by the end of its path."""
    paths = [entry for entry in files('example-robot-data') or [] if entry.suffix == '.urdf']

    def find(ending: str) -> Path:
        return next(Path(str(p.locate())) for p in paths if p.as_posix().endswith(f'/{ending}'))

    return find
