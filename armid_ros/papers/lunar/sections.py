# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sections with tables, torque curves and gravity parameters of the reproduction."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.motion import FloatArray
from armid_ros.papers.lunar.reproduction import Composite, Repeated
from armid_ros.report.blocks import ContentSection, DataTable, Fold, Panels, Paragraph
from armid_ros.report.charts import Chart, Series, thinned
from armid_ros.report.notation import digits, measured
import numpy as np


def tables_section(repeated: Sequence[Repeated]) -> ContentSection:
    """Return a section with the tables of paper and reproduction, joint by joint."""
    text = (
        'Peak: as the paper prints it, and the largest gravity torque of the joint. Errors are '
        'those of held-out trajectories against the true torque; noisy: against the noisy torque '
        "of the run, as the paper may have it. Gravity: the gravity model, the paper's method. "
        'Dynamics: the full dynamics.'
    )
    folds = [
        Fold(f'Table {one.table.number}: {one.table.title}', [_table(one)], opened=True)
        for one in repeated
    ]
    return ContentSection('Tables', [Paragraph(text), *folds])


def _table(one: Repeated) -> DataTable:
    slow, whole = one.methods
    scale, error, share = 100.0, 'RMSE', 'RMSE over peak [%]'
    if one.table.uniform:
        scale, error, share = 1.0, 'MAE', 'MAE over noise'
    ratios = [
        scale * ratio
        for ratio in (
            one.table.ratio,
            one.ratio(slow.noisy),
            one.ratio(slow.held_out),
            one.ratio(whole.held_out),
        )
    ]
    peaks = {'paper': one.table.peak, 'largest': one.peak}
    errors = {'paper': one.table.error, 'gravity': slow.held_out, 'dynamics': whole.held_out}
    rows = [
        *((f'Peak, {by} [N mm]', *_cells(1e3 * x, 3), '') for by, x in peaks.items()),
        *((f'{error}, {by} [N mm]', *_cells(1e3 * x), '') for by, x in errors.items()),
        *(
            (f'{share}, {by}', *_cells(ratio), digits(float(np.mean(ratio))))
            for by, ratio in zip(('paper', 'noisy', 'gravity', 'dynamics'), ratios, strict=True)
        ),
    ]
    return DataTable(('quantity', *one.joints, 'mean'), rows)


def _cells(values: FloatArray, count: int = 2) -> list[str]:
    return [digits(float(value), count) for value in values]


def curves_section(repeated: Sequence[Repeated]) -> ContentSection:
    """Return a section with true and predicted torque along a held-out trajectory."""
    text = (
        'Gravity model, identified from the noisy run, along a held-out trajectory. Drag '
        'across a plot, or pinch it, to zoom; double-click or double-tap to see it all.'
    )
    folds = [
        Fold(
            f'Table {one.table.number}: {one.table.title}',
            [Panels([(joint, '', [_chart(one, k)]) for k, joint in enumerate(one.joints)])],
            opened=number == 0,
        )
        for number, one in enumerate(repeated)
    ]
    return ContentSection('Torque curves', [Paragraph(text, 'hint'), *folds])


def _chart(one: Repeated, joint: int) -> Chart:
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


def gravity_section(composites: Sequence[Composite], load: str) -> ContentSection:
    """
    Return a section with the minimal gravity parameters, with and without the load.

    Parameters
    ----------
    composites : sequence of Composite
        All gravity parameters.
    load : str
        Text of the estimated mass of the load.

    """
    text = (
        'Masses and first moments times the gravity of the moon, in N mm, by the gravity model; '
        "± 95 %. An arm with revolute joints has an even number of them; of the paper's table "
        'nine are legible, and all nine have this form. The two runs differ by '
        f'{load} at the hand.'
    )
    heads = ('Parameter', 'Joint', 'True', 'Identified', 'True, loaded', 'Identified, loaded')
    rows = [
        (
            one.name,
            one.joint,
            f'{one.truth:.3f}',
            ' ± '.join(measured(one.value, HALF_WIDTH * one.std)),
            f'{one.loaded_truth:.3f}',
            ' ± '.join(measured(one.loaded, HALF_WIDTH * one.loaded_std)),
        )
        for one in composites
    ]
    return ContentSection(
        'Gravity parameters', [Paragraph(text), DataTable(heads, rows, words=(0, 1))]
    )
