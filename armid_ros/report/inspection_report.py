# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The pages of an inspection and of a check of a description, and its finding in words."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.inspection import Inspection, LinkCheck, Remark
from armid_ros.motion import FloatArray
from armid_ros.report.blocks import ContentSection, DataTable, Paragraph
from armid_ros.report.notation import counted, digits, measured, robot_label
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
from armid_ros.report.sections.frame import Origin, VerdictSection
from armid_ros.report.sections.inspection import (
    contents_section,
    curves_section,
    joints_section,
)
import numpy as np

#: Links that explain less than this share of the difference are not named as the cause.
_MOSTLY = 0.9
HEADS = (
    'link',
    'mass, URDF [kg]',
    'measured [kg]',
    'centre, URDF [m]',
    'measured [m]',
    'explains',
)


def inspection_report(
    found: Inspection, *, robot: str = '', provenance: Provenance | None = None
) -> str:
    """
    Return the page of an inspection, with all curves.

    Parameters
    ----------
    found : Inspection
        What was found.
    robot : str
        Name or path of the description.
    provenance : Provenance, optional
        Files, versions.

    Returns
    -------
    str
        One HTML file that loads nothing.

    """
    recording = found.recording
    bad = any(remark.weight == 'bad' for remark in found.remarks)
    doubt = any(remark.weight == 'doubt' for remark in found.remarks)
    grade, tone = ('unfit', 'bad') if bad else ('doubtful', 'fair') if doubt else ('ready', 'good')
    first = 2 if bad or doubt else 1
    texts = [remark.text for remark in found.remarks]
    texts.insert(first - 1, found.verdict)  # below the worst remark
    sentences = [text[0].upper() + text[1:].replace('`', '').rstrip('.') + '.' for text in texts]
    sections: list[Section] = [
        VerdictSection(grade, tone, sentences[:first], sentences[first:]),
        contents_section(found),
        joints_section(found),
        curves_section(found),
        Origin(provenance or Provenance()),
    ]
    name = Path(recording.source).name or 'recording'
    subtitle = ' · '.join(
        filter(None, (Path(robot).name, recording.topic, counted(recording.n_joints, 'joint')))
    )
    return Page(f'Inspection of {name}', subtitle, sections).html()


def headline(remarks: Sequence[Remark], found: LinkCheck | None) -> tuple[str, ...]:
    """Return the finding in one sentence, and the numbers behind it in others."""
    bad = sum(one.weight == 'bad' for one in remarks)
    values = 'No impossible value in the description.'
    if bad:
        values = f'Impossible in the description: {counted(bad, "value")}.'
    if found is None:
        return values, 'Add a recording to check the masses.'
    errors = (
        f'Torque error: {digits(found.error_percent)} % with the links of the URDF, '
        f'{digits(found.fitted_error_percent)} % with fitted links.'
    )
    if found.fault:
        first = f'The recording cannot check the links: {found.fault.rstrip(".")}.'
    elif found.agrees:
        first = 'The links of the URDF agree with the recording.'
    elif found.explained < _MOSTLY:
        first = 'The URDF differs from the recording in more than three links.'
    else:
        known = [text for k in found.wrong if (text := _wrong_mass(found, k))]
        others = [found.joints[k] for k in found.wrong if not _wrong_mass(found, k)]
        if others:
            known.append(f'has a wrong mass distribution at {" and ".join(others)}')
        rivals = ''.join(f' or {found.joints[k]}' for k in found.rivals)
        first = f'The URDF {" and ".join(known)}{rivals}, if the other links are right.'
    return first, errors, values


def _wrong_mass(found: LinkCheck, k: int) -> str:
    """Return by how much the mass of a link is wrong; empty where that is not determined."""
    change, reach = found.measured_mass[k] - found.mass[k], HALF_WIDTH * found.mass_std[k]
    if not abs(change) > reach:
        return ''
    size, interval = measured(abs(float(change)), float(reach))
    word = 'light' if change > 0.0 else 'heavy'
    return f'is {size} ± {interval} kg too {word} at {found.joints[k]}'


def link_rows(found: LinkCheck) -> list[tuple[str, ...]]:
    """Return a row for every link, as `HEADS` has the columns."""
    return [
        (
            f'{link} ({found.joints[k]})',
            f'{found.mass[k]:.4g}',
            _interval(found.measured_mass[k : k + 1], found.mass_std[k : k + 1]),
            '-'
            if np.isnan(found.centre[k, 0])
            else ', '.join(f'{x:.3f}' for x in found.centre[k]),
            _interval(found.measured_centre[k], found.centre_std[k]),
            '-' if found.agrees else f'{100.0 * max(0.0, found.explains[k]):.0f} %',
        )
        for k, link in enumerate(found.links)
    ]


def _interval(values: FloatArray, std: FloatArray) -> str:
    if np.isnan(values).any():
        return '-'
    reach = float(HALF_WIDTH * std.max())
    return f'{", ".join(measured(float(v), reach)[0] for v in values)} ± {measured(0.0, reach)[1]}'


def description_check_report(
    robot: str,
    remarks: Sequence[Remark],
    links: LinkCheck | None,
    provenance: Provenance | None = None,
) -> str:
    """Return the page of a check, one HTML file that loads nothing."""
    first, *others = headline(remarks, links)
    wrong = any(one.weight == 'bad' for one in remarks) or (links is not None and links.wrong)
    doubt = any(one.weight == 'doubt' for one in remarks)
    grade, tone = ('wrong', 'bad') if wrong else ('look', 'fair') if doubt else ('clean', 'good')
    sections: list[Section] = [
        VerdictSection(grade, tone, [first, ' '.join(others)], [one.text for one in remarks])
    ]
    if links is not None:
        said = (
            'Centres are in the frame of the joint that moves the link. Intervals are 95 %. A '
            'dash: as described, or not determined by this motion. Explains: share of the '
            'difference between URDF and recording that this link explains if others are right.'
        )
        table = DataTable(HEADS, link_rows(links), kind='tight')
        sections.append(ContentSection('Links', [table, Paragraph(said, 'hint')]))
    sections.append(Origin(provenance or Provenance()))
    return Page(f'Check of {robot_label(robot)}', '', sections, charts=False).html()
