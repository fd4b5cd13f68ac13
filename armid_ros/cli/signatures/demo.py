# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The main job from end to end on the shipped arm, over real topics."""

from __future__ import annotations

from armid_ros.cli.signatures import options
from armid_ros.cli.signatures.late import done_by
import click


@click.command(epilog='Example: armid demo --gravity earth --out demo')
@click.option('--gravity', type=click.Choice(['moon', 'earth']), default='moon', show_default=True)
@click.option('--rate', default=200.0, show_default=True, help='Joint states per second.')
@click.option(
    '--hide',
    default='',
    metavar='E@joint',
    help='What is hidden in the arm in the end, to be found; drawn, and told last, by default.',
)
@options.folder
@options.seed
@options.as_json
@done_by('demo.command')
def demo() -> None:
    """Excite, move, identify online and offline; then find what was hidden in the arm."""
