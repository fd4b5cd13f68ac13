# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.estimate import Estimate
from armid_ros.identification.fitting.identifiability import HALF_WIDTH, Unidentified
from armid_ros.motion import FloatArray
from armid_ros.report.families import full_label, grouping, parameter_families, rigid_label
from armid_ros.report.notation import digits, measured, pretty
from armid_ros.report.page import Section
import numpy as np


@dataclass(frozen=True)
class ParameterRow:
    """
    One parameter.

    Attributes
    ----------
    name, joint, unit : str
        Which.
    of : str
        The sum that a group of parameters is; empty for one alone.
    rigid : bool
        Whether it belongs to a link, and not to an effect.
    value, reach, described : float
        Estimate, half width of its 95 % interval, and the description's value; an effect of
        which a description has zero is one that it does not know.

    """

    name: str
    joint: str
    unit: str
    rigid: bool
    value: float
    reach: float
    described: float
    of: str = ''

    @property
    def known(self) -> bool:
        """Whether the description has a value of it."""
        return self.rigid or self.described != 0.0  # noqa: RUF069 - an effect without a value

    @property
    def text(self) -> tuple[str, str, str]:
        """
        Estimate and half width, to the digit that the half width leaves; described value.

        The value of an estimate whose interval includes zero is not shown.

        """
        described = f'{self.described:.3g}' if self.known else 'none'
        if not self.told:
            return 'includes 0', f'{self.reach:.2g}', described
        return (*measured(self.value, self.reach), described)

    @property
    def told(self) -> bool:
        """Whether the interval leaves out zero."""
        return self.reach <= 0.0 or abs(self.value) > self.reach

    @property
    def changed(self) -> bool:
        """Whether the description's value is outside the interval."""
        return self.known and abs(self.value - self.described) > self.reach

    @property
    def relative(self) -> str:
        """Half width as a share of the value, or that it is larger."""
        if not self.told:
            return '> 100 %'
        return f'{digits(100.0 * self.reach / abs(self.value))} %'

    def place(self, number: float) -> float:
        """Return where a number is on the row's own axis, 0 to 100, zero at 50."""
        span = max(abs(self.value) + self.reach, abs(self.described)) or 1.0
        return round(50.0 + 48.0 * float(np.clip(number / span, -1.0, 1.0)), 2)


@dataclass(frozen=True)
class ParameterSection(Section):
    """
    Every parameter against the description's.

    Attributes
    ----------
    estimate : Estimate
        P parameters.
    described : ndarray, shape (P,)
        Values of the description; zero for effects it does not know.
    unidentified : sequence of Unidentified
        What the data do not tell.
    links : sequence of str
        Names of the links, in the order of their numbers.
    reference : str
        What ``described`` is: 'description', or 'truth' of a simulated arm.

    """

    title: ClassVar[str] = 'Parameters'
    template: ClassVar[str] = 'parameters.html'

    estimate: Estimate
    described: FloatArray
    unidentified: Sequence[Unidentified] = ()
    links: Sequence[str] = ()
    reference: str = 'description'

    @property
    def lost(self) -> dict[str, list[str]]:
        """Reasons why parameters have no row, and these parameters."""
        found: dict[str, list[str]] = {}
        for one in self.unidentified:
            if one.parameter not in self.estimate.parameters:
                found.setdefault(one.reason, []).append(full_label(one.parameter, self.links))
        return found

    @property
    def families(self) -> Sequence[tuple[str, str, Sequence[ParameterRow]]]:
        """Heading, unit and rows of each kind."""
        names, values = self.estimate.parameters, self.estimate.values
        reach = HALF_WIDTH * self.estimate.std
        families = []
        for (title, unit), members in parameter_families(names).items():
            rows = [
                ParameterRow(
                    rigid_label(names[k], self.links) if names[k].rigid else names[k].name,
                    names[k].joint,
                    pretty(names[k].unit),
                    names[k].rigid,
                    float(values[k]),
                    float(reach[k]),
                    float(self.described[k]),
                    grouping(names[k], self.links) if names[k].rigid else '',
                )
                for k in members
            ]
            families.append((title, unit, rows))
        return families

    @property
    def changed(self) -> int:
        """Return the number of parameters whose interval leaves out the description's value."""
        return sum(row.changed for _, _, rows in self.families for row in rows)

    @property
    def described_count(self) -> int:
        """Return the number of parameters of which the description has a value."""
        return sum(row.known for _, _, rows in self.families for row in rows)
