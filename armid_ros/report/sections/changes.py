# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of two identifications side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.identification.assess.comparison import Comparison, ParameterChange
from armid_ros.identification.fitting.identifiability import excludes_zero, HALF_WIDTH
from armid_ros.report.families import grouping, parameter_families, rigid_label
from armid_ros.report.notation import measured
from armid_ros.report.page import Section


@dataclass(frozen=True)
class ChangeRow:
    """
    One parameter.

    Attributes
    ----------
    change : ParameterChange
        Both values.

    """

    change: ParameterChange

    @property
    def label(self) -> str:
        """Return the parameter, or its joint where the heading says the kind."""
        name = self.change.parameter
        return rigid_label(name) if name.rigid else name.joint or name.name

    @property
    def of(self) -> str:
        """Return the sum that a group of parameters is; empty for one alone."""
        return grouping(self.change.parameter) if self.change.parameter.rigid else ''

    @property
    def texts(self) -> tuple[str, str, str]:
        """Both values with their 95 % intervals, and the difference in standard deviations."""
        c = self.change
        return (
            _value(c.before, c.before_std),
            _value(c.after, c.after_std),
            f'{c.deviations:+.1f}',
        )

    def place(self, number: float) -> float:
        """Return where a number is on the row's own axis, 0 to 100, zero at 50."""
        c = self.change
        reach = HALF_WIDTH * max(c.before_std, c.after_std)
        span = max(abs(c.before), abs(c.after)) + reach or 1.0
        return round(50.0 + 48.0 * number / span, 2)

    @property
    def interval(self) -> tuple[float, float]:
        """Where the interval of the second begins and what is left behind it, 0 to 100."""
        c, reach = self.change, HALF_WIDTH * self.change.after_std
        return self.place(c.after - reach), round(100.0 - self.place(c.after + reach), 2)


def _value(value: float, std: float) -> str:
    """Return a value with its 95 % interval, and no value where that includes zero."""
    number, reach = measured(value, HALF_WIDTH * std)
    return f'{number} ± {reach}' if excludes_zero(value, std) else f'includes 0, ± {reach}'


@dataclass(frozen=True)
class Changes(Section):
    """
    Every parameter of both.

    Attributes
    ----------
    comparison : Comparison
        The two.

    """

    title: ClassVar[str] = 'Side by side'
    template: ClassVar[str] = 'changes.html'

    comparison: Comparison

    @property
    def families(self) -> Sequence[tuple[str, str, int, Sequence[ChangeRow]]]:
        """Heading, unit, how many changed, and rows of each kind."""
        names = tuple(change.parameter for change in self.comparison.changes)
        families = []
        for (title, unit), members in parameter_families(names).items():
            rows = [ChangeRow(self.comparison.changes[k]) for k in members]
            count = sum(row.change.changed for row in rows)
            families.append((title, unit, count, rows))
        return families
