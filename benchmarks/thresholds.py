# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What each number that decides a name is worth: the score with it 30 % smaller and larger.

    python -m benchmarks.thresholds [--cases FIRST:LAST] [--only NAME ...] [--processes N]

"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import fields, replace
from functools import partial
import os

from armid_ros.diagnosis import DiagnosisSettings
from armid_ros.diagnosis.settings import Thresholds

from benchmarks.lived import run, select
from benchmarks.lived_scoring import LivedJudged
from benchmarks.two_days import ask

#: The development kind: locked sets are for looking, not for choosing numbers.
KIND = 'development'
#: By how much every number is changed.
CHANGES = (0.7, 1.3)


def varied(name: str, factor: float) -> DiagnosisSettings:
    """Return settings with one number changed; counts are rounded."""
    thresholds = Thresholds()
    value = getattr(thresholds, name) * factor
    value = round(value) if isinstance(getattr(thresholds, name), int) else value
    if name == 'confidence':
        value = 1.0 - (1.0 - thresholds.confidence) * factor
    return DiagnosisSettings(thresholds=replace(thresholds, **{name: value}))


def counts(judged: Sequence[LivedJudged]) -> str:
    """Return how many causes were named first, and names where nothing was, as text."""
    visible = [one for one in judged if one.truth.name and one.truth.gap >= 1.0]
    first = sum(bool(one.first) for one in visible)
    quiet = [one for one in judged if not one.truth.name]
    alarms = sum(bool(one.answer.headline) for one in quiet)
    names = sum(max(len(one.answer.headline) - bool(one.truth.name), 0) for one in judged)
    return f'{first:3d} of {len(visible)} first, {alarms} of {len(quiet)} alarms, {names} too many'


def main() -> None:
    """Print one line for each number and change."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks.thresholds')
    parser.add_argument('--cases', default='0:24', metavar='FIRST:LAST', help='some of them')
    parser.add_argument('--only', nargs='+', default=[], metavar='NAME', help='some numbers')
    parser.add_argument('--processes', type=int, default=2)
    options = parser.parse_args()
    for variable in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'):
        os.environ.setdefault(variable, '1')
    cases = select(KIND, options.cases)
    rows = [('as it is', 1.0, DiagnosisSettings())]
    for field in fields(Thresholds):
        if not options.only or field.name in options.only:
            rows += [(field.name, factor, varied(field.name, factor)) for factor in CHANGES]
    for name, factor, settings in rows:
        question = partial(ask, settings=settings)
        judged = run(KIND, cases, options.processes, again=False, question=question)
        print(f'{name:14s} {factor:4.1f}  {counts(judged)}', flush=True)


if __name__ == '__main__':
    main()
