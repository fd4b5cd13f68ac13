# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The diagnosis beside the plain ranking, on every kind of data: it has to be right as often.

Both are asked about the same arms that have lived, about exact and otherwise mounted arms, pairs
of motions, and a slice of the laboratory. Right is the cause first (the gravity of an arm whose
friction nobody knows, anywhere), silence where nothing happened, and an admission where no
catalogue has the cause. The plain ranking knows no ties: a cause that the diagnosis states in a
tie of three with the first counts in a column of its own. The command fails where the plain
ranking is right more often than that in any row, and says in which cases.

    python -m benchmarks.against_plain [KIND ...] [--cases FIRST:LAST] [--answers FOLDER]
        [--processes N]

Answers of a kind are read from FOLDER where it has them, and kept there.

"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
import json
import os
from pathlib import Path
import sys

from armid_ros.effects import CATALOGUE
import numpy as np

from benchmarks.hidden_effects import nominal_arm
from benchmarks.hidden_effects import run as run_laboratory
from benchmarks.hidden_effects import select as of_laboratory
from benchmarks.lived import run, select
from benchmarks.lived_scoring import LivedJudged, LivedTruth, nameable, silent, VISIBLE
from benchmarks.plain_ranking import plain_ranking
from benchmarks.two_days import Answer, ask, Named
from tests.hidden.cases import make_case
from tests.hidden.lived.specification import specify
from tests.hidden.scoring import Finding, Judged, Outcome, Truth
from tests.hidden.specification import CaseSpec

LABORATORY = 'laboratory'
#: What is asked where nothing else is said; a kind and how many of its cases.
KINDS = {
    'development': ':64',
    'development/exact': ':12',
    'development/mounting': ':',
    'development/pairs': ':',
    LABORATORY: ':',
}

#: Families of causes, by the name of the truth.
FAMILIES = {
    'bodies': ('payload', 'link_inertia', 'rotor_inertia'),
    'gravity': ('gravity', 'base_tilt', 'gravity_magnitude'),
    'sensors and drives': (
        *('torque_gain', 'torque_offset', 'torque_drift', 'encoder_offset', 'time_delay'),
        *('torque_lag', 'torque_ripple', 'torque_crosstalk', 'actuator_saturation'),
    ),
    'springs and contact': (
        *('joint_spring', 'joint_elasticity', 'human_interaction', 'interface_slack'),
        'soft_limit',
    ),
}

#: How motions are called where they are not periodic.
_MOTIONS = {'sines': 'natural', 'wandering': 'natural', 'dwells': 'point to point'}


@dataclass(frozen=True)
class Row:
    """
    One case as both judge it.

    Attributes
    ----------
    groups : tuple of str
        What the case counts for: kind, motion, model and family of the cause.
    key : str
        The case.
    found, tied, plain : bool
        Whether the diagnosis is right, first or in the tie that it states, and the plain ranking.

    """

    groups: tuple[str, ...]
    key: str
    found: bool
    tied: bool
    plain: bool


def lived_rows(found: Sequence[LivedJudged], plain: Sequence[LivedJudged]) -> list[Row]:
    """Return the cases of a kind that both were asked about and that can be judged."""
    asked = {one.truth.key: one for one in plain}
    return [
        Row(
            _groups(one.truth),
            one.truth.key,
            right(one),
            right(one) or (nameable(one.truth) and one.tied),
            right(asked[one.truth.key]),
        )
        for one in found
        if one.truth.key in asked and (not one.truth.name or one.truth.gap >= VISIBLE)
    ]


def right(judged: LivedJudged) -> bool:
    """Return whether an answer is right."""
    if not judged.truth.name:
        return silent(judged.answer)
    if not nameable(judged.truth):
        return judged.admitted
    mounting = judged.truth.key.partition('/')[2].startswith('mounting')
    return judged.anywhere if mounting else judged.first


def laboratory_rows(found: Sequence[Judged], plain: Sequence[Judged]) -> list[Row]:
    """Return the cases of the laboratory, but for names taken out: the rival has no library."""
    asked = {one.truth.key: one for one in plain}
    rows = []
    for one in found:
        truth = one.truth
        if truth.kind == 'removed' or (truth.names and not truth.visible):
            continue
        family = family_of(truth.names[0] if truth.names else '')
        model = 'exact bodies' if truth.exact else 'bodies that are off'
        groups = (LABORATORY, 'motion: periodic', f'model: {model}', family)
        first = _right_in_laboratory(one)
        tied = truth.kind in ('single', 'pair') and one.found is not None
        rival = _right_in_laboratory(asked[truth.key])
        rows.append(Row(groups, truth.key, first, first or tied, rival))
    return rows


def family_of(name: str, in_catalogue: bool = True) -> str:
    """Return the family of a cause."""
    if not name:
        return 'cause: nothing'
    if not in_catalogue or (name != 'gravity' and name not in CATALOGUE):
        return 'cause: outside the catalogue'
    family = next((word for word, names in FAMILIES.items() if name in names), 'friction')
    return f'cause: {family}'


#: How often the diagnosis is right, with ties, the plain ranking, and of how many cases.
Counts = tuple[int, int, int, int]


def counts(rows: Iterable[Row]) -> dict[str, Counts]:
    """Return how often both are right in each group."""
    found: dict[str, Counts] = {}
    for row in rows:
        for group in (*row.groups, 'all'):
            first, tied, plain, total = found.get(group, (0, 0, 0, 0))
            found[group] = first + row.found, tied + row.tied, plain + row.plain, total + 1
    return found


def table(found: dict[str, Counts]) -> str:
    """Return both side by side."""
    lines = [f'{"":34s} {"diagnosis":>10s} {"or in tie":>10s} {"plain":>10s}  cases']
    for group, (*own, total) in found.items():
        beaten = '' if own[1] >= own[2] else '  NOT beaten'
        shares = ' '.join(f'{count / total:10.2f}' for count in own)
        lines.append(f'{group:34s} {shares}  {total:5d}{beaten}')
    return '\n'.join(lines)


def main() -> int:
    """Ask both, print the table, and fail where the plain ranking is right more often."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks.against_plain')
    parser.add_argument('kinds', nargs='*', default=[], metavar='KIND', help=', '.join(KINDS))
    parser.add_argument('--cases', default='', metavar='FIRST:LAST', help='some of each kind')
    parser.add_argument('--answers', type=Path, help='folder in which answers are kept')
    parser.add_argument('--processes', type=int, default=2)
    options = parser.parse_args()
    unknown = [kind for kind in options.kinds if kind not in KINDS]
    if unknown:
        parser.error(f'no kind {unknown[0]!r}; there are {", ".join(KINDS)}')
    for variable in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'):
        os.environ.setdefault(variable, '1')
    rows: list[Row] = []
    for kind in options.kinds or KINDS:
        rows += _rows(kind, options.cases or KINDS[kind], options.processes, options.answers)
    found = counts(sorted(rows, key=lambda row: row.groups))
    print(f'\n{table(dict(sorted(found.items())))}')
    missed = [row.key for row in rows if row.plain and not row.tied]
    print(f'right by the plain ranking alone: {", ".join(missed) or "none"}')
    return int(any(tied < plain for _, tied, plain, _ in found.values()))


def _rows(kind: str, cases: str, processes: int, folder: Path | None) -> list[Row]:
    if kind == LABORATORY:
        specs = of_laboratory('development', part=True)
        both = [run_laboratory(specs, processes), run_laboratory(specs, processes, judge_plain)]
        return laboratory_rows(*both)
    numbers = select(kind, cases)
    answers = []
    for word, question in (('diagnosis', ask), ('plain', plain_ranking)):
        path = folder / f'{kind.replace("/", "_")}_{word}.json' if folder else None
        if path is not None and path.exists():
            answers.append(read(path))
            continue
        judged = run(kind, numbers, processes, again=False, question=question)
        answers.append(judged)
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps([asdict(j) for j in judged], default=np.ndarray.tolist))
    return lived_rows(*answers)


def read(path: Path) -> list[LivedJudged]:
    """Read what `python -m benchmarks.lived --out` wrote, but for what was said of day 1."""
    judged = []
    for row in json.loads(path.read_text(encoding='utf-8')):
        truth, answer = row['truth'], row['answer']
        arrays = {name: np.array(truth[name]) for name in ('gravity', 'described', 'felt')}
        said = {
            part: tuple(Named(**one) for one in answer[part]) for part in ('headline', 'minor')
        }
        judged.append(LivedJudged(LivedTruth(**{**truth, **arrays}), Answer(**{**answer, **said})))
    return judged


def judge_plain(spec: CaseSpec) -> Judged:
    """Make a case of the laboratory and ask the plain ranking."""
    case = make_case(spec)
    answer = plain_ranking(
        nominal_arm(case),
        [bag.recording for bag in case.bags],
        validate=[bag.recording for bag in case.validation],
    )
    findings = tuple(Finding(one.name, one.joints) for one in answer.headline)
    verdict = answer.verdict if findings else 'consistent'
    return Judged(Truth.of(case), Outcome(verdict, findings, seconds=answer.seconds))


def _right_in_laboratory(judged: Judged) -> bool:
    if judged.truth.kind == 'free':
        return not judged.findings
    if judged.truth.kind == 'outside':
        return judged.admitted or not judged.findings
    return judged.top


def _groups(truth: LivedTruth) -> tuple[str, ...]:
    kind, index = truth.key.rsplit('/', 1)
    spec = specify(kind, int(index))
    motion = _MOTIONS.get(spec.styles['held_out'], spec.styles['held_out'])
    model = 'exact bodies' if spec.exact else 'identified'
    if not spec.exact and kind.endswith('mounting'):
        model = 'bodies that are off'
    return kind, f'motion: {motion}', f'model: {model}', family_of(truth.name, nameable(truth))


if __name__ == '__main__':
    sys.exit(main())
