# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables of parameters: identified, changed between two models, and expected of a run."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.estimate import Estimate
from armid_ros.excitation import Design
from armid_ros.identification.assess.comparison import Comparison
from armid_ros.identification.fitting.identifiability import HALF_WIDTH, Unidentified
from armid_ros.motion import FloatArray
from armid_ros.report.blocks import (
    Cells,
    ContentSection,
    FactList,
    Fold,
    IntervalTrack,
    Legend,
    PageBlock,
    Paragraph,
    ShareBar,
    TableCell,
)
from armid_ros.report.families import (
    estimate_text,
    full_label,
    parameter_families,
    parameter_folds,
)
from armid_ros.report.notation import counted, digits
import numpy as np


def parameter_section(
    estimate: Estimate,
    described: FloatArray,
    unidentified: Sequence[Unidentified] = (),
    links: Sequence[str] = (),
    reference: str = 'description',
) -> ContentSection:
    """
    Return every parameter beside the description's.

    Parameters
    ----------
    estimate : Estimate
        P parameters.
    described : ndarray, shape (P,)
        Values of the description; zero for effects that it does not know.
    unidentified : sequence of Unidentified
        What the data do not determine.
    links : sequence of str
        Names of the links, in the order of their numbers.
    reference : str
        What ``described`` is: 'description', or 'truth' of a simulated arm.

    """
    names, values = estimate.parameters, estimate.values
    reach = HALF_WIDTH * estimate.std
    known = [name.rigid or bool(value) for name, value in zip(names, described, strict=True)]
    changed = np.array(known) & (np.abs(values - described) > reach)

    def cells(k: int) -> Cells:
        number, half = estimate_text(float(values[k]), float(estimate.std[k]))
        told = number != 'includes 0'
        return (
            TableCell(number, '' if told else 'unknown'),
            half,
            f'{digits(100.0 * float(reach[k]) / abs(float(values[k])))} %' if told else '> 100 %',
            TableCell(f'{described[k]:.3g}' if known[k] else 'none', 'changed' * bool(changed[k])),
            IntervalTrack(
                float(values[k]), float(reach[k]), float(described[k]) if known[k] else None
            ),
        )

    count = int(changed.sum())
    blocks: list[PageBlock] = [
        Paragraph(
            f'The {reference} has values of {sum(known)} of these '
            f'{counted(len(names), "parameter")}; {count} of them {"is" if count == 1 else "are"} '
            'outside the 95 % interval of the estimate (in bold). Each bar has its own axis with '
            'zero in the middle.'
        ),
        Legend([('after', 'estimate with its 95 % interval'), ('tick', reference)]),
        *parameter_folds(names, ('Estimate', '± 95 %', 'Relative', reference, ''), cells, links),
    ]
    lost: dict[str, list[str]] = {}
    for one in unidentified:
        if one.parameter not in names:
            reason = one.reason[:1].upper() + one.reason[1:]
            lost.setdefault(reason, []).append(full_label(one.parameter, links))
    if lost:
        rows = [(reason, ', '.join(some)) for reason, some in lost.items()]
        blocks.append(Fold('Not identified', [FactList(rows)], opened=True))
    return ContentSection('Parameters', blocks)


def changes_section(comparison: Comparison) -> ContentSection:
    """Return every parameter of two identifications side by side."""
    changes = comparison.changes

    def cells(k: int) -> Cells:
        one = changes[k]
        before, after = (
            ' ±\N{NO-BREAK SPACE}'.join(estimate_text(value, std)).replace(
                'includes 0 ', 'includes 0, '
            )
            for value, std in ((one.before, one.before_std), (one.after, one.after_std))
        )
        return (
            before,
            TableCell(after, 'changed' if one.changed else ''),
            f'{one.deviations:+.1f}',
            IntervalTrack(one.after, HALF_WIDTH * one.after_std, one.before),
        )

    def count(members: list[int]) -> int:
        return sum(changes[k].changed for k in members)

    return ContentSection(
        'Side by side',
        [
            Paragraph(
                'Significant changes are in bold (5 % family-wise false-alarm rate). Each bar has '
                'its own axis with zero in the middle.'
            ),
            Legend([('after', 'second, with its 95 % interval'), ('tick', 'first')]),
            *parameter_folds(
                tuple(one.parameter for one in changes),
                ('First', 'Second', 'Difference / std', ''),
                cells,
                suffix=lambda members: f'{count(members)} of {len(members)} changed',
                opened=lambda members: count(members) > 0,
            ),
        ],
    )


def foreseen_section(design: Design, links: Sequence[str] = ()) -> ContentSection:
    """Return what a planned run will determine of every parameter, the best known first."""
    information, described = design.information, design.described
    size = information.std / information.scale
    longest: dict[int, float] = {}
    for members in parameter_families(information.parameters).values():
        own = max((float(size[k]) for k in members if np.isfinite(size[k])), default=1.0)
        longest.update(dict.fromkeys(members, own))

    def cells(k: int) -> Cells:
        name, std, value = information.parameters[k], information.std[k], described[k]
        seen, known = bool(np.isfinite(std)), name.rigid or bool(value)
        relative = f'{digits(100.0 * std / abs(value))} %' if value and seen else ''
        share = 100.0 * float(size[k]) / longest[k] if seen else 100.0
        return (
            f'{value:.3g}' if known else 'not known',
            digits(float(std)) if seen else 'not seen',
            relative if std < abs(value) or not relative else '> 100 %',
            ShareBar(round(share, 1), 'residual' if seen else 'predicted'),
        )

    return ContentSection(
        'Expected accuracy',
        [
            Paragraph(
                'Predicted standard deviation of each parameter after the run, for the stated '
                'torque noise and a correct model. Bars compare the torque uncertainty within '
                'each kind.'
            ),
            *parameter_folds(
                information.parameters,
                ('Prior model', '± 1 \N{GREEK SMALL LETTER SIGMA}', 'Relative', ''),
                cells,
                links,
                order=lambda k: float(size[k]),
            ),
        ],
    )
