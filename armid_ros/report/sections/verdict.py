# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What was found, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.report.page import Section


@dataclass(frozen=True)
class VerdictSection(Section):
    """
    The sentence that a reader takes away.

    Attributes
    ----------
    grade : str
        One word, shown as a badge.
    tone : {'good', 'fair', 'bad'}
        Colour of the badge.
    sentences : sequence of str
        What was found; the first stands out.
    beware : sequence of str
        What not to overlook.

    """

    title: ClassVar[str] = 'Verdict'
    template: ClassVar[str] = 'verdict.html'

    grade: str
    tone: str
    sentences: Sequence[str]
    beware: Sequence[str] = ()
