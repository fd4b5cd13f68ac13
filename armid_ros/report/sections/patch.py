# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The patch of the model as text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.diagnosis import Finding
from armid_ros.effects import CATALOGUE
from armid_ros.report.page import Section


@dataclass(frozen=True)
class PatchSection(Section):
    """
    What was added to the model, to be read and to be copied.

    Attributes
    ----------
    findings : sequence of Finding
        What was named.
    text : str
        model.yaml.

    """

    title: ClassVar[str] = 'Patch'
    template: ClassVar[str] = 'patch.html'

    findings: Sequence[Finding]
    text: str

    @property
    def added(self) -> list[tuple[str, str]]:
        """Name of each effect, and what it is."""
        return [
            (f.name, CATALOGUE[f.name].summary if f.name in CATALOGUE else 'an effect of your own')
            for f in self.findings
        ]

    @property
    def yaml(self) -> str:
        """The effects of the patched model."""
        start = max(self.text.find('effects:'), 0)
        end = self.text.find('\nmisfit:')
        return self.text[start:end] if end > start else self.text[start:]
