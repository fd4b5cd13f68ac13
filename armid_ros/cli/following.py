# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Suggestion of the next command line, with the robot, bags and options of the last one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import chain, count
from pathlib import Path
import shlex
from typing import Any

from armid_ros.api.comparison import ComparisonResult
from armid_ros.api.diagnosis import DiagnosisResult
from armid_ros.api.excitation import ExcitationResult
from armid_ros.api.inspection import InspectionResult
from armid_ros.api.table import Shown
from armid_ros.cli import columns
from armid_ros.cli.commands import TYPED
from armid_ros.errors import ModelError
from armid_ros.identification.output import identified_from
import click

#: Output folder of each command, next to the output folder of the previous command.
_OUT = {
    'identify': 'model',
    'diagnose': 'diagnosis',
    'excite': 'plan',
    'simulate': 'run',
    'inspect': 'inspection',
}
#: Commands that take no recordings.
_ALONE = ('excite', 'simulate')
#: Options that are not copied to the next command.
_OWN = {'robot_source', 'out', 'as_json', 'strict', 'every', 'no_baseline'}


def next_command(then: str, result: Shown) -> str:
    """
    Return the command line to run next, with arguments from the running command.

    Parameters
    ----------
    then : str
        Name of the next command.
    result : Shown
        Result of the running command.

    """
    context = click.get_current_context()
    given, own = context.params, str(context.command.name)
    if then == 'diagnose' == own and given['residual']:
        then = 'excite'
    robot, bags, more = _subject(then, result, given)
    if isinstance(result, DiagnosisResult) and then == 'diagnose':
        compared = result.baseline or result.simulated is not None
        more = ['--residual', 'gp'] if compared else ['--baseline', 'BAG']
    if then == 'excite' and own != 'check':
        more = ['--seed', given['seed'] + 1]
    if then in _OUT:
        path = Path(given.get('out') or '').parent / _OUT[then]
        others = (path.with_name(f'{path.name}_{number}') for number in count(2))
        more += ['--out', next(one for one in chain([path], others) if not one.exists())]
    words = ['--robot', robot] if then in _ALONE else [*bags, '--robot', robot]
    words = [robot, *bags] if then == 'check' else words
    kept = {'gravity', 'joints', *(['effects'] if then == 'check' else [])}
    if then == own:
        kept = {str(one.name) for one in context.command.params} - _OWN
    elif then not in _ALONE:
        kept |= {'topic', *context.meta.get(columns.META, ())}
    return shlex.join(map(str, ['armid', then, *words, *_typed(context, kept), *more]))


def _subject(
    then: str, result: Shown, given: dict[str, Any]
) -> tuple[str | Path, list[Path], list[Any]]:
    """Return the robot, the recordings and other options to suggest for the command `then`."""
    robot, out = given.get('robot_source'), Path(given.get('out') or '')
    bags = list(given.get('bags') or filter(None, [given.get('bag')]))
    more: list[Any] = []
    if isinstance(result, ComparisonResult):
        before, after = (Path(one.source) for one in (result.core.before, result.core.after))
        model = before.with_name('model.yaml')
        more = ['--model', model] if then == 'diagnose' and model.exists() else []
        for source in [after] if more else [before, after]:
            with suppress(ModelError):  # model.yaml does not name its recordings
                bags += identified_from(source)
        return result.core.after.robot, list(dict.fromkeys(bags)) or [Path('BAG')], more
    if isinstance(result, ExcitationResult):
        more = ['--trajectory', out / 'excitation.yaml']
    elif then == 'simulate':
        more = ['--model', out / 'model.yaml']
        if isinstance(result, DiagnosisResult) and result.next_run is not None:
            more += ['--trajectory', out / result.plan_file]
    elif then == 'diagnose':
        held_out = chain(*(('--validate', bag) for bag in given['validate']))
        more = [*held_out, '--effects', given['effects']]
    elif isinstance(result, InspectionResult) and robot is None:
        topics = [topic.name for topic in result.core.topics]
        robot = '-' if '/robot_description' in topics else 'ROBOT.urdf'
    if robot == '-' and then in _ALONE:
        robot = out / 'robot.urdf'
    return robot or '', bags[:1] if then == 'inspect' else bags, more


def _typed(context: click.Context, kept: Iterable[str]) -> Iterator[str]:
    """Yield the options named in `kept` with their values, as the user typed them."""
    known = {
        text: one for one in context.command.params for text in (*one.opts, *one.secondary_opts)
    }
    words = iter(context.meta.get(TYPED, ()))
    for word in words:
        option = known.get(word.partition('=')[0])
        if isinstance(option, click.Option):
            value = [] if option.is_flag or '=' in word else [next(words)]
            if option.name in kept:
                yield from (word, *value)
