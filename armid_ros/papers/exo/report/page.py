# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Page on exoskeleton and wearer: stiffness and forces of the straps, and assumptions."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.estimate import measured
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.identification.ties.stiffness import Interaction
from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.gait import read_assumptions
from armid_ros.papers.exo.plant.leg_pair import pair_torques, PairMotion, TiedPair
from armid_ros.papers.exo.report.walk import by_torque_section, feet_section, SimulatedWalk, Walk
from armid_ros.report.blocks import DataTable, FactList, Fold, Panels, Paragraph, VerdictSection
from armid_ros.report.charts import Chart, Role, Series
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
import numpy as np

#: Share of a stiffness that the half-width of a narrow interval has at most.
_MAX_HALF_WIDTH = 0.1


def exo_report(
    pair: TiedPair,
    motions: PairMotion,
    found: Sequence[Interaction],
    walked: SimulatedWalk | None,
    provenance: Provenance,
) -> str:
    """
    Return the HTML page on exoskeleton, wearer and straps.

    Parameters
    ----------
    pair : TiedPair
        Both machines, with the estimated stiffness.
    motions : PairMotion
        The recorded motions of both machines.
    found : sequence of Interaction
        Estimates with one stiffness for all ties, then with one for each.
    walked : SimulatedWalk or None
        Walk of the simulated pair; None for recorded data.
    provenance : Provenance
        Files, versions, settings, seed.

    """
    sections = [_stiffness_section(found, walked)]
    if walked is not None:
        sections.append(Section('Walking', [Walk(walked)]))
        sections += [by_torque_section(walked), feet_section(walked.cycle)]
    sections += [forces_section(pair, motions), assumptions_section()]
    title = 'Straps between an exoskeleton and its wearer'
    subtitle = f'{len(pair.ties)} straps · {len(motions.own)} samples'
    return Page(title, subtitle, verdict(found, walked), sections, provenance).html()


def verdict(found: Sequence[Interaction], walked: SimulatedWalk | None) -> VerdictSection:
    """Return the verdict box: strap stiffness with interval, and joint errors of a gait cycle."""
    overall = found[0]
    stiffness, reach = overall.stiffness[0], HALF_WIDTH * overall.std[0]
    true = '' if walked is None else f'; {walked.stiffness:.0f} N/m were simulated'
    sentences = [
        f'Stiffness of all {len(found[-1].segments)} straps between exoskeleton and wearer: '
        f'{stiffness:.0f} ± {reach:.0f} N/m (95 %){true}.'
    ]
    weak = [
        name.replace('_', ' ')
        for part in found[1:]
        for name, value, std in zip(part.segments, part.stiffness, part.std, strict=True)
        if HALF_WIDTH * std > _MAX_HALF_WIDTH * abs(value)
    ]
    if walked is not None:
        errors = ', '.join(f'{one.right.joint} {one.right.most:.2g}°' for one in walked.driven)
        sentences.append(
            f'Largest error of joints driven by their computed torques, in a gait cycle: {errors}.'
        )
    small = 'the strap extension is too small for an accuracy of 10 %.'
    beware = [f'{", ".join(weak)}: {small}'] if weak else []
    if stiffness - reach <= 0.0:
        return VerdictSection('no interaction', 'fair', ['No interaction was identified.'], beware)
    sure = reach < _MAX_HALF_WIDTH * stiffness
    step = 'Use the stiffness of each strap in exo.json; its interval is 95 %.'
    return VerdictSection(
        'found' if sure else 'uncertain', 'good' if sure else 'fair', sentences, beware, step=step
    )


_ROLES: tuple[Role, ...] = ('residual', 'predicted', 'before', 'measured')


def _stiffness_section(found: Sequence[Interaction], walked: SimulatedWalk | None) -> Section:
    heads = ['Strap', 'Stiffness [N/m]', '± 95 %', 'Bias of ordinary least squares']
    rows = [
        [
            segment.replace('_', ' '),
            *measured(part.stiffness[k], HALF_WIDTH * part.std[k]),
            f'{100.0 * part.bias[k] / part.stiffness[k]:+z.2f} %',
            *([f'{walked.stiffness:g}'] if walked else []),
        ]
        for part in found
        for k, segment in enumerate(part.segments)
    ]
    noise = [
        ('Noise of the angles, as filtered', f'{_range(np.degrees(found[0].position_noise))}°'),
        ('Noise of the torques, as filtered', f'{_range(found[0].torque_noise)} N m'),
    ]
    text = (
        'Straps extend by millimetres, computed from small differences of measured angles. Angle '
        'noise biases ordinary least squares, however long the recording. The noise is estimated '
        'from the recording, and the bias is corrected.'
    )
    table = DataTable([*heads, 'Simulated with'] if walked else heads, rows)
    return Section('Stiffness', [table, FactList(noise), Paragraph(text, 'hint')])


def _range(values: FloatArray) -> str:
    """Format the range of values, or a single value if both ends agree in two digits."""
    ends = dict.fromkeys(f'{end:.2g}' for end in (values.min(), values.max()))
    return ' to '.join(ends)


def forces_section(pair: TiedPair, motions: PairMotion) -> Section:
    """Return the section with strap forces, and joint torques with and without straps."""
    torques = pair_torques(pair, *motions)
    alone = pair_torques(pair.with_stiffness(0.0), *motions)
    t, size = motions.own.t, np.linalg.norm(torques.forces, axis=2)
    names = [name.replace('_', ' ') for name in pair.segments]
    series = [Series(name, size[:, k], _ROLES[k % len(_ROLES)]) for k, name in enumerate(names)]
    rows = [
        (name, f'{size[:, k].mean():.0f}', f'{size[:, k].max():.0f}')
        for k, name in enumerate(names)
    ]
    panels = []
    for k, joint in enumerate(pair.robot.joints):
        both = [
            Series('without straps', alone.tau[:, k], 'measured'),
            Series('with straps', torques.tau[:, k], 'residual'),
        ]
        chart = Chart.over_time(t, both, 'torque [N m]', height=180, link='torques')
        panels.append((joint, '', [chart]))
    return Section(
        'Interaction',
        [
            Paragraph(
                'Force of each strap on the exoskeleton; the force on the wearer is opposite.'
            ),
            Chart.over_time(t, series, 'force [N]', height=260),
            DataTable(['Strap', 'Mean [N]', 'Largest [N]'], rows),
            Fold('Joint torques of the exoskeleton with and without straps', [Panels(panels)]),
        ],
    )


def assumptions_section() -> Section:
    """Return the section with name, value, unit and reason of each assumed quantity."""
    rows = []
    for name, entry in read_assumptions().items():
        value = entry.value
        if isinstance(value, dict):
            text = ', '.join(f'{part} {number:g}' for part, number in value.items())
        elif isinstance(value, list):
            text = ', '.join(f'{number:g}' for number in value)
        else:
            text = f'{value:g}' if isinstance(value, float) else str(value)
        rows.append((name.replace('_', ' '), f'{text} {entry.unit}'.strip(), entry.reason))
    caption = 'Assumed values of quantities that the paper does not give.'
    table = DataTable(['Quantity', 'Value', 'Reason'], rows, words=(0, 1, 2))
    return Section('Assumptions', [Paragraph(caption), table])
