# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A machine and its wearer: stiffness of the ties, forces, assumptions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.identification.ties.stiffness import Interaction
from armid_ros.motion import FloatArray
from armid_ros.papers.exo.assumptions import Assumption, read_assumptions
from armid_ros.papers.exo.plant.leg_pair import pair_torques, PairMotion, TiedPair
from armid_ros.report.blocks import (
    ContentSection,
    DataTable,
    FactList,
    Fold,
    Panels,
    Paragraph,
)
from armid_ros.report.charts import Chart, Role, Series
from armid_ros.report.notation import measured
import numpy as np

_ROLES: tuple[Role, ...] = ('residual', 'predicted', 'before', 'measured')


def stiffness_section(found: Sequence[Interaction], truth: Mapping[str, float]) -> ContentSection:
    """
    Return a section with the stiffness of the ties and its intervals.

    Parameters
    ----------
    found : sequence of Interaction
        Estimates with one stiffness for all ties, then with one for each.
    truth : mapping of str to float
        True stiffness by segment [N/m]; empty unless the data were simulated.

    """
    heads = ['Spring', 'Stiffness [N/m]', '± 95 %', 'Bias of plain least squares']
    rows = [
        [
            segment.replace('_', ' '),
            *measured(part.stiffness[k], HALF_WIDTH * part.std[k]),
            f'{100.0 * part.bias[k] / part.stiffness[k]:+z.2f} %',
            *([f'{truth[segment]:g}' if segment in truth else ''] if truth else []),
        ]
        for part in found
        for k, segment in enumerate(part.segments)
    ]
    noise = [
        ('Noise of the angles, as filtered', f'{_range(np.degrees(found[0].position_noise))}°'),
        ('Noise of the torques, as filtered', f'{_range(found[0].torque_noise)} N m'),
    ]
    text = (
        'Springs are drawn out by millimetres, the small difference of measured angles. Noise in '
        'the angles biases plain least squares, and more data do not help. '
        'The noise was measured in the recording and its effect taken out.'
    )
    table = DataTable([*heads, 'Simulated with'] if truth else heads, rows)
    return ContentSection('Stiffness', [table, FactList(noise), Paragraph(text, 'hint')])


def _range(values: FloatArray) -> str:
    """Format least and largest value to two digits, or one value if both are equal."""
    ends = dict.fromkeys(f'{end:.2g}' for end in (values.min(), values.max()))
    return ' to '.join(ends)


def forces_section(
    pair: TiedPair, motions: PairMotion, abscissa: FloatArray, name: str
) -> ContentSection:
    """Return a section with the spring forces, and their part of the torques."""
    torques = pair_torques(pair, *motions)
    alone = pair_torques(pair.with_stiffness(0.0), *motions)
    size = np.linalg.norm(torques.forces, axis=2)
    names = [name.replace('_', ' ') for name in pair.segments]
    series = [Series(name, size[:, k], _ROLES[k % len(_ROLES)]) for k, name in enumerate(names)]
    rows = [
        (name, f'{size[:, k].mean():.0f}', f'{size[:, k].max():.0f}')
        for k, name in enumerate(names)
    ]
    panels = []
    for k, joint in enumerate(pair.robot.joints):
        both = [
            Series('alone', alone.tau[:, k], 'measured'),
            Series('with springs', torques.tau[:, k], 'residual'),
        ]
        chart = Chart(abscissa, both, name, 'torque [N m]', height=180, link='torques')
        panels.append((joint, '', [chart]))
    return ContentSection(
        'Interaction',
        [
            Paragraph('Force of each spring on the machine; the wearer feels the opposite.'),
            Chart(abscissa, series, name, 'force [N]', height=260),
            DataTable(['Segment', 'Mean [N]', 'Largest [N]'], rows),
            Fold('What the springs make of the joint torques', [Panels(panels)]),
        ],
    )


def assumptions_section() -> ContentSection:
    """Return a section with the assumptions: name, value with unit, reason."""
    rows = [
        (name.replace('_', ' '), _shown(entry), entry.reason)
        for name, entry in read_assumptions().items()
    ]
    text = 'What the literature leaves open and what was assumed instead.'
    table = DataTable(['Quantity', 'Value', 'Reason'], rows, words=(0, 1, 2))
    return ContentSection('Assumptions', [Paragraph(text), table])


def _shown(entry: Assumption) -> str:
    value = entry.value
    if isinstance(value, dict):
        text = ', '.join(f'{name} {number:g}' for name, number in value.items())
    elif isinstance(value, list):
        text = ', '.join(f'{number:g}' for number in value)
    else:
        text = f'{value:g}' if isinstance(value, float) else str(value)
    return f'{text} {entry.unit}'.strip()
