# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Values that the source of a shipped robot does not give: assumptions with reasons."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from armid_ros.files import load_yaml


@dataclass(frozen=True)
class Assumption:
    """
    One assumption.

    Attributes
    ----------
    value : float, list, dict or str
        Assumed value.
    unit : str
        Its unit.
    reason : str
        Why.

    """

    value: Any
    unit: str
    reason: str


def read_assumptions() -> Mapping[str, Assumption]:
    """Read the assumptions of the human-exoskeleton leg pair."""
    text = leg_pair_file('exoskeleton_legs/assumptions.yaml').read_text(encoding='utf-8')
    return {name: Assumption(**entry) for name, entry in load_yaml(text).items()}


def leg_pair_file(name: str) -> Path:
    """Return a file that is shipped with the leg pair, such as 'human_legs/gait.csv'."""
    return Path(str(resources.files('armid_ros.robots').joinpath(name)))
