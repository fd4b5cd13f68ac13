# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `armid bench` of a clone; for cases, methods and rules see `benchmarks.public`."""

from __future__ import annotations

import json
from pathlib import Path

import click

METHODS = click.Choice(['diagnosis', 'bic', 'parameters', 'figaroh', 'sysid'])
_answers = click.argument('answers', type=click.Path(path_type=Path))
_folder = click.argument('folder', type=click.Path(path_type=Path))
_seed = click.option('--seed', type=int, required=True, help='Random seed, which is the truth.')
_cases = click.option('--cases', type=int, default=24, help='Number of cases; by default 24.')


@click.group(epilog='Example: armid bench make cases --seed 7')
def bench() -> None:
    """Write, answer and score the cases of the public benchmark of diagnosis."""


@bench.command()
@_folder
@_seed
@_cases
def make(folder: Path, seed: int, cases: int) -> None:
    """Write a folder with the recordings of two days for each case."""
    from benchmarks import public

    public.make(folder, seed, cases)


@bench.command()
@_folder
@_answers
@click.option('--method', type=METHODS, default='diagnosis', help='By default this tool.')
def answer(folder: Path, answers: Path, method: str) -> None:
    """Diagnose all cases of a folder by one method, and write the answers as JSON."""
    from benchmarks import public

    found = {}
    for case in sorted(folder.glob('case_*')):
        try:
            found[case.name] = public.answer(case, method)
        except Exception as error:  # of any tool: the case has no answer
            click.echo(f'{case.name}: {type(error).__name__}: {error}')
        answers.write_text(json.dumps(found, indent=1) + '\n', encoding='utf-8')


@bench.command()
@_answers
@_seed
@_cases
@click.option('--keep', type=METHODS, help='Add the score to results/public.json as this method.')
def score(answers: Path, seed: int, cases: int, keep: str | None) -> None:
    """Compare answers with the truth, and print the rates."""
    from benchmarks import public
    from benchmarks.metrics import table

    found = public.judged(seed, cases, answers)
    metrics = public.scored(found)
    click.echo('\n'.join(one.line for one in found))
    click.echo(table(metrics))
    if keep:
        public.keep(keep, metrics)
