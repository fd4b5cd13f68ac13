# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identification and report of joint stiffness in arms with encoders on motors and links."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from armid_ros.cli import options
from armid_ros.cli.options import provenance
from armid_ros.cli.terminal import progress
from armid_ros.errors import RecordingError
from armid_ros.papers.elastic.identification.files import read_sides
from armid_ros.papers.elastic.identification.joints import fit_springs, SpringEstimate
from armid_ros.recording.elastic import LINK
from armid_ros.report.blocks import DataTable, Paragraph, VerdictSection
from armid_ros.report.notation import counted
from armid_ros.report.page import Page, Section
from armid_ros.robots import Robot
import numpy as np

SPRINGS_SCHEMA = 'armid/springs/1'
_SPRINGS = (
    'Joint', 'Stiffness [N m/rad]', '95 %', 'Backlash [mrad], 95 %', 'Correlation', 'R²'
)  # fmt: skip
_MOTORS = (
    'Joint', 'Link [kg m²]', 'Rotor [kg m²]', 'Viscous [N m s/rad]', 'Coulomb [N m]',
    'Antiresonance [Hz]', 'Resonance [Hz]',
)  # fmt: skip


def _springs(found: Sequence[SpringEstimate]) -> Section:
    """Return the section with stiffness, backlash, inertia and friction of each joint."""
    text = (
        'The twist between motor and link is the rigid-body torque divided by the stiffness. '
        'Backlash adds a step where the load changes its sign. If their correlation is near ±1, '
        'stiffness and backlash are not distinguishable. R² is the explained share of the twist.'
    )
    hint = (
        'Frequencies of a joint while the other joints are locked, at its mean inertia in the '
        'recording.'
    )
    springs = DataTable(_SPRINGS, [_spring_row(one) for one in found])
    motors = DataTable(_MOTORS, [_motor_row(one) for one in found])
    return Section('Springs', [Paragraph(text), springs, motors, Paragraph(hint, 'hint')])


def _spring_row(one: SpringEstimate) -> tuple[str, ...]:
    fit = one.transmission
    value, low, high = fit.stiffness
    play = [1e3 * x for x in fit.backlash]
    none = 'none seen' if np.isfinite(play).all() else 'no reversals'
    return (
        one.joint,
        f'{value:.4g}' if one.informative else 'not identifiable',
        f'{low:.4g} to {high:.4g}' if one.informative else '',
        f'{play[1]:.2g} to {play[2]:.2g}' if fit.backlash_seen else none,
        f'{fit.correlation:+.2f}' if np.isfinite(fit.correlation) else '',
        f'{fit.explained:.4f}',
    )


def _motor_row(one: SpringEstimate) -> tuple[str, ...]:
    own = ['', '', ''] if one.motor is None else [f'{x:.3g}' for x in one.motor]
    both = [
        f'{x:.1f}' if one.informative and np.isfinite(x) else ''
        for x in (one.antiresonance, one.resonance)
    ]
    return (one.joint, f'{one.inertia:.3g}', *own, *both)


def verdict(found: Sequence[SpringEstimate]) -> VerdictSection:
    """Return the verdict box: number of identified stiffnesses, and the softest joint."""
    known = [one for one in found if one.informative]
    lost = [one.joint for one in found if not one.informative]
    beware = [
        'Link inertias are those of the description or model; their errors change the stiffness.'
    ]
    step = f'Record {", ".join(lost)} again under more load, or with finer encoders.'
    if lost:
        beware.append(f'{", ".join(lost)}: the twist does not depend on the load.')
    if not known:
        shown = ['The stiffness of no joint was identified.']
        return VerdictSection('not identifiable', 'bad', shown, beware, step=step)
    softest = min(known, key=lambda one: one.transmission.stiffness[0])
    value, low, high = softest.transmission.stiffness
    sentences = [
        f'Stiffness of {len(known)} of {counted(len(found), "joint")} found; the softest joint is '
        f'{softest.joint} with {value:.4g} N m/rad ({low:.4g} to {high:.4g}, 95 %).'
    ]
    loose = [one.joint for one in known if one.transmission.backlash_seen]
    if loose:
        sentences.append(f'{", ".join(loose)}: backlash is significant.')
    if not lost:
        spring = f'joint_elasticity@{softest.joint}:compliance={1.0 / value:.3g}'
        step = f'Simulate the springs: armid simulate --effect {spring}, one --effect per joint.'
    grade, tone = ('partial', 'fair') if lost else ('found', 'good')
    return VerdictSection(grade, tone, sentences, beware, step=step)


WITHOUT = (
    'without encoders at the links, use `armid diagnose` or `armid identify --effects '
    '...,joint_elasticity`'
)


def identify_springs(
    bags: Sequence[Path], robot: Robot, source: str, model: Path | None, out: Path,
    as_json: bool,
) -> None:  # fmt: skip
    """Fit the stiffness of each joint to bags with motor and link encoders; write results."""
    staged = options.stage(out, SPRINGS_SCHEMA, source)
    body = robot if model is None else options.model_of(model, robot).body
    if not bags:
        raise RecordingError(
            'no bag is named; name a bag with encoders on both sides of the joints'
        )
    with progress('reading') as tick:
        try:
            sides = [read_sides(path, robot, options.read_settings()) for path in bags]
        except RecordingError as error:
            hint = f'; {WITHOUT}' if LINK in str(error) else ''
            raise RecordingError(f'{error}{hint}') from None
        options.tell_damage(*(side for both in sides for side in both))
        tick(0.5, 'fitting')
        found = fit_springs(body, sides)
    document = springs_document(found, source)
    origin = provenance(bags, {'model': str(model or source)})
    subtitle = f'{robot.name} · {counted(len(found), "joint")}, encoders on both sides'
    title, box = f'Elastic joints of {robot.name}', verdict(found)
    page = Page(title, subtitle, box, [_springs(found)], origin).html()
    table = None if as_json else (_SPRINGS, [_spring_row(one) for one in found])
    options.deliver_page(staged, page, 'elastic', document, box, table)


def springs_document(found: Sequence[SpringEstimate], robot: str) -> dict[str, Any]:
    """Return the content of elastic.json: stiffness, backlash and inertia of each joint."""

    def number(value: float) -> float | None:
        return float(value) if np.isfinite(value) else None

    return {
        'schema': SPRINGS_SCHEMA,
        'robot': robot,
        'joints': [
            {
                'joint': one.joint,
                'told': one.informative,
                'stiffness': number(one.transmission.stiffness[0]),
                'stiffness_interval': [number(x) for x in one.transmission.stiffness[1:]],
                'stiffness_unit': 'N m/rad',
                'backlash': number(one.transmission.backlash[0]),
                'backlash_interval': [number(x) for x in one.transmission.backlash[1:]],
                'backlash_unit': 'rad',
                'backlash_seen': one.transmission.backlash_seen,
                'correlation': number(one.transmission.correlation),
                'explained': number(one.transmission.explained),
                'encoder_delay_s': number(one.transmission.delay[0]),
                'link_inertia': one.inertia,
                'rotor_inertia': None if one.motor is None else float(one.motor[0]),
                'viscous_coefficient': None if one.motor is None else float(one.motor[1]),
                'coulomb_torque': None if one.motor is None else float(one.motor[2]),
                'antiresonance_hz': number(one.antiresonance),
                'resonance_hz': number(one.resonance),
            }
            for one in found
        ],
    }
