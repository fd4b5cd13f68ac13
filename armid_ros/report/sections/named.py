# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters of what was named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.diagnosis import Finding
from armid_ros.report.notation import with_interval
from armid_ros.report.page import Section


@dataclass(frozen=True)
class NamedParameters(Section):
    """
    Values with 95 % intervals.

    Attributes
    ----------
    findings : sequence of Finding
        What was named.

    """

    title: ClassVar[str] = 'Parameters'
    template: ClassVar[str] = 'named.html'

    findings: Sequence[Finding]

    @property
    def rows(self) -> list[tuple[str, str, str, str]]:
        """Effect, parameter, joint or segment, and value with its interval, as text."""
        return [
            (
                finding.name.replace('_', ' '),
                name.name.replace('_', ' '),
                finding.place_of(name.joint) or 'whole arm',
                with_interval(value, std, name.unit),
            )
            for finding in self.findings
            for name, value, std in zip(
                finding.parameters, finding.values, finding.std, strict=True
            )
        ]
