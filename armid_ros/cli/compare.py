# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What changed between two identifications."""

from __future__ import annotations

from pathlib import Path

from armid_ros.cli import options
from armid_ros.cli.origin import provenance
from armid_ros.cli.terminal import say
from armid_ros.files import json_text, write_file
from armid_ros.identification.assess.comparison import compare as run
from armid_ros.identification.assess.comparison import SCHEMA
from armid_ros.identification.parameters_file import read_parameters
from armid_ros.report.compare_report import compare_report, tell
import click


def compare(before: Path, after: Path, out: Path, strict: bool, as_json: bool) -> None:
    """Say what changed between two identifications of one robot."""
    staged = options.stage(out, SCHEMA)
    first, second = read_parameters(before), read_parameters(after)
    comparison = run(first, second)
    files = [Path(first.source), Path(second.source)]
    page = compare_report(comparison, provenance(files))
    document = comparison.document()
    write_file(staged.folder / 'report.html', page)
    write_file(staged.folder / 'comparison.json', json_text(document, indent=1))
    staged.keep()
    if as_json:
        click.echo(json_text(document))
    else:
        for sentence in tell(comparison):
            say(sentence)
        say(f'{out}: report.html, comparison.json')
    if strict and comparison.unusable:
        click.get_current_context().exit(3)
