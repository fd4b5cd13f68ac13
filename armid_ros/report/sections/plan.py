# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A run that is planned: its motion within the limits, its clearance, its harmonics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from armid_ros.excitation import FourierTrajectory, Limits
from armid_ros.motion import FloatArray, Motion
from armid_ros.report.blocks import (
    BulletList,
    Cells,
    ContentSection,
    DataTable,
    PageBlock,
    Panels,
    Paragraph,
    TableCell,
)
from armid_ros.report.charts import Chart, Level, Role, Series
from armid_ros.report.notation import digits, pretty
from armid_ros.report.sections.fit import ZOOM
import numpy as np

#: Background of the largest harmonic of a joint [%].
_SHADE = 55.0


def motion_section(
    limits: Limits, motion: Motion, shares: Mapping[str, FloatArray]
) -> ContentSection:
    """
    Return the joints' paths, rates and torques with the limits in force.

    Parameters
    ----------
    limits : Limits
        The limits.
    motion : Motion
        The run, with the torque of the prior model.
    shares : mapping of str to ndarray, shape (n,)
        Share of each limit that the excitation uses.

    """
    assert motion.tau is not None
    quantities = (
        ('position', motion.q, limits.lower, limits.upper),
        ('velocity', motion.dq, -limits.velocity, limits.velocity),
        ('acceleration', motion.ddq, -limits.acceleration, limits.acceleration),
        ('torque', motion.tau, -limits.torque, limits.torque),
    )
    rows, panels = [], []
    for j, joint in enumerate(limits.joints):
        used = [f'{100.0 * s[j]:.0f} %' if s[j] > 0.0 else 'no limit' for s in shares.values()]
        rows.append((joint, *used))
        charts = [
            Chart(
                motion.t,
                [Series(name, values[:, j], 'residual')],
                'time [s]' if name == 'torque' else '',
                f'{name} [{pretty(limits.unit(name, j))}]',
                height=180 if name == 'torque' else 145,
                link='planned',
                levels=[Level(float(e[j])) for e in (lower, upper) if np.isfinite(e[j])],
                legend=False,
            )
            for name, values, lower, upper in quantities
        ]
        panels.append((joint, '', charts))
    return ContentSection(
        'Motion and limits',
        [
            Paragraph(
                'Largest share of each limit that the excitation uses. For positions it is '
                'measured from the middle of the range. Approach and return may use the whole '
                'range.'
            ),
            DataTable(('Joint', *shares), rows, kind='tight'),
            Paragraph(f'Horizontal lines are the limits. {ZOOM}', 'hint'),
            Panels(panels),
        ],
    )


def clearance_section(
    t: FloatArray, curves: Mapping[str, FloatArray], margin: float, notes: Sequence[str]
) -> ContentSection:
    """
    Return how far bodies are apart, from each other and from the environment.

    Parameters
    ----------
    t : ndarray, shape (N,)
        Time [s].
    curves : mapping of str to ndarray, shape (N,)
        Smallest distance of each kind [m].
    margin : float
        Smallest distance that is allowed [m].
    notes : sequence of str
        What was not checked.

    """
    roles: tuple[Role, ...] = ('residual', 'before')
    blocks: list[PageBlock] = [
        Chart(
            t,
            [
                Series(name, 100.0 * curve, role)
                for (name, curve), role in zip(curves.items(), roles, strict=False)
            ],
            'time [s]',
            'distance [cm]',
            height=240,
            link='planned',
            levels=[Level(100.0 * margin, f'{100.0 * margin:g} cm to keep')],
        )
    ]
    if not curves:
        none = 'the description has no collision bodies that could touch'
        blocks = [Paragraph(f'Clearance is not checked: {none}.')]
    if notes:
        blocks.append(BulletList([(note, 'warn') for note in notes]))
    return ContentSection('Clearance', blocks)


def harmonics_section(trajectory: FourierTrajectory) -> ContentSection:
    """Return the velocity amplitude of each harmonic of each joint."""
    size = np.hypot(trajectory.a, trajectory.b)
    share = size / np.maximum(size.max(axis=1, keepdims=True), 1e-12)
    frequencies = np.arange(1, trajectory.harmonics + 1) / trajectory.period
    rows: list[Cells] = [
        (
            joint,
            *(
                TableCell(digits(a), shade=round(_SHADE * s))
                for a, s in zip(size[j], share[j], strict=True)
            ),
        )
        for j, joint in enumerate(trajectory.joints)
    ]
    said = (
        'Velocity amplitude of each harmonic [rad/s or m/s]. The motion has no other frequencies.'
    )
    heads = ('Joint', *(f'{frequency:.3g} Hz' for frequency in frequencies))
    return ContentSection('Spectrum', [Paragraph(said), DataTable(heads, rows)])
