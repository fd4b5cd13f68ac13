# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the source of a shipped robot leaves open: assumed values with their reasons."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any

from armid_ros.errors import RobotError
from armid_ros.files import load_yaml, read_text, reading


@dataclass(frozen=True)
class Assumption:
    """
    One assumption.

    Attributes
    ----------
    value : float, list, dict or str
        What is assumed.
    unit : str
        Its unit.
    reason : str
        Why.

    """

    value: Any
    unit: str
    reason: str


def read_assumptions(path: Path | None = None) -> Mapping[str, Assumption]:
    """
    Read a file of assumptions; by default that of the human-exoskeleton leg pair.

    Raises
    ------
    RobotError
        If an entry has no value, unit or reason.

    """
    path = path or leg_pair_file('exoskeleton_legs/assumptions.yaml')
    text = read_text(path, RobotError)
    with reading(path, RobotError):
        entries = load_yaml(text)
        try:
            found = {
                name: Assumption(entry['value'], entry['unit'], entry['reason'])
                for name, entry in entries.items()
            }
        except (AttributeError, KeyError, TypeError) as error:
            raise RobotError(
                f'every entry needs value, unit and reason; one lacks {error}'
            ) from None
    return MappingProxyType(found)


def leg_pair_file(name: str) -> Path:
    """Return a file that is shipped with the leg pair, such as 'human_legs/gait.csv'."""
    return Path(str(resources.files('armid_ros.robots').joinpath(name)))
