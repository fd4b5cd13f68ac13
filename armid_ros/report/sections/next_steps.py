# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What to do next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.report.page import Section


@dataclass(frozen=True)
class NextSteps(Section):
    """
    What to do next.

    Attributes
    ----------
    steps : sequence of str
        In order of worth.

    """

    title: ClassVar[str] = 'What to do next'
    template: ClassVar[str] = 'next_steps.html'

    steps: Sequence[str]
