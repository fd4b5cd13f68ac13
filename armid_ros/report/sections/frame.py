# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The sections that every page has: verdict, what was asked, what to do next, provenance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.report.blocks import BarChart, BulletList, ContentSection
from armid_ros.report.page import Section
from armid_ros.report.provenance import Provenance


@dataclass(frozen=True)
class VerdictSection(Section):
    """
    The verdict box of a page.

    Attributes
    ----------
    grade : str
        One word, shown as a badge; empty for none.
    tone : {'good', 'fair', 'bad', ''}
        Colour of the badge.
    sentences : sequence of str
        What was found; the first stands out.
    beware : sequence of str
        What not to overlook.
    bars : BarChart or None
        The number of the verdict for each joint.
    step : str
        What to do next; empty for nothing.

    """

    title: ClassVar[str] = 'Verdict'
    template: ClassVar[str] = 'verdict.html'

    grade: str
    tone: str
    sentences: Sequence[str]
    beware: Sequence[str] = ()
    bars: BarChart | None = None
    step: str = ''


def next_steps_section(steps: Sequence[str]) -> ContentSection:
    """Return the next steps, most useful first."""
    return ContentSection('What to do next', [BulletList([(step, '') for step in steps], True)])


@dataclass(frozen=True)
class Origin(Section):
    """Files with their hashes, versions, settings, seed."""

    title: ClassVar[str] = 'Provenance'
    template: ClassVar[str] = 'origin.html'

    provenance: Provenance
