# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Springs of any arm, joint by joint, for `armid elastic`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armid_ros.cli import options
from armid_ros.cli.options import provenance
from armid_ros.cli.terminal import progress
from armid_ros.errors import RecordingError
from armid_ros.files import json_text, write_file
from armid_ros.papers.elastic.identification.files import read_sides
from armid_ros.papers.elastic.identification.joints import fit_springs, SpringEstimate
from armid_ros.papers.elastic.identification.output import springs_document, SPRINGS_SCHEMA
from armid_ros.papers.elastic.report.springs import springs_report, verdict
from armid_ros.recording.elastic import LINK
from armid_ros.robots import Robot
import click
import numpy as np

WITHOUT = (
    'with encoders at the motors alone, `armid diagnose`, or `armid identify --effects '
    '...,joint_elasticity`, looks for springs'
)


def identify_springs(
    bags: Sequence[Path], robot: Robot, source: str, model: Path | None, out: Path, seed: int,
    as_json: bool,
) -> None:  # fmt: skip
    """Fit springs to bags with both encoders of any arm, and write the results."""
    staged = options.stage(out, SPRINGS_SCHEMA, source)
    body = robot if model is None else options.model_of(model, robot).body
    if not bags:
        raise RecordingError('no bag is named; give one with encoders on both sides of the joints')
    with progress('reading') as tick:
        try:
            sides = [read_sides(path, robot, options.read_settings()) for path in bags]
        except RecordingError as error:
            hint = f'; {WITHOUT}' if LINK in str(error) else ''
            raise RecordingError(f'{error}{hint}') from None
        options.tell_damage(*(side for both in sides for side in both))
        tick(0.5, 'fitting')
        found = fit_springs(body, sides, np.random.default_rng(seed))
    document = springs_document(found, source)
    write_file(staged.folder / 'elastic.json', json_text(document, indent=1))
    origin = provenance(bags, {'model': str(model or source)})
    page = springs_report(found, robot.name, origin)
    write_file(staged.folder / 'report.html', page)
    staged.keep()
    if as_json:
        click.echo(json_text(document))
        return
    heads = ('joint', 'stiffness [N m/rad]', '95 %', 'free play', 'rotor', 'resonance')
    files = f'{out}: elastic.json, report.html'
    options.show_verdict(verdict(found), heads, [_row(one) for one in found], files)


def _row(found: SpringEstimate) -> tuple[str, ...]:
    """Return what was found of a joint; dashes for what the recording does not show."""
    if not found.informative:
        return (found.joint, *['-'] * 5)
    fit = found.transmission
    stiffness, low, high = fit.stiffness
    play = '-' if not np.isfinite(fit.correlation) else 'none seen'
    return (
        found.joint,
        f'{stiffness:.4g}',
        f'{low:.4g} to {high:.4g}',
        f'{fit.backlash[0]:.2g} rad' if fit.backlash_seen else play,
        '-' if found.motor is None else f'{found.motor[0]:.3g} kg m^2',
        f'{found.resonance:.1f} Hz' if np.isfinite(found.resonance) else '-',
    )
