# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What each rule of the diagnosis earns: the score as it is, and without the rule.

    python -m benchmarks.ablation [KIND] [--cases FIRST:LAST] [--only RULE ...] [--processes N]

KIND is a development set of benchmarks.lived.

"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, ExitStack
from dataclasses import dataclass
from functools import partial
import os
from pkgutil import resolve_name
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.lived import run, select
from benchmarks.lived_scoring import LivedJudged, VISIBLE
from benchmarks.two_days import Answer, ask
from tests.hidden.lived.specification import KINDS


@dataclass(frozen=True)
class Rule:
    """
    A rule of the diagnosis: one function.

    Attributes
    ----------
    places : tuple of str
        Where it is looked up when it is asked, below armid_ros.diagnosis.
    without : callable
        What answers in its place if there is no such rule.

    """

    places: tuple[str, ...]
    without: Callable[..., Any]

    @contextmanager
    def left_out(self) -> Iterator[None]:
        """Diagnose without the rule."""
        with ExitStack() as stack:
            for place in self.places:
                owner, _, name = f'armid_ros.diagnosis.{place}'.rpartition('.')
                stack.enter_context(patch.object(resolve_name(owner), name, self.without))
            yield


def no(*_: object) -> bool:
    """Say no to whatever is asked."""
    return False


def yes(*_: object) -> bool:
    """Say yes to whatever is asked."""
    return True


def first(tied: Sequence[Any], *_: object) -> Any:
    """Take the one that takes most."""
    return tied[0]


def as_fitted(fitted: Any, *_: object) -> Any:
    """Return what was fitted, deviations included."""
    return fitted


def as_they_are(trials: Sequence[Any], *_: object) -> list[Any]:
    """Return causes as they were tried beside the others."""
    return list(trials)


def nowhere(here: Any) -> np.ndarray:
    """Return squares of an open gap in no joint."""
    return np.full(here.problem.y.shape[1], np.inf)


def all_names(retrial: Any, taken: Sequence[Any], change: Any = None) -> Any:
    """Fit all names together and drop none."""
    return tuple(one.step for one in taken), retrial.fitted(taken, change)


#: By what each rule does.
RULES = {
    'names that may be nothing go': Rule(('verdict.attribution.may_be_nothing',), no),
    'small names that close a gap stay': Rule(('verdict.attribution._opens',), no),
    'names that other data deny go': Rule(('verdict.attribution.denies',), no),
    'needless names go': Rule(('search.explain.pruned',), all_names),
    'the simplest that closes the gap': Rule(('search.look.likeliest',), first),
    'what contains a cause is no rival': Rule(('search.look.says_no_more',), no),
    'compared beside what each was': Rule(('search.look._compared',), as_they_are),
    'most of one joint matters': Rule(('search.look._open_squares',), nowhere),
    'small changes do not matter': Rule(('search.look.material',), yes),
    'the body stays as given': Rule(('search.choice._as_good',), no),
    'deviations from part to part': Rule(
        ('search.explain.widened', 'search.explanation.widened'), as_fitted
    ),
}


def asked_without(rule: str, *arguments: Any, **options: Any) -> Answer:
    """Ask the diagnosis without a rule; see two_days.ask."""
    with RULES[rule].left_out():
        return ask(*arguments, **options)


def counts(judged: Sequence[LivedJudged]) -> str:
    """Return how often names are right, as text; causes below the misfit count apart."""
    there = [one for one in judged if one.truth.name]
    seen = [one for one in there if one.truth.gap >= VISIBLE]
    faint = [one for one in there if one.truth.gap < VISIBLE]
    quiet = [one for one in judged if not one.truth.name]
    errors = [error for one in there for error in one.parameter_errors()]
    return (
        f'{sum(one.first for one in seen):3d} of {len(seen)} first, '
        f'{sum(one.tied and not one.first for one in seen)} tied; '
        f'faint {sum(one.first for one in faint)} of {len(faint)} first; '
        f'{sum(bool(one.answer.headline) for one in quiet)} of {len(quiet)} alarms; '
        f'{sum(one.too_many for one in there)} too many; '
        f'{sum(holds for _, holds in errors)} of {len(errors)} intervals hold'
    )


def main() -> None:
    """Print one line for the diagnosis as it is, and one without each rule."""
    kinds = [kind for kind in KINDS if not kind.startswith('locked')]
    parser = argparse.ArgumentParser(prog='python -m benchmarks.ablation')
    parser.add_argument('kind', nargs='?', default=kinds[0], choices=kinds)
    parser.add_argument('--cases', default='0:24', metavar='FIRST:LAST', help='some of them')
    parser.add_argument('--only', nargs='+', default=list(RULES), metavar='RULE', choices=RULES)
    parser.add_argument('--processes', type=int, default=2)
    options = parser.parse_args()
    for variable in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'):
        os.environ.setdefault(variable, '1')
    cases = select(options.kind, options.cases)
    questions = {'as it is': ask, **{rule: partial(asked_without, rule) for rule in options.only}}
    for name, question in questions.items():
        judged = run(options.kind, cases, options.processes, again=False, question=question)
        print(f'{name:34s} {counts(judged)}', flush=True)


if __name__ == '__main__':
    main()
