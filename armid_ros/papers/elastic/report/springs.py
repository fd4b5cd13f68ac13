# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of springs of any arm: stiffness, free play and motor of every joint."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.papers.elastic.identification.joints import SpringEstimate
from armid_ros.report.blocks import ContentSection, DataTable, Paragraph
from armid_ros.report.notation import counted
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
from armid_ros.report.sections.frame import Origin, VerdictSection
import numpy as np

_SPRINGS = (
    'Joint', 'Stiffness [N m/rad]', '95 %', 'Backlash [mrad], 95 %', 'Correlation', 'R²'
)  # fmt: skip
_MOTORS = (
    'Joint', 'Link [kg m²]', 'Rotor [kg m²]', 'Viscous [N m s/rad]', 'Coulomb [N m]',
    'Antiresonance [Hz]', 'Resonance [Hz]',
)  # fmt: skip


def _springs(found: Sequence[SpringEstimate]) -> ContentSection:
    """Return a section with stiffness, free play and motor of every joint."""
    springs, motors = [], []
    for one in found:
        fit = one.transmission
        value, low, high = fit.stiffness
        play = [1e3 * x for x in fit.backlash]
        springs.append(
            (
                one.joint,
                f'{value:.4g}' if one.informative else 'not identifiable',
                f'{low:.4g} to {high:.4g}' if one.informative else '',
                f'{play[1]:.2g} to {play[2]:.2g}' if np.isfinite(play).all() else 'no reversals',
                f'{fit.correlation:+.2f}' if np.isfinite(fit.correlation) else '',
                f'{fit.explained:.4f}',
            )
        )
        own = ['', '', ''] if one.motor is None else [f'{x:.3g}' for x in one.motor]
        both = [
            f'{x:.1f}' if one.informative and np.isfinite(x) else ''
            for x in (one.antiresonance, one.resonance)
        ]
        motors.append((one.joint, f'{one.inertia:.3g}', *own, *both))
    text = (
        'The twist of each motor against its link, over what the rigid body takes there: inertia, '
        'gravity and the interaction of all links included. Compliance and free play are '
        'distinguishable where the load changes sides; a correlation near ±1 means they '
        'are not.'
    )
    hint = (
        'Frequencies are those of each joint alone, the others held, at its mean inertia in the '
        'recording.'
    )
    return ContentSection(
        'Springs',
        [Paragraph(text), DataTable(_SPRINGS, springs), DataTable(_MOTORS, motors),
         Paragraph(hint, 'hint')],
    )  # fmt: skip


def springs_report(found: Sequence[SpringEstimate], robot: str, provenance: Provenance) -> str:
    """
    Return report.html of springs that were found joint by joint.

    Parameters
    ----------
    found : sequence of SpringEstimate
        Every joint.
    robot : str
        Its name.
    provenance : Provenance
        Files, versions, settings, seed.

    """
    sections: list[Section] = [verdict(found), _springs(found), Origin(provenance)]
    subtitle = f'{robot} · {counted(len(found), "joint")}, encoders on both sides'
    return Page(f'Elastic joints of {robot}', subtitle, sections).html()


def verdict(found: Sequence[SpringEstimate]) -> VerdictSection:
    """Say how many springs were found, and which is the softest."""
    told = [one for one in found if one.informative]
    lost = [one.joint for one in found if not one.informative]
    beware = ['Inertias are those of the description or model: a stiffness is as right as they.']
    step = f'Record {", ".join(lost)} again under more load, or with finer encoders.'
    if lost:
        beware.append(f'{", ".join(lost)}: the twist does not follow the load.')
    if not told:
        shown = ['No joint shows a spring.']
        return VerdictSection('not identifiable', 'bad', shown, beware, step=step)
    softest = min(told, key=lambda one: one.transmission.stiffness[0])
    value, low, high = softest.transmission.stiffness
    sentences = [
        f'Stiffness of {len(told)} of {counted(len(found), "joint")} found; the softest is '
        f'{softest.joint} with {value:.4g} N m/rad ({low:.4g} to {high:.4g}, 95 %).'
    ]
    loose = [one.joint for one in told if one.transmission.backlash_seen]
    if loose:
        sentences.append(f'Free play is seen at {", ".join(loose)}.')
    if not lost:
        spring = f'joint_elasticity@{softest.joint}:compliance={1.0 / value:.3g}'
        step = f'Simulate with the springs: armid simulate --effect {spring}, and so for each.'
    grade, tone = ('partial', 'fair') if lost else ('found', 'good')
    return VerdictSection(grade, tone, sentences, beware, step=step)
