# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `armid lunar`: repeat the experiments of the paper on the lunar arm."""

from __future__ import annotations

from pathlib import Path
from statistics import fmean

from armid_ros.cli import parameters
import click

#: Columns of the tables in the terminal, with the keys of the document.
_HEADS = {
    'paper': 'paper',
    'against noise': 'against_noise',
    'gravity': 'weight_alone',
    'dynamics': 'whole_dynamics',
}


@click.command(epilog='Example: armid lunar --out result')
@parameters.folder
@parameters.every
@parameters.seed
@parameters.as_json
def lunar(out: Path, seed: int, every: bool, as_json: bool) -> None:
    """Repeat a published identification of a humanoid arm on the moon, and compare the errors."""
    from armid_ros.cli import options
    from armid_ros.cli.options import provenance
    from armid_ros.cli.terminal import progress
    from armid_ros.papers.lunar.report import lunar_document, lunar_report, SCHEMA, verdict
    from armid_ros.papers.lunar.reproduction import reproduce

    staged = options.stage(out, SCHEMA)
    with progress('designing the trajectory') as tick:
        found = reproduce(seed=seed, progress=tick)
    document = lunar_document(found)
    page = lunar_report(found, provenance([], {'robot': 'humanoid_arm'}, seed))
    rows = []
    for table in document['tables']:
        unit = 'of noise' if table['measure'] == 'mae_over_noise' else '% of peak'
        names = list(table['paper']) if every else ['mean']
        for joint in names:
            values = (table[key].get(joint, fmean(table[key].values())) for key in _HEADS.values())
            rows.append((f'{table["number"]}', joint, *(f'{value:.3g}' for value in values), unit))
    heads = ('table', 'joint', *_HEADS, 'unit')
    table_shown = None if as_json else (heads, rows)
    options.deliver_page(staged, page, 'lunar', document, verdict(found), table_shown)
