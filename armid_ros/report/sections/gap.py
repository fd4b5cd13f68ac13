# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The gap of every joint: without what was named, with it, and the floor."""

from __future__ import annotations

from collections.abc import Mapping

from armid_ros.diagnosis.verdict.finding import Gap, Overlay
from armid_ros.motion import FloatArray
from armid_ros.report.bars import Bar, BarChart
from armid_ros.report.blocks import ContentSection, Paragraph
from armid_ros.report.charts import Chart, Role, Series, thinned
from armid_ros.report.notation import digits
from armid_ros.report.sections.fit import ZOOM
from armid_ros.robots import Robot
import numpy as np


def gap_section(
    robot: Robot, gap: Gap, floor: str, patched: bool, harmful: bool = False
) -> ContentSection:
    """
    Return the errors of each joint before and after, in units of its noise floor.

    Parameters
    ----------
    robot : Robot
        Gives joints and units.
    gap : Gap
        The numbers.
    floor : str
        What the floor is, in words.
    patched : bool
        Whether anything was added to the model.
    harmful : bool
        Whether it was not kept, as it makes the model worse in some joint.

    """
    roles: list[tuple[Role, str, FloatArray]] = [
        ('before', 'before', gap.before),
        ('after', 'after', gap.after),
        ('floor', 'floor', gap.floor),
    ]
    if not patched:
        roles = [('before', 'error', gap.after), roles[-1]]
    rows = []
    for joint, name in enumerate(robot.joints):
        if not any(errors[joint] for _, _, errors in roles):  # at rest: no row counts
            rows.append((name, [Bar(0.0, 'floor', 'not judged')]))
            continue
        unit, least = robot.torque_units[joint], max(float(gap.floor[joint]), 1e-12)
        bars = [
            Bar(float(errors[joint]) / least, role, f'{digits(float(errors[joint]))} {unit}')
            for role, _, errors in roles
        ]
        rows.append((name, bars))
    where = 'recordings that were not used' if gap.predicted else gap.data
    kept = ' "After" includes the named effect, which model.yaml does not have.' * harmful
    return ContentSection(
        'Gap',
        [
            Paragraph(
                f'Root mean square error of each joint on {where}. Each bar is in units of the '
                f"joint's floor. The floor is {floor}.{kept}"
            ),
            BarChart(rows, [(role, label) for role, label, _ in roles]),
        ],
    )


def overlay_section(
    robot: Robot, gap: Gap, patched: bool, names: Mapping[str, str]
) -> ContentSection:
    """
    Return measured and modelled torque, in the joint and recording where the gap was largest.

    Parameters
    ----------
    robot : Robot
        Gives joints and units.
    gap : Gap
        The curves.
    patched : bool
        Whether anything was added to the model.
    names : mapping of str to str
        What each recording is called.

    """
    j = int(np.argmax(gap.chi2_before))

    def size(overlay: Overlay) -> float:
        residual = (overlay.measured - overlay.before)[:, j] / overlay.sigma[j]
        return float(np.mean(residual**2))

    shown = max(gap.overlays, key=size)
    source = names.get(shown.source, shown.source) or 'the recording'
    counted = np.flatnonzero(shown.trajectory.informative[:, j])
    moving = slice(counted[0], counted[-1] + 1) if len(counted) else slice(None)
    measured, before, after = (x[moving, j] for x in (shown.measured, shown.before, shown.after))
    t, unit = shown.trajectory.t[moving], robot.torque_units[j]
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
            Paragraph(
                f'{robot.joints[j]} in {source}, where the error is largest over the floor. The '
                f'broad line is what was measured{dashes}. {ZOOM} Where the joint turns round, '
                'friction is undetermined and nothing is judged.'
            ),
            Chart(
                t[kept],
                [Series('measured', measured[kept], 'measured'), *models(before, after)],
                '',
                f'torque [{unit}]',
                link='overlay',
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
                symmetric=True,
            ),
        ],
    )
