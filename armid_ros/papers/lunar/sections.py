# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables, torque curves and gravity parameters of the lunar paper, repeated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.motion import FloatArray
from armid_ros.papers.lunar.reproduction import Composite, Repeated
from armid_ros.report.charts import Chart, Series, thinned
from armid_ros.report.notation import digits, measured
from armid_ros.report.page import Section
import numpy as np

Row = tuple[str, list[str]]


@dataclass(frozen=True)
class PaperTables(Section):
    """
    The paper's tables next to those of the repeat, joint by joint.

    Attributes
    ----------
    repeated : tuple of Repeated
        Tables in order.

    """

    title: ClassVar[str] = 'Tables'
    package: ClassVar[str] = 'armid_ros.papers.lunar'
    template: ClassVar[str] = 'tables.html'

    repeated: tuple[Repeated, ...]

    @property
    def tables(self) -> list[tuple[Repeated, list[Row]]]:
        """Each table with its rows: joint and cells, the mean last."""
        return [(one, self._rows(one)) for one in self.repeated]

    def _rows(self, one: Repeated) -> list[Row]:
        slow, whole = one.methods
        scale = 1.0 if one.table.uniform else 100.0
        ratios = [
            scale * ratio
            for ratio in (
                one.table.ratio,
                one.ratio(slow.noisy),
                one.ratio(slow.held_out),
                one.ratio(whole.held_out),
            )
        ]
        rows = [
            (
                joint,
                [
                    digits(1e3 * one.table.peak[k], 3),
                    digits(1e3 * one.peak[k], 3),
                    digits(1e3 * one.table.error[k]),
                    digits(1e3 * slow.held_out[k]),
                    digits(1e3 * whole.held_out[k]),
                    *(digits(float(ratio[k])) for ratio in ratios),
                ],
            )
            for k, joint in enumerate(one.joints)
        ]
        means = [digits(float(np.mean(ratio))) for ratio in ratios]
        return [*rows, ('mean', ['', '', '', '', '', *means])]


@dataclass(frozen=True)
class TorqueCurves(Section):
    """
    True torque and that of the identified weight, along a trajectory that was not used.

    Attributes
    ----------
    repeated : tuple of Repeated
        Tables in order.

    """

    title: ClassVar[str] = 'Torque curves'
    package: ClassVar[str] = 'armid_ros.papers.lunar'
    template: ClassVar[str] = 'curves.html'

    repeated: tuple[Repeated, ...]

    @property
    def drawn(self) -> list[tuple[Repeated, list[tuple[str, Chart]]]]:
        """Each table with the charts of its joints."""
        return [
            (one, [(joint, self._chart(one, k)) for k, joint in enumerate(one.joints)])
            for one in self.repeated
        ]

    def _chart(self, one: Repeated, joint: int) -> Chart:
        tau = one.test.motion.tau
        assert tau is not None
        true: FloatArray = 1e3 * tau[:, joint]
        found: FloatArray = 1e3 * one.test.predicted[:, joint]
        kept = thinned(true, found)
        return Chart(
            one.test.motion.t[kept],
            [Series('true', true[kept]), Series('identified', found[kept], 'predicted')],
            'time [s]',
            'torque [N mm]',
            height=170,
            link=f'table{one.table.number}',
        )


@dataclass(frozen=True)
class GravityParameters(Section):
    """
    The minimal gravity parameters, with and without the load.

    Attributes
    ----------
    composites : tuple of Composite
        All of them.
    load : str
        The mass that the two runs differ by, as it is read.

    """

    title: ClassVar[str] = 'Gravity parameters'
    package: ClassVar[str] = 'armid_ros.papers.lunar'
    template: ClassVar[str] = 'composites.html'

    composites: tuple[Composite, ...]
    load: str

    @property
    def rows(self) -> list[tuple[str, str, list[str]]]:
        """Expression, joint and cells."""
        return [
            (
                one.name,
                one.joint,
                [
                    f'{one.truth:.3f}',
                    ' ± '.join(measured(one.value, HALF_WIDTH * one.std)),
                    f'{one.loaded_truth:.3f}',
                    ' ± '.join(measured(one.loaded, HALF_WIDTH * one.loaded_std)),
                ],
            )
            for one in self.composites
        ]
