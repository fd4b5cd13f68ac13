# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The sections that every page has: verdict, what was asked, what to do next, provenance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.report.page import Section
from armid_ros.report.provenance import Provenance


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


@dataclass(frozen=True)
class Origin(Section):
    """Files with their hashes, versions, settings, seed."""

    title: ClassVar[str] = 'Provenance'
    template: ClassVar[str] = 'origin.html'

    provenance: Provenance
