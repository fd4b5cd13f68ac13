# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Rates of the diagnosis for arms that changed between two days.

A model is identified on day 1. The diagnosis gets the recordings of day 2, with day 1 as baseline,
and then those of day 1 itself, where nothing may be named. For the cases see
tests/hidden/lived/README.md.

    python -m benchmarks.lived [KIND] [--cases FIRST:LAST] [--only CAUSE ...] [--no-again]
        [--each N] [--out FILE] [--processes N]

"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import asdict, replace
from functools import partial
import json
import multiprocessing
import os
from pathlib import Path
import traceback

from armid_ros.arm import ArmModel
from armid_ros.identification import Identification
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np

from benchmarks.lived_questions import score_of_question
from benchmarks.lived_scoring import breakdown, LivedJudged, LivedTruth, probabilities, score
from benchmarks.looks import look, results_of
from benchmarks.metrics import table
from benchmarks.two_days import Answer, ask, identification_of, known_arm
from tests.hidden.lived.adapter import recording_of, robot_of
from tests.hidden.lived.cases import lived_case
from tests.hidden.lived.specification import COUNTS, KINDS, specify

#: Function that diagnoses recordings, as two_days.ask, the default.
Ask = Callable[..., Answer]


def judge(kind: str, index: int, again: bool = True, question: Ask = ask) -> LivedJudged | None:
    """Make a case and diagnose it; an exception is an answer; None if it cannot be made."""
    try:
        case = lived_case(kind, index)
    except RuntimeError as error:
        print(f'{kind}/{index} left out: {error}', flush=True)
        return None
    day_1, day_2 = ([recording_of(run) for run in day] for day in (case.day_1, case.day_2))
    held_out = recording_of(case.held_out)
    described = robot_of(case).gravity
    runs = [*case.day_2, case.held_out] if case.truth else []
    made = [run.contribution for run in runs]
    shares = (np.nan, np.nan)
    repeated = None
    try:
        if day_1:
            found = identification_of(robot_of(case), day_1)
            arm, shares = found.arm, true_shares(found, held_out, case.held_out.contribution)
        else:
            arm = known_arm(robot_of(case), case.known)
        answer = question(
            arm,
            day_2,
            validate=[held_out],
            baseline=day_1,
            contributions=made,
        )
        if day_1 and again:
            repeated = question(arm, day_1[:2], validate=day_1[2:], baseline=day_1)
    except Exception:
        answer = Answer(verdict='failed', error=traceback.format_exc(limit=-3))
    return LivedJudged(LivedTruth.of(case, shares, described), answer, repeated)


def ask_few(
    each: int,
    arm: ArmModel,
    recordings: Sequence[Recording],
    *,
    validate: Sequence[Recording],
    baseline: Sequence[Recording],
    **others: object,
) -> Answer:
    """Diagnose with a number of recordings of each day, none of which is held out."""
    return ask(arm, [*recordings, *validate][:each], baseline=baseline[:each])


def true_shares(
    found: Identification, held_out: Recording, contribution: FloatArray
) -> tuple[float, float]:
    """
    Return the true share of a cause in the squared residual of a model.

    Squares of each joint are divided by those on the day of the identification.

    Parameters
    ----------
    found : Identification
        The model.
    held_out : Recording
        Recording with the cause.
    contribution : ndarray, shape (N, n)
        Torque of the cause [N m].

    Returns
    -------
    of_power, of_excess : float
        Share of the squared residual, and of its excess over the day of the identification.

    """
    if not np.any(contribution):
        return np.nan, np.nan
    without = replace(held_out, tau=held_out.tau - contribution)
    floor = _power(found.training)
    before, after = (_power(found.predict([one])) for one in (held_out, without))
    there, rest = np.sum(before / floor), np.sum(after / floor)
    return float(1.0 - rest / there), float((there - rest) / max(there - len(floor), 1e-9))


def run(
    kind: str,
    cases: Sequence[int],
    processes: int = 2,
    again: bool = True,
    question: Ask = ask,
) -> list[LivedJudged]:
    """Judge cases in several processes, with a line of progress each."""
    judged = []
    context = multiprocessing.get_context('spawn')
    count = len(cases)
    with ProcessPoolExecutor(processes, mp_context=context) as pool:
        jobs = pool.map(judge, [kind] * count, cases, [again] * count, [question] * count)
        for one in filter(None, jobs):
            judged.append(one)
            print(_line(one), flush=True)
    return judged


def main() -> None:
    """Run a kind of cases, print the table and write the requested files."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks.lived')
    parser.add_argument('kind', nargs='?', default='development', choices=KINDS)
    parser.add_argument('--cases', default=':', metavar='FIRST:LAST', help='some of them')
    parser.add_argument('--only', nargs='+', default=[], metavar='CAUSE', help='of some causes')
    parser.add_argument('--no-again', action='store_true', help='do not ask about day 1')
    parser.add_argument('--each', type=int, help='ask with so many recordings of each day')
    parser.add_argument('--out', type=Path, help='file for all answers, as JSON')
    parser.add_argument('--probabilities', type=Path, help='file for those of names, as JSON')
    parser.add_argument('--processes', type=int, default=2)
    options = parser.parse_args()
    for variable in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'):
        os.environ.setdefault(variable, '1')  # the processes share the cores as it is
    cases = select(options.kind, options.cases, options.only)
    what = f'lived, {options.kind}, {len(cases)} cases'
    what += f', only {" ".join(options.only)}' if options.only else ''
    what += f', {options.each} recordings a day' if options.each else ''
    question: Ask = partial(ask_few, options.each) if options.each else ask
    with ExitStack() as stack:
        locked = options.kind.startswith('locked')
        record = stack.enter_context(look(what)) if locked else None
        judged = run(options.kind, cases, options.processes, not options.no_again, question)
        metrics = (*score(judged), *score_of_question(options.kind, judged))
        print(f'\n{what}\n{table(metrics)}')
        if not locked:
            print(breakdown(judged))
        if record is not None:
            record['results'] = results_of(metrics)
    if options.probabilities:
        pairs = json.dumps(probabilities(judged), default=_plain)
        options.probabilities.write_text(f'{pairs}\n', encoding='utf-8')
    if options.out:
        answers = [asdict(one) for one in judged]
        options.out.write_text(json.dumps(answers, indent=1, default=_plain), encoding='utf-8')


def select(kind: str, cases: str = ':', only: Sequence[str] = ()) -> list[int]:
    """Return the numbers of the cases in a range such as '0:24' that have some causes."""
    first, _, last = cases.partition(':')
    question = kind.removeprefix(kind.partition('/')[0])
    numbers = range(int(first or 0), int(last or COUNTS[question]))
    return [k for k in numbers if not only or specify(kind, k).cause in only]


def _power(fits: Sequence) -> FloatArray:
    """Return the mean square residual of each joint over its informative rows."""
    used = np.concatenate([fit.informative for fit in fits])
    residual = np.concatenate([fit.residual for fit in fits])
    return np.sum(residual**2, axis=0, where=used) / np.maximum(used.sum(axis=0), 1)


def _line(one: LivedJudged) -> str:
    truth, answer = one.truth, one.answer
    mark = 'first' if one.first else 'tied' if one.tied else 'there' if one.anywhere else '-'
    if not truth.name:
        mark = '-' if answer.headline else 'silent'
    elif not truth.in_catalogue and truth.name != 'gravity':
        mark = 'admitted' if one.admitted else '-'
    where = f'@{",".join(truth.joints)}' if truth.joints else ''
    names = '; '.join(map(str, answer.headline)) or 'nothing'
    again = '' if one.again is None else f' | again: {"; ".join(map(str, one.again.headline))}'
    return (
        f'{truth.key} {truth.arm} {truth.style} {truth.size} gap {truth.gap:.2g} '
        f'share {truth.share_of_power:.2f} {truth.share_of_excess:.2f}: '
        f'{truth.name or "nothing"}{where} -> {mark}: {answer.verdict} {names}{again} '
        f'[{answer.seconds:.1f} s] {answer.error.strip().rpartition(chr(10))[2]}'.rstrip()
    )


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f'{type(value).__name__} is no JSON')


if __name__ == '__main__':
    main()
