# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A list of facts: what was asked, what the setting was."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.report.page import Section


@dataclass(frozen=True)
class Asked(Section):
    """
    What was asked for.

    Attributes
    ----------
    facts : sequence of (str, str)
        Name and value.

    """

    title: ClassVar[str] = 'What was asked'
    template: ClassVar[str] = 'facts.html'

    facts: Sequence[tuple[str, str]]
