# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of springs of any arm: stiffness, free play and motor of every joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.papers.elastic.identification.joints import SpringEstimate
from armid_ros.report.notation import counted
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
from armid_ros.report.sections.frame import Origin, VerdictSection
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


def springs_report(
    found: Sequence[SpringEstimate], robot: str, *, provenance: Provenance | None = None
) -> str:
    """
    Return report.html of springs that were found joint by joint.

    Parameters
    ----------
    found : sequence of SpringEstimate
        Every joint.
    robot : str
        Its name.
    provenance : Provenance, optional
        Files, versions, settings, seed.

    """
    sections: list[Section] = [_verdict(found), Springs(found), Origin(provenance or Provenance())]
    subtitle = f'{robot} · {counted(len(found), "joint")}, encoders on both sides'
    return Page(f'Elastic joints of {robot}', subtitle, sections).html()


def _verdict(found: Sequence[SpringEstimate]) -> VerdictSection:
    told = [one for one in found if one.informative]
    lost = [one.joint for one in found if not one.informative]
    beware = ['Inertias are those of the description or model: a stiffness is as right as they.']
    if lost:
        beware.append(
            f'{", ".join(lost)}: the twist does not follow the load; move links there under more '
            'load, or with finer encoders.'
        )
    if not told:
        return VerdictSection('not identifiable', 'bad', ['No joint shows a spring.'], beware)
    softest = min(told, key=lambda one: one.transmission.stiffness[0])
    value, low, high = softest.transmission.stiffness
    sentences = [
        f'{counted(len(told), "joint")} of {len(found)} show how stiff they are; the softest is '
        f'{softest.joint} with {value:.4g} N m/rad ({low:.4g} to {high:.4g}, 95 %).'
    ]
    loose = [one.joint for one in told if one.transmission.backlash_seen]
    if loose:
        sentences.append(f'Free play is seen at {", ".join(loose)}.')
    return VerdictSection(
        'found' if not lost else 'partial', 'good' if not lost else 'fair', sentences, beware
    )
