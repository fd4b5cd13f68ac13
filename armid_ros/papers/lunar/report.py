# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of the lunar paper, repeated."""

from __future__ import annotations

from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.papers.lunar.paper import LOAD
from armid_ros.papers.lunar.reproduction import Repeated, Reproduction
from armid_ros.papers.lunar.sections import curves_section, gravity_section, tables_section
from armid_ros.report.notation import digits, measured
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
from armid_ros.report.sections.frame import Origin, VerdictSection
import numpy as np

#: Limits of the errors of Tables 3 and 4 [% of the peak], and of Table 6 [of the noise].
_WANTED = 1.0, 0.15


def lunar_report(found: Reproduction, provenance: Provenance) -> str:
    """
    Return report.html of the reproduction.

    Parameters
    ----------
    found : Reproduction
        Tables and gravity parameters.
    provenance : Provenance
        Files, versions, settings, seed.

    """
    sections: list[Section] = [
        verdict(found),
        tables_section(found.repeated),
        curves_section(found.repeated),
        gravity_section(found.composites, _load(found)),
        Origin(provenance),
    ]
    subtitle = 'gravity and dynamics of a 6-DOF humanoid arm · the paper compared with its repeat'
    return Page(
        'Torques of a humanoid arm on the moon, as in the paper', subtitle, sections
    ).html()


def verdict(found: Reproduction) -> VerdictSection:
    """Say how the errors compare with those of the paper, and what load was found."""
    lines = []
    for one in found.repeated:
        slow, whole = (one.ratio(method.held_out) for method in one.methods)
        name = f'Table {one.table.number} ({one.table.title})'
        if one.table.uniform:
            low, high = (digits(float(end)) for end in np.sort(one.table.ratio)[[0, -1]])
            lines.append(
                f'{name}: error over noise at most {digits(float(slow.max()))} with gravity '
                f'alone, {digits(float(whole.max()))} with the whole dynamics. '
                f'The paper has {low} to {high}; less is better.'
            )
            continue
        noisy = one.ratio(one.methods[0].noisy)
        paper = 100.0 * float(np.mean(one.table.ratio))
        lines += [
            f'{name}: mean torque error {digits(100.0 * float(noisy.mean()))} % of the peak; the '
            f'paper has {digits(paper)} %.',
            f'Against torques without noise it is {digits(100.0 * float(slow.mean()))} % with '
            f'gravity alone, {digits(100.0 * float(whole.mean()))} % with the whole dynamics.',
        ]
    lines.append(
        f'The {len(found.composites)} gravity parameters give a load of {_load(found)} in the '
        f'hand; {LOAD:g} kg was simulated.'
    )
    held = all(_as_wanted(one) for one in found.repeated)
    grade = ('reproduced', 'good') if held else ('in part', 'fair')
    return VerdictSection(*grade, lines)


def _as_wanted(one: Repeated) -> bool:
    ratio = one.ratio(one.methods[0].held_out)
    if one.table.uniform:
        return bool(np.max(ratio) <= _WANTED[1])
    return bool(100.0 * np.mean(ratio) <= _WANTED[0])


def _load(found: Reproduction) -> str:
    return ' ± '.join(measured(found.load, HALF_WIDTH * found.load_std)) + ' kg'
