# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What each number of the diagnosis is worth: the score with it 30 % smaller and larger.

The sample is hard: causes near what can be seen, ties, what the diagnosis gets wrong, and arms to
which nothing happened. Where nothing changes in it, a number could be any within 30 %. Asked are
the thresholds and the numbers of the modules that decide; a number of a module is named by its
file and its name.

    python -m benchmarks.thresholds [--only NAME ...] [--cases KEY ...] [--processes N]

"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, ExitStack
from dataclasses import dataclass, fields, replace
from importlib import import_module
import multiprocessing
import os
from pathlib import Path
import sys
from typing import Any
from unittest.mock import patch

import armid_ros.diagnosis
from armid_ros.diagnosis import DiagnosisSettings
from armid_ros.diagnosis.settings import Thresholds

from benchmarks.lived import known_arm
from benchmarks.lived_scoring import LivedJudged, LivedTruth, nameable
from benchmarks.two_days import ask, identification_of
from docsite.numbers import constants
from tests.hidden.lived.adapter import recording_of, robot_of
from tests.hidden.lived.cases import lived_case

#: Development kinds alone: locked sets are for looking, not for choosing numbers.
SAMPLE = (
    *(f'development/{k}' for k in (14, 18, 22, 23, 45, 53, 63, 68, 69, 87)),  # small, or missed
    *(f'development/{k}' for k in (9, 36)),  # clear
    *(f'development/{k}' for k in (27, 35, 59)),  # nothing happened
    'development/exact/22',  # nothing there, and nothing repeats
)
#: By how much every number is changed.
CHANGES = (0.7, 1.3)

_PACKAGE_NAME, _ROOT = 'armid_ros.diagnosis', 'armid_ros.'
_PACKAGE = Path(armid_ros.diagnosis.__file__).parent
#: Parts of it whose numbers decide; those of sentences and the next run decide no name.
_VERDICT = ('verdict/attribution.py', 'verdict/gap.py')
_DECIDING = ('diagnose.py', 'prepare.py', 'data', 'search', *_VERDICT)
#: What decides beside it, below armid_ros: whether data are at fault.
_BESIDE = ('identification/assess/data_faults.py', 'identification/rows/stamps.py')
#: Numbers that a class is made with as its module is imported, which cannot be changed later.
_MADE_WITH = ('data/discrepancy.py _POSITIONS',)
#: From here up to one a number is a level, of which what is beyond is changed.
_LEVEL = 0.9

#: Name of a number, and the factor on it.
Change = tuple[str, float]


def of_modules() -> list[str]:
    """Return the numbers of the modules that decide, each by its file and its name."""
    root = _PACKAGE.parent
    own = [(_PACKAGE, path) for folder in _DECIDING for path in _files(folder)]
    found = [
        f'{path.relative_to(home).as_posix()} {name}'
        for home, path in [*own, *((root.parent, root / place) for place in _BESIDE)]
        for names, _, _ in constants(path.read_text(encoding='utf-8'))
        for name in names.split(', ')
    ]
    return [name for name in found if name not in _MADE_WITH]


def _files(place: str) -> list[Path]:
    path = _PACKAGE / place
    return [path] if path.suffix else sorted(path.rglob('*.py'))


def varied(names: Sequence[str], factor: float) -> DiagnosisSettings:
    """Return settings with some thresholds changed."""
    usual, known = Thresholds(), {field.name for field in fields(Thresholds)}
    values = {name: scaled(getattr(usual, name), factor) for name in names if name in known}
    return DiagnosisSettings(thresholds=replace(usual, **values))


def scaled(value: Any, factor: float) -> Any:
    """Return a number with a factor; counts are rounded, of a level what is beyond is scaled."""
    if isinstance(value, tuple):
        return tuple(scaled(one, factor) for one in value)
    if isinstance(value, int):
        return round(value * factor)
    return 1.0 - (1.0 - value) * factor if _LEVEL <= value < 1.0 else value * factor


def _module(path: str) -> str:
    """Return the module of a file, below the diagnosis unless it names its package."""
    name = path.removesuffix('.py').replace('/', '.')
    return name if name.startswith(_ROOT) else f'{_PACKAGE_NAME}.{name}'


@contextmanager
def changed(names: Sequence[str], factor: float) -> Iterator[None]:
    """Diagnose with numbers of modules changed, wherever they were imported."""
    with ExitStack() as stack:
        for path, name in (key.split() for key in names if ' ' in key):
            home = import_module(_module(path))
            value = getattr(home, name)
            for module in [one for key, one in sys.modules.items() if key.startswith(_ROOT)]:
                if module is home or (not name.startswith('_') and name in vars(module)):
                    stack.enter_context(patch.object(module, name, scaled(value, factor)))
        yield


@dataclass(frozen=True)
class Asked:
    """
    A case and what is answered of it.

    Attributes
    ----------
    usual : LivedJudged
        With the numbers as they are.
    others : dict of (name, factor) to LivedJudged
        With one changed, where that changes the answer.

    """

    usual: LivedJudged
    others: dict[Change, LivedJudged]

    def with_change(self, change: Change) -> LivedJudged:
        """Return the answer with a change."""
        return self.others.get(change, self.usual)


def answers(key: str, names: Sequence[str]) -> Asked:
    """Make a case and identify its model once, and ask with changed numbers."""
    kind, _, index = key.rpartition('/')
    case = lived_case(kind, int(index))
    day_1, day_2 = ([recording_of(run) for run in day] for day in (case.day_1, case.day_2))
    held_out = recording_of(case.held_out)
    arm = identification_of(robot_of(case), day_1).arm if day_1 else known_arm(case)
    truth = LivedTruth.of(case, (0.0, 0.0), robot_of(case).gravity)

    def said(names: Sequence[str], factor: float) -> LivedJudged:
        settings = varied(names, factor)
        with changed(names, factor):
            answer = ask(arm, day_2, validate=[held_out], baseline=day_1, settings=settings)
        return LivedJudged(truth, answer)

    usual = said((), 1.0)
    others: dict[Change, LivedJudged] = {}
    for factor in CHANGES:
        for name, answer in deciding(names, lambda some, f=factor: said(some, f), usual):
            others[name, factor] = answer
    return Asked(usual, others)


def deciding(
    names: Sequence[str], said: Callable[[Sequence[str]], LivedJudged], usual: LivedJudged
) -> Iterator[tuple[str, LivedJudged]]:
    """
    Yield the numbers that change an answer when they are changed alone, with the answer.

    Halves are changed together, and taken apart where that changes something: most numbers touch
    no answer of a case. Two that make up for each other in one half are missed.

    """
    if not names:
        return
    answer = said(names)
    if _said(answer) == _said(usual):
        return
    if len(names) == 1:
        yield names[0], answer
        return
    half = len(names) // 2
    for part in (names[:half], names[half:]):
        yield from deciding(part, said, usual)


def counts(judged: Sequence[LivedJudged]) -> str:
    """Return how many causes were named first, and names where nothing was, as text."""
    there = [one for one in judged if one.truth.name and nameable(one.truth)]
    first = sum(bool(one.first) for one in there)
    tied = sum(bool(one.tied) for one in there)
    quiet = [one for one in judged if not one.truth.name]
    alarms = sum(bool(one.answer.headline) for one in quiet)
    outside = [one for one in judged if one.truth.name and not nameable(one.truth)]
    admitted = sum(one.admitted for one in outside)
    names = sum(one.too_many for one in (*there, *quiet))
    said = [f'{first} of {len(there)} first, {tied} in the tie']
    said += [f'{admitted} of {len(outside)} admitted'] if outside else []
    return ', '.join([*said, f'{alarms} of {len(quiet)} alarms', f'{names} too many'])


def _said(one: LivedJudged) -> tuple[object, ...]:
    return one.answer.verdict, *((n.name, n.joints, n.rivals) for n in one.answer.headline)


def one_case(asked: Asked) -> str:
    """Say what is answered of a case, and which changes make another answer of it."""
    usual = asked.usual
    names = '; '.join(map(str, usual.answer.headline)) or 'nothing'
    others = [
        f'{name} {factor} ({one.answer.verdict} {"; ".join(map(str, one.answer.headline))})'
        for (name, factor), one in asked.others.items()
    ]
    return (
        f'{usual.truth.key} {usual.truth.name or "nothing"}: {usual.answer.verdict} {names}; '
        f'another answer with: {", ".join(others) or "none"}'
    )


def main() -> None:
    """Print what each case answers, and one line for each number and change."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks.thresholds')
    parser.add_argument('--cases', nargs='+', default=SAMPLE, metavar='KEY', help='other cases')
    parser.add_argument(
        '--only', nargs='+', default=[], metavar='NAME', help='some numbers, each as it is printed'
    )
    parser.add_argument('--processes', type=int, default=2)
    options = parser.parse_args()
    for variable in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'):
        os.environ.setdefault(variable, '1')
    known = [*(field.name for field in fields(Thresholds)), *of_modules()]
    names = [name for name in known if not options.only or name in options.only]
    of_cases: list[Asked] = []
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(options.processes, mp_context=context) as pool:
        for asked in pool.map(answers, options.cases, [names] * len(options.cases)):
            of_cases.append(asked)
            print(f'# {one_case(asked)}', flush=True)
    print(f'{"as it is":42s} {1.0:4.1f}  {counts([one.usual for one in of_cases])}')
    for change in ((name, factor) for name in names for factor in CHANGES):
        other = sum(change in one.others for one in of_cases)
        said = 'no answer changes'
        if other:
            score = counts([one.with_change(change) for one in of_cases])
            said = f'{score}; {other} {"answer changes" if other == 1 else "answers change"}'
        print(f'{change[0]:42s} {change[1]:4.1f}  {said}')


if __name__ == '__main__':
    main()
