# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Measured and modelled torque of a diagnosis, with the seconds in which a cause acts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from armid_ros.diagnosis import Diagnosis
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.verdict.finding import Gap, Overlay
from armid_ros.identification.rows.signals import conditioning, SignalSettings
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.report.blocks import ContentSection, Paragraph
from armid_ros.report.charts import Chart, joined, joined_time, Series, thinned
from armid_ros.report.sections.fit import ZOOM
import numpy as np


def overlay_section(diagnosis: Diagnosis, gap: Gap, names: Mapping[str, str]) -> ContentSection:
    """
    Return measured and modelled torque, in the joint and recording where the gap was largest.

    Parameters
    ----------
    diagnosis : Diagnosis
        What was found, and the seconds in which the causes act.
    gap : Gap
        The curves.
    names : mapping of str to str
        What each recording is called.

    """
    robot, patched = diagnosis.arm.robot, bool(diagnosis.findings)
    j = int(np.argmax(gap.chi2_before))

    def size(overlay: Overlay) -> float:
        residual = (overlay.measured - overlay.before)[:, j] / overlay.sigma[j]
        return float(np.mean(residual**2))

    shown = max(gap.overlays, key=size)
    source = names.get(shown.source, shown.source) or 'the recording'
    t, measured, before, after = _of_recording(gap, shown, j)
    unit = robot.torque_units[j]
    acting = [one for one in diagnosis.spans if one.source == shown.source and not one.whole]
    marks = [(one.start, f'from {one.start:.1f} s', True) for one in acting]
    marks += [(one.stop, f'to {one.stop:.1f} s', False) for one in acting]
    kept = thinned(measured, measured - before, measured - after)
    band: FloatArray = np.full(len(kept), 2.0 * shown.sigma[j])

    def models(first: FloatArray, second: FloatArray) -> list[Series]:
        if not patched:
            return [Series('model', second[kept], 'before')]
        return [Series('before', first[kept], 'before'), Series('after', second[kept], 'after')]

    dashes = ', dashes on it are the model after' * patched
    return ContentSection(
        'Measured and modelled',
        [
            Paragraph(f'Joint {robot.joints[j]} in recording {source}: the largest error.'),
            Chart(
                t[kept],
                [Series('measured', measured[kept], 'measured'), *models(before, after)],
                '',
                f'torque [{unit}]',
                link='overlay',
                marks=marks,
            ),
            Chart(
                t[kept],
                [
                    Series('twice the floor', -band, 'floor', 'band', band),
                    *models(measured - before, measured - after),
                ],
                'time [s]',
                f'residual [{unit}]',
                height=170,
                link='overlay',
                marks=marks,
                symmetric=True,
            ),
            Paragraph(
                f'The broad line is what was measured{dashes}. {ZOOM} Where the joint turns '
                'round, friction is undetermined and nothing is judged.',
                'hint',
            ),
        ],
    )


def _of_recording(gap: Gap, shown: Overlay, joint: int) -> tuple[FloatArray, ...]:
    """Return time, measured torque and both models for all stretches of a recording."""
    here = shown.source, shown.trajectory.fold
    own = [one for one in gap.overlays if (one.source, one.trajectory.fold) == here]
    curves = zip(*((one.measured, one.before, one.after) for one in own), strict=True)
    t = joined_time([one.trajectory.t for one in own])
    return t, *(joined([part[:, joint] for part in parts]) for parts in curves)


def whole_overlays(diagnosis: Diagnosis, recordings: Sequence[Recording]) -> Gap | None:
    """
    Return the gap with curves of whole recordings if a cause acts for part of the time.

    Parameters
    ----------
    diagnosis : Diagnosis
        What was found; outside of its spans the model after is that before.
    recordings : sequence of Recording
        What was read.

    """
    gap, explanation = diagnosis.gap, diagnosis.explanation
    if gap is None or explanation is None or not diagnosis.spans:
        return gap
    firsts, overlays = {one.source: one for one in reversed(gap.overlays)}, []
    for span in diagnosis.spans:
        first, read = firsts.get(span.source), [r for r in recordings if r.source == span.source]
        if first is None or not read:
            continue
        settings = SignalSettings(cutoff_hz=first.trajectory.used.cutoff_hz)
        for part in trajectories(read, conditioning(read, settings)):
            arms = explanation.reference.arm, explanation.fitted.arm
            before, after = (part.torque - part.residual(arm) for arm in arms)
            acts = (part.t >= span.start) & (part.t <= span.stop)
            after = np.where(acts[:, np.newaxis], after, before)
            overlays.append(Overlay(span.source, part, part.torque, before, after, first.sigma))
    return replace(gap, overlays=tuple(overlays) or gap.overlays)
