# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters of what was named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import ClassVar

from armid_ros.diagnosis import Finding
from armid_ros.report.notation import digits, pretty
from armid_ros.report.page import Section


@dataclass(frozen=True)
class NamedParameters(Section):
    """
    Values with standard deviations.

    Attributes
    ----------
    findings : sequence of Finding
        What was named.

    """

    title: ClassVar[str] = 'Parameters'
    template: ClassVar[str] = 'named.html'

    findings: Sequence[Finding]

    @property
    def rows(self) -> list[tuple[str, str, str, str, str, str]]:
        """Effect, parameter, joint or segment, value, deviation and unit, as text."""
        return [
            (
                finding.name.replace('_', ' '),
                name.name.replace('_', ' '),
                finding.place_of(name.joint),
                digits(value, 4),
                digits(std) if math.isfinite(std) else 'not told',
                pretty(name.unit),
            )
            for finding in self.findings
            for name, value, std in zip(
                finding.parameters, finding.values, finding.std, strict=True
            )
        ]
