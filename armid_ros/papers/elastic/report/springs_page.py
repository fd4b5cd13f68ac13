# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of springs of any arm, found joint by joint."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.papers.elastic.identification.joints import SpringEstimate
from armid_ros.papers.elastic.report.springs import Springs
from armid_ros.report.notation import counted
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
from armid_ros.report.sections.frame import Origin, VerdictSection


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
