# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of two links on springs, with intervals, against those that are known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.papers.elastic.identification.names import parameter_names, unpack
from armid_ros.papers.elastic.identification.output import total_damping
from armid_ros.papers.elastic.identification.rigid import CUTOFF, RigidFit
from armid_ros.papers.elastic.identification.three_steps import TwoInertiaIdentification
from armid_ros.report.notation import digits, measured, pretty
from armid_ros.report.page import Section
from armid_ros.robots.two_link import TwoLinkParameters
import numpy as np

Line = tuple[str, str, str, str, str, str, str, str]


@dataclass(frozen=True)
class ElasticParameters(Section):
    """
    Parameters with intervals against those that are known.

    Attributes
    ----------
    result : TwoInertiaIdentification
        What was found.
    known : TwoLinkParameters, or None
        What it is compared with.
    source : str
        Where that comes from.

    """

    title: ClassVar[str] = 'Parameters'
    package: ClassVar[str] = 'armid_ros.papers.elastic.report'
    template: ClassVar[str] = 'parameters.html'

    result: TwoInertiaIdentification
    known: TwoLinkParameters | None
    source: str

    @property
    def tuned(self) -> bool:
        """Whether step responses have tuned them, which gives them intervals."""
        return self.result.tuning is not None

    @property
    def rows(self) -> list[Line]:
        """Name, joint, unit, value, half width of the interval, untuned, known, difference."""
        result = self.result
        names = parameter_names(tuple(joint.joint for joint in result.joints))
        values, untuned = unpack(result.parameters), unpack(result.untuned)
        std = np.full(len(values), np.nan)
        if result.tuning is not None:
            std = result.tuning.estimate.std
        base = None if self.known is None else unpack(self.known)
        rows = [
            (
                pretty(name.name), name.joint, pretty(name.unit),
                *measured(values[k], HALF_WIDTH * std[k]),
                digits(untuned[k], 4),
                *_against(values[k], None if base is None else base[k]),
            )
            for k, name in enumerate(names)
        ]  # fmt: skip
        if result.tuning is None:
            return rows
        for k, total in enumerate(total_damping(result)):
            known = None if self.known is None else float(self.known.total_damping[k])
            rows.append(
                (
                    pretty(total['name']), total['joint'], pretty(total['unit']),
                    *measured(total['value'], HALF_WIDTH * total['std']),
                    digits(float(result.untuned.total_damping[k]), 4),
                    *_against(total['value'], known),
                )
            )  # fmt: skip
        return rows


def _against(value: float, known: float | None) -> tuple[str, str]:
    """Return what is known, and by how much the value differs from it."""
    if known is None:
        return '', ''
    return f'{known:g}', f'{100.0 * (value / known - 1.0):+.2f} %'


@dataclass(frozen=True)
class RigidParameters(Section):
    """
    What slow motion shows of the arm as if its joints were rigid.

    Attributes
    ----------
    fit : RigidFit
        Step 1.

    """

    title: ClassVar[str] = 'Rigid arm'
    package: ClassVar[str] = 'armid_ros.papers.elastic.report'
    template: ClassVar[str] = 'rigid.html'

    fit: RigidFit

    @property
    def cutoff(self) -> float:
        """Below which the motion counts [Hz]."""
        return CUTOFF

    @property
    def rows(self) -> list[tuple[str, str, str, str, str]]:
        """Name, joint, value, half width of the interval, unit."""
        estimate = self.fit.estimate
        return [
            (pretty(name.name), name.joint, *measured(value, HALF_WIDTH * std), pretty(name.unit))
            for name, value, std in zip(
                estimate.parameters, estimate.values, estimate.std, strict=True
            )
        ]
