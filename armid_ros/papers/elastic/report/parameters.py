# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of two links on springs with intervals, and reference parameters."""

from __future__ import annotations

from armid_ros.estimate import name_in_words
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.papers.elastic.identification.names import parameter_names, PER_JOINT, unpack
from armid_ros.papers.elastic.identification.output import total_damping
from armid_ros.papers.elastic.identification.rigid import CUTOFF, RigidFit
from armid_ros.papers.elastic.identification.three_steps import TwoInertiaIdentification
from armid_ros.report.blocks import ContentSection, DataTable, Paragraph
from armid_ros.report.notation import digits, measured, pretty
from armid_ros.robots.two_link import TwoLinkParameters


def parameters_section(
    result: TwoInertiaIdentification, known: TwoLinkParameters | None, source: str
) -> ContentSection:
    """
    Return a section with parameters, intervals and reference parameters.

    Parameters
    ----------
    result : TwoInertiaIdentification
        Results of the identification.
    known : TwoLinkParameters, or None
        Reference parameters for comparison.
    source : str
        Source of the reference parameters.

    """
    names = parameter_names(result.joints)
    long = {symbol: f'{name_in_words(field)} ({symbol})' for field, symbol, _ in PER_JOINT}
    lines = [(long.get(name.name, name.name), name.joint, name.unit) for name in names]
    values, untuned = unpack(result.parameters).tolist(), unpack(result.untuned).tolist()
    base = None if known is None else unpack(known).tolist()
    std: list[float] = []
    text = 'From the frequency responses. Step responses would tune them and give intervals.'
    heads = ['Parameter', 'Joint', 'Estimate']
    if result.tuning is not None:
        text = (
            'Tuned to the step responses; intervals hold 95 %. Of dl and dm only the sum is known '
            'well, dl + dm gear². The shares of link and motor are those of the start values.'
        )
        heads += ['± 95 %', 'Untuned']
        std = result.tuning.estimate.std.tolist()
        for k, total in enumerate(total_damping(result)):
            lines.append((total['name'], total['joint'], total['unit']))
            values.append(total['value'])
            std.append(total['std'])
            untuned.append(float(result.untuned.total_damping[k]))
            if known is not None and base is not None:
                base.append(float(known.total_damping[k]))
    if base is not None:
        text += f' Compared with {source}.'
        heads += ['Known', 'Difference']
    rows = []
    for k, (name, joint, unit) in enumerate(lines):
        row = [pretty(name), joint]
        if std:
            row += [*measured(values[k], HALF_WIDTH * std[k]), digits(untuned[k], 4)]
        else:
            row.append(f'{values[k]:.4g}')
        if base is not None:
            row += [f'{base[k]:g}', f'{100.0 * (values[k] / base[k] - 1.0):+.2f} %']
        rows.append([*row, pretty(unit)])
    table = DataTable([*heads, 'Unit'], rows, words=(0, 1, len(heads)))
    return ContentSection('Parameters', [Paragraph(text), table])


def rigid_section(fit: RigidFit) -> ContentSection:
    """Return a section with the parameters of step 1, the arm with rigid joints."""
    estimate = fit.estimate
    rows = [
        (pretty(name.name), name.joint, *measured(value, HALF_WIDTH * std), pretty(name.unit))
        for name, value, std in zip(
            estimate.parameters, estimate.values, estimate.std, strict=True
        )
    ]
    text = (
        f'Step 1, least squares below {CUTOFF:g} Hz: motor and link of joint 1, and friction of '
        f'motors and links, are one. {fit.relative_error:.2f} % of the torque is left.'
    )
    heads = ('Parameter', 'Joint', 'Estimate', '± 95 %', 'Unit')
    return ContentSection('Rigid arm', [Paragraph(text), DataTable(heads, rows, words=(0, 1, 4))])
