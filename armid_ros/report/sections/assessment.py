# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The short sections of an identification: excitation, encoder noise, physical consistency."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from armid_ros.identification import PhysicalCertificate
from armid_ros.identification.assess.consistency import NoiseCheck
from armid_ros.report.blocks import (
    BulletList,
    ContentSection,
    DataTable,
    Fold,
    Paragraph,
    TableCell,
)
from armid_ros.report.charts import Chart, Series
from armid_ros.report.families import full_label
from armid_ros.report.notation import counted, digits, pretty
from armid_ros.report.statistics import Direction
from armid_ros.robots import Robot
import numpy as np

#: Parameters and combinations of them that are listed.
_WORST = 6


def excitation_section(
    condition_number: float, rank: int, directions: Sequence[Direction], links: Sequence[str]
) -> ContentSection:
    """
    Return how well a motion determines the parameters.

    Parameters
    ----------
    condition_number : float
        Of the weighted base regressor.
    rank : int
        Number of parameters that the motion identifies.
    directions : sequence of Direction
        Combinations of parameters, the worst-determined first.
    links : sequence of str
        Names of the links, in the order of their numbers.

    """
    rows = []
    for direction in directions[:_WORST]:
        parts = [f'{full_label(one, links)} {100.0 * x:.0f} %' for one, x in direction.parts]
        rows.append((', '.join(parts), digits(direction.uncertainty)))
    values = np.array([direction.uncertainty for direction in directions])
    return ContentSection(
        'Excitation',
        [
            Paragraph(
                f'This motion identifies {counted(rank, "parameter")}. The condition number of '
                f'the weighted regressor is {condition_number:.3g}.'
            ),
            Paragraph(
                'The worst-determined combinations are listed first. Each number is the torque '
                'uncertainty that the combination causes, over the standard deviation of the '
                'residual.'
            ),
            DataTable((), rows),
            Chart(
                np.arange(1.0, len(values) + 1.0),
                [Series('uncertainty', values, 'residual', 'sticks')],
                'combination of parameters, worst known first',
                'uncertainty / residual',
                height=190,
                legend=False,
            ),
        ],
    )


def noise_section(robot: Robot, check: NoiseCheck) -> ContentSection:
    """Return the test for errors in variables, and the bias that a simulation finds."""
    noise = ', '.join(
        f'{joint} {digits(1e3 * value)} m{unit}'
        for joint, value, unit in zip(
            robot.joints, check.position_noise, robot.position_units, strict=True
        )
    )
    names = check.instrumental.parameters
    rows = [
        (
            full_label(names[k], robot.links),
            f'{check.bias[k]:.2g} {pretty(names[k].unit)}',
            f'{check.bias_std[k]:.1g}',
            f'{check.relative_bias[k]:+.2f}',
        )
        for k in np.argsort(-np.abs(check.relative_bias))[:_WORST]
    ]
    return ContentSection(
        'Encoder noise',
        [
            Paragraph(
                'Least squares assumes exact positions. The Durbin-Wu-Hausman test compares the '
                'fit with an instrumental-variable fit, which encoder noise does not bias. The '
                f'position noise of the recordings is {noise}.'
            ),
            BulletList(
                [
                    (f'{text[:1].upper()}{text[1:]}.', 'fine' if fine else 'warn')
                    for text, fine in check.findings()
                ]
            ),
            Fold(
                'The largest biases', [DataTable(('Parameter', 'Bias', '±', 'Bias / std'), rows)]
            ),
        ],
    )


def physical_section(
    certificate: PhysicalCertificate, exports: Mapping[str, Sequence[str]]
) -> ContentSection:
    """
    Return the certificate of a fit with physically consistent links.

    Parameters
    ----------
    certificate : PhysicalCertificate
        What shows it.
    exports : mapping of str to sequence of str
        Files for other programs, and what each has no place for.

    """
    quantifier = 'Every' if certificate.consistent else 'Not every'
    training, held_out = (
        100.0 * (ratio - 1.0) for ratio in (certificate.misfit_ratio, certificate.held_out_ratio)
    )
    rows = []
    for link, share in zip(certificate.links, certificate.shares, strict=True):
        active = link.link in certificate.active
        rows.append(
            (
                link.link,
                f'{link.mass:.4g}',
                TableCell(', '.join(f'{value:.3g}' for value in link.eigenvalues), 'wraps'),
                ', '.join(f'{value:.3g}' for value in link.moments),
                digits(float(share)),
                TableCell('active', 'telling') if active else 'inactive',
            )
        )
    heads = (
        'Link',
        'Mass [kg]',
        'Eigenvalues of the pseudo-inertia',
        'Principal moments [kg m²]',
        'Smallest share of prior',
        'Constraint',
    )
    activity = [(line[:1].upper() + line[1:], '') for line in certificate.activity]
    tried = [
        tuple(
            TableCell(text, 'changed' if weight == certificate.weight else '')
            for text in (f'{weight:g}', f'{100 * (ratio - 1):+.2f} %')
        )
        for weight, ratio in certificate.tried
    ]
    head = 'Cross-validation error relative to the unconstrained fit'
    return ContentSection(
        'Physical consistency',
        [
            Paragraph(
                f'{quantifier} link is physically consistent: all four eigenvalues of the '
                'pseudo-inertia have to be positive. The constraints change the torque error by '
                f'{training:.2f} % on the training data and by {held_out:+.2f} % in '
                'cross-validation.'
            ),
            DataTable(heads, rows, (0, 5)),
            BulletList(activity or [('No constraint is active.', 'fine')]),
            Fold(
                f'Weight of the description: {certificate.weight:g}, chosen by cross-validation',
                [
                    Paragraph('The largest weight whose error is not above the smallest one.'),
                    DataTable(('Weight', head), tried, ()),
                ],
            ),
            *_without_place(exports),
        ],
    )


def _without_place(exports: Mapping[str, Sequence[str]]) -> list[Paragraph]:
    """Return what each file for other programs has no place for."""
    homeless = []
    for file, lines in exports.items():
        kinds = Counter(line.split(':')[0] for line in lines)
        if kinds:
            said = ', '.join(f'{kind} ({counted(n, "value")})' for kind, n in kinds.items())
            homeless.append(
                Paragraph(f'{file} has no place for {said}: a comment in it lists them.')
            )
    return homeless
