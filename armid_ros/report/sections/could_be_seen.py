# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What silence is worth: from which size on each effect would have shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import ClassVar

from armid_ros.diagnosis.verdict.detectable import Detectable
from armid_ros.report.notation import digits, pretty
from armid_ros.report.page import Section


@dataclass(frozen=True)
class CouldBeSeen(Section):
    """
    Smallest sizes that show, by effect.

    Attributes
    ----------
    sizes : sequence of Detectable
        Of all effects on all joints, those of an effect together.

    """

    title: ClassVar[str] = 'What could have been seen'
    template: ClassVar[str] = 'could_be_seen.html'

    sizes: Sequence[Detectable]

    @property
    def rows(self) -> list[tuple[str, str, str, str]]:
        """Effect, size where it shows best and where worst, and where it does not, as text."""
        rows = []
        for name in dict.fromkeys(size.name for size in self.sizes):
            own = [size for size in self.sizes if size.name == name]
            told = sorted((s for s in own if math.isfinite(s.size)), key=lambda s: s.size)
            best, worst = (_size(told[0]), _size(told[-1])) if told else ('', '')
            never = '; '.join(_place(s) for s in own if not math.isfinite(s.size))
            rows.append((name.replace('_', ' '), best, worst if worst != best else '', never))
        return rows


def _size(one: Detectable) -> str:
    unit = '' if one.parameter is None else pretty(one.parameter.unit)
    where = f' in {_place(one)}' if one.joints else ''
    return f'{digits(one.size)} {unit}'.strip() + where


def _place(one: Detectable) -> str:
    return ', '.join(one.joints) or 'the arm'
