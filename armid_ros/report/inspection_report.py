# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of an inspection."""

from __future__ import annotations

from pathlib import Path

from armid_ros.inspection import Inspection
from armid_ros.report.notation import counted
from armid_ros.report.page import Page
from armid_ros.report.provenance import Provenance
from armid_ros.report.sections.frame import Origin, VerdictSection
from armid_ros.report.sections.inspection import ContentsSection, JointTable, RecordingCurves


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
    grade, tone = ('unfit', 'bad') if bad else ('look', 'fair') if doubt else ('clean', 'good')
    sections = [
        VerdictSection(grade, tone, [found.verdict], [remark.text for remark in found.remarks]),
        ContentsSection(found),
        JointTable(found),
        RecordingCurves(found),
        Origin(provenance or Provenance()),
    ]
    name = Path(recording.source).name or 'recording'
    subtitle = ' · '.join(
        filter(None, (Path(robot).name, recording.topic, counted(recording.n_joints, 'joint')))
    )
    return Page(f'Inspection of {name}', subtitle, sections).html()
