# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Rates of the diagnosis for arms that changed between two days.

A model is identified on day 1. The diagnosis gets the recordings of day 2, with day 1 as
baseline. It then gets those of day 1 itself, in which nothing may be named. For the cases see
tests/hidden/lived/README.md.

    python -m benchmarks.lived [KIND] [--cases FIRST:LAST] [--only CAUSE ...] [--no-again]
        [--model-alone] [--out FILE] [--probabilities FILE] [--processes N]

"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
import traceback

from armid_ros.api.identification import identify

from benchmarks.lived_scoring import LivedJudged, probabilities, score
from benchmarks.looks import judge_all, write_json
from benchmarks.two_days import Answer, ask, identification_of, known_arm
from tests.hidden.lived.cases import lived_case
from tests.hidden.lived.specification import COUNTS, KINDS, specify


def judge(
    kind: str, index: int, *, again: bool = True, model_alone: bool = False
) -> LivedJudged | None:
    """
    Create a case, diagnose it, and return truth and answer; None if no case can be created.

    An exception is an answer. With `model_alone`, the diagnosis gets no recordings of day 1.

    """
    try:
        case = lived_case(kind, index)
    except RuntimeError as error:
        print(f'{kind}/{index} left out: {error}', flush=True)
        return None
    day_1, day_2 = ([run.recording for run in day] for day in (case.day_1, case.day_2))
    runs = [*case.day_2, case.held_out] if case.truth else []
    repeated, misfit = None, None
    try:
        if model_alone:
            found = identify(case.robot, day_1)
            arm, misfit, day_1 = found.arm, found.misfit, []
        elif day_1:
            arm = identification_of(case.robot, day_1).arm
        else:
            arm = known_arm(case.robot, case.known)
        answer = ask(
            arm,
            day_2,
            validate=[case.held_out.recording],
            baseline=day_1,
            misfit=misfit,
            contributions=[run.contribution for run in runs],
        )
        if day_1 and again:
            repeated = ask(arm, day_1[:2], validate=day_1[2:], baseline=day_1)
    except Exception:
        answer = Answer(verdict='failed', error=traceback.format_exc(limit=-3))
    return LivedJudged.of(case, answer, repeated)


def main() -> None:
    """Diagnose the cases of a kind, print the table and write the requested files."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks.lived')
    parser.add_argument('kind', nargs='?', default='development', choices=KINDS)
    parser.add_argument('--cases', default=':', metavar='FIRST:LAST', help='some of them')
    parser.add_argument('--only', nargs='+', default=[], metavar='CAUSE', help='of some causes')
    parser.add_argument('--no-again', action='store_true', help='do not ask about day 1')
    parser.add_argument('--model-alone', action='store_true', help='give no recordings of day 1')
    parser.add_argument('--out', type=Path, help='file for all answers, as JSON')
    parser.add_argument('--probabilities', type=Path, help='file for those of names, as JSON')
    parser.add_argument('--processes', type=int, default=2)
    options = parser.parse_args()
    first, _, last = options.cases.partition(':')
    question = options.kind.removeprefix(options.kind.partition('/')[0])
    cases = [
        k
        for k in range(int(first or 0), int(last or COUNTS[question]))
        if not options.only or specify(options.kind, k).cause in options.only
    ]
    what = f'lived, {options.kind}, {len(cases)} cases'
    what += f', only {" ".join(options.only)}' if options.only else ''
    what += ', model alone' if options.model_alone else ''
    judged = judge_all(
        partial(
            judge,
            options.kind,
            again=not options.no_again,
            model_alone=options.model_alone,
        ),
        cases,
        what,
        partial(score, kind=options.kind),
        processes=options.processes,
        out=options.out,
    )
    if options.probabilities:
        write_json(options.probabilities, probabilities(judged))


if __name__ == '__main__':
    main()
