# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Comparison of two identifications."""

from __future__ import annotations

from pathlib import Path

from armid_ros.cli import parameters
import click


@click.command(epilog='Example: armid compare monday friday --out changes')
@click.argument('before', metavar='A', type=click.Path(path_type=Path))
@click.argument('after', metavar='B', type=click.Path(path_type=Path))
@parameters.folder
@click.option('--strict', is_flag=True, help='End with code 3 if an identification is unusable.')
@parameters.as_json
def compare(before: Path, after: Path, out: Path, strict: bool, as_json: bool) -> None:
    """
    Find the changes between two identifications of one robot.

    A and B are folders that identify wrote, identification.json or model.yaml.

    """
    from armid_ros.api.comparison import compare as run
    from armid_ros.api.comparison import ComparisonResult
    from armid_ros.cli import options

    staged = options.stage(out, ComparisonResult.schema)
    result = run(before, after)
    sources = [Path(one.source) for one in (result.core.before, result.core.after)]
    options.deliver(result, staged, options.origin('', sources), as_json)
    if strict and result.core.unusable:
        click.get_current_context().exit(3)
