# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is statistically there and does not matter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.diagnosis import Finding
from armid_ros.report.notation import percent, probability, with_interval
from armid_ros.report.page import Section


@dataclass(frozen=True)
class SmallPrint(Section):
    """
    Minor effects.

    Attributes
    ----------
    minor : sequence of Finding
        What is there beyond chance and smaller than what matters.
    patched : bool
        Whether it was added to the model all the same.

    """

    title: ClassVar[str] = 'Small print'
    template: ClassVar[str] = 'small_print.html'

    minor: Sequence[Finding]
    patched: bool = False

    @property
    def rows(self) -> list[tuple[str, str, str, str, str]]:
        """Effect, joints, first value, share and p, as text."""
        return [
            (
                one.name.replace('_', ' '),
                ', '.join(one.joints) or 'whole arm',
                with_interval(one.values[0], one.std[0], one.parameters[0].unit)
                if one.values
                else '',
                percent(one.share),
                probability(one.p),
            )
            for one in self.minor
        ]
