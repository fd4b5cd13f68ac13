# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What was said of changes, beside what was done."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from armid_ros.estimate import ParameterName
from armid_ros.identification.online.change import Change
import numpy as np


@dataclass
class Tally:
    """Changes that were seen: whether the name is right, and how many intervals hold the truth."""

    named: int = 0
    among: int = 0
    wrong: int = 0
    held: int = 0
    intervals: int = 0

    def add(self, truth: Mapping[ParameterName, float], found: Change) -> str:
        """Compare what was said with what was done; return a remark."""
        told = {p for p, value in truth.items() if value} & set(found.size.parameters)
        if not told:
            among = any(set(rival.parameters) & set(truth) for rival in found.rivals)
            self.among += among
            self.wrong += not among
            return '(named second)' if among else '(WRONG)'
        self.named += 1
        right = np.array([truth.get(p, 0.0) for p in found.size.parameters])
        lower, upper = found.size.interval().T
        holds = (lower <= right) & (right <= upper)
        self.held += int(np.sum(holds))
        self.intervals += len(holds)
        return '' if holds.all() else f'({np.sum(~holds)} not true)'

    def __str__(self) -> str:
        """Say both."""
        return (
            f'of changes that were seen {self.named} named, {self.among} named second, '
            f'{self.wrong} wrongly; {self.held} of {self.intervals} 95 % intervals of sizes hold '
            f'the truth, {100.0 * self.held / max(self.intervals, 1):.1f} %'
        )
