# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Report and JSON document of the repetition of the lunar paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from armid_ros.estimate import measured
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.motion import FloatArray
from armid_ros.papers.lunar.reproduction import Composite, LOAD, Repeated, Reproduction
from armid_ros.report.blocks import DataTable, Fold, Panels, Paragraph, VerdictSection
from armid_ros.report.charts import Chart, Series
from armid_ros.report.notation import digits
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
import numpy as np

SCHEMA = 'armid/lunar/1'


def lunar_report(found: Reproduction, provenance: Provenance) -> str:
    """
    Return the HTML page that compares the repetition with the paper.

    Parameters
    ----------
    found : Reproduction
        Tables and gravity parameters.
    provenance : Provenance
        Files, versions, settings, seed.

    """
    sections = [
        tables_section(found.repeated),
        curves_section(found.repeated),
        _gravity_section(found.composites, _load(found)),
    ]
    subtitle = 'gravity and dynamics of a 6-DOF humanoid arm · the paper compared with its repeat'
    title = 'Torques of a humanoid arm on the moon, as in the paper'
    return Page(title, subtitle, verdict(found), sections, provenance).html()


def verdict(found: Reproduction) -> VerdictSection:
    """Return the verdict box: torque errors compared with the paper, and the identified load."""
    lines, held = [], True
    for one in found.repeated:
        paper, noisy, gravity, _ = one.ratios.values()
        place = f'{one.table.title[0].upper()}{one.table.title[1:]}'
        if one.table.uniform:
            low, high = (digits(float(end)) for end in np.sort(paper)[[0, -1]])
            lines.append(
                f'{place}, the largest torque error is {digits(float(gravity.max()))} of the '
                f'torque noise; the paper has {low} to {high}.'
            )
            held &= bool(gravity.max() <= 0.15)  # of the noise
            continue
        held &= bool(gravity.mean() <= 1.0)  # % of the peak
        lines.append(
            f'{place}, the torque error is {digits(float(noisy.mean()))} % of the peak torque '
            f'with noise, and {digits(float(gravity.mean()))} % without; the paper has '
            f'{digits(float(paper.mean()))} %.'
        )
    lines.append(f'The load in the hand is {_load(found)}; {LOAD:g} kg was simulated.')
    grade = ('reproduced', 'good') if held else ('in part', 'fair')
    return VerdictSection(*grade, lines, step='Compare each row of the tables below.')


def _load(found: Reproduction) -> str:
    """Format the identified load with its 95 % interval."""
    return ' ± '.join(measured(found.load, HALF_WIDTH * found.load_std)) + ' kg'


def tables_section(repeated: Sequence[Repeated]) -> Section:
    """Return the section with the tables of the paper and of the repetition."""
    text = (
        'Peak: torque of the paper, and largest gravity torque of the joint. Errors are those of '
        'held-out trajectories against the true torque. Noisy: error against the noisy torque of '
        'the run, as the paper may define it. Gravity: model of gravity torques alone, as in the '
        'paper. Dynamics: full dynamics.'
    )
    folds = [
        Fold(f'Table {one.table.number}: {one.table.title}', [_table(one)], opened=True)
        for one in repeated
    ]
    return Section('Tables', [Paragraph(text), *folds])


def _table(one: Repeated) -> DataTable:
    """Return a table of the paper, with additional rows for the repeated results."""
    gravity, dynamics = one.methods
    error, share = 'RMSE', 'RMSE over peak [%]'
    if one.table.uniform:
        error, share = 'MAE', 'MAE over noise'
    ratios = one.ratios.values()
    peaks = {'paper': one.table.peak, 'largest': one.peak}
    errors = {'paper': one.table.error, 'gravity': gravity.held_out, 'dynamics': dynamics.held_out}
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
    """Format numbers with a given count of significant digits."""
    return [digits(float(value), count) for value in values]


def curves_section(repeated: Sequence[Repeated]) -> Section:
    """Return the section with true and predicted torque along a held-out trajectory."""
    text = (
        'Gravity model, identified from the noisy run, along a held-out trajectory. Drag '
        'across a plot, or pinch it, to zoom; double-click or double-tap to see it all.'
    )
    folds = []
    for number, one in enumerate(repeated):
        tau, panels = one.test.motion.tau, []
        assert tau is not None
        for k, joint in enumerate(one.joints):
            true, found = 1e3 * tau[:, k], 1e3 * one.test.predicted[:, k]
            chart = Chart.over_time(
                one.test.motion.t,
                [Series('true', true), Series('identified', found, 'predicted')],
                'torque [N mm]',
                height=170,
                link=f'table{one.table.number}',
            )
            panels.append((joint, '', [chart]))
        title = f'Table {one.table.number}: {one.table.title}'
        folds.append(Fold(title, [Panels(panels)], opened=number == 0))
    return Section('Torque curves', [Paragraph(text, 'hint'), *folds])


def _gravity_section(composites: Sequence[Composite], load: str) -> Section:
    text = (
        'First moments times the gravity of the moon [N mm], from gravity torques alone, with '
        '95 % intervals. Nine parameters of the paper are legible; all have this form. '
        f'The two runs give a load of {load} in the hand.'
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
    return Section('Gravity parameters', [Paragraph(text), DataTable(heads, rows, words=(0, 1))])


def lunar_document(found: Reproduction) -> dict[str, Any]:
    """
    Return the content of lunar.json.

    Parameters
    ----------
    found : Reproduction
        Tables, gravity parameters, load.

    """
    tables = []
    for one in found.repeated:
        values = {**one.ratios, 'paper_peak': one.table.peak, 'largest_torque': one.peak}
        tables.append(
            {
                'number': one.table.number,
                'title': one.table.title,
                'measure': 'mae_over_noise' if one.table.uniform else 'rmse_percent_of_peak',
                **{k: dict(zip(one.joints, x.tolist(), strict=True)) for k, x in values.items()},
                'torque_unit': 'N m',
            }
        )
    return {
        'schema': SCHEMA,
        'tables': tables,
        'composites': [{**asdict(one), 'unit': 'N mm'} for one in found.composites],
        'load': {'value': found.load, 'std': found.load_std, 'unit': 'kg'},
    }
