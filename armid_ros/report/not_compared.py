# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a comparison leaves out, in words: how many parameters, which, and why."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.identification.assess.comparison import Comparison, NotCompared
from armid_ros.report.families import full_label
from armid_ros.report.notation import counted

#: Parameters that a line names.
_NAMED = 6
_WHY = {
    'motion': 'the motion of the {other} does not show {them}',
    'effect': 'the model of the {other} does not have {them}',
    'deviation': 'the {other} has no standard deviations to make those of {them} from',
    'grouping': 'the data of the {other} group parameters differently',
}


def tell_not_compared(comparison: Comparison) -> tuple[str, ...]:
    """Say what is not compared, a sentence for each side and reason."""
    lines = []
    if comparison.left_out:
        files = ' and '.join(
            one.source for one in (comparison.before, comparison.after) if one.without_std
        )
        verb = 'has' if len(comparison.left_out) == 1 else 'have'
        lines.append(
            f'{_count(comparison.left_out)} {verb} no standard deviation in {files}; '
            'identification.json of that run has it.'
        )
    sides = ('first', 'second', comparison.only_before), ('second', 'first', comparison.only_after)
    for side, other, found in sides:
        for why, said in _WHY.items():
            some = [one for one in found if one.why == why]
            if some:
                reason = said.format(other=other, them='it' if len(some) == 1 else 'them')
                lines.append(f'{_count(some)} of the {side} only: {reason} ({_named(some)}).')
    return tuple(lines)


def _count(some: Sequence[NotCompared]) -> str:
    return counted(len(some), 'parameter')


def _named(some: Sequence[NotCompared]) -> str:
    shown = ', '.join(full_label(one.parameter) for one in some[:_NAMED])
    return shown + (f' and {len(some) - _NAMED} more' if len(some) > _NAMED else '')
