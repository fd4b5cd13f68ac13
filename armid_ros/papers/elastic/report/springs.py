# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Springs of any arm: stiffness, free play and motor of every joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.papers.elastic.identification.joints import SpringEstimate
from armid_ros.report.page import Section
import numpy as np


@dataclass(frozen=True)
class Springs(Section):
    """
    Stiffness, free play and motor of every joint.

    Attributes
    ----------
    found : sequence of SpringEstimate
        Every joint.

    """

    title: ClassVar[str] = 'Springs'
    package: ClassVar[str] = 'armid_ros.papers.elastic.report'
    template: ClassVar[str] = 'springs.html'

    found: Sequence[SpringEstimate]

    @property
    def springs(self) -> list[tuple[str, str, str, str, str, str]]:
        """Joint, stiffness, interval, free play, correlation of the two, R^2."""
        rows = []
        for one in self.found:
            fit = one.transmission
            value, low, high = fit.stiffness
            play = [1e3 * x for x in fit.backlash]
            rows.append(
                (
                    one.joint,
                    f'{value:.4g}' if one.informative else 'not identifiable',
                    f'{low:.4g} to {high:.4g}' if one.informative else '',
                    f'{play[1]:.2g} to {play[2]:.2g}'
                    if np.isfinite(play).all()
                    else 'no reversals',
                    f'{fit.correlation:+.2f}' if np.isfinite(fit.correlation) else '',
                    f'{fit.explained:.4f}',
                )
            )
        return rows

    @property
    def motors(self) -> list[tuple[str, str, str, str, str, str, str]]:
        """Joint, inertia of the link, rotor, friction twice, antiresonance, resonance."""
        rows = []
        for one in self.found:
            own = ['', '', ''] if one.motor is None else [f'{x:.3g}' for x in one.motor]
            both = [
                f'{x:.1f}' if one.informative and np.isfinite(x) else ''
                for x in (one.antiresonance, one.resonance)
            ]
            rows.append(
                (one.joint, f'{one.inertia:.3g}', own[0], own[1], own[2], both[0], both[1])
            )
        return rows
