# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Summary and document of ``armid zero``."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import asdict
from typing import Any

from armid_ros.api.table import Summary
from armid_ros.report.notation import measured
from armid_ros.zero.fit import FittedQuantity, MORE, ZeroFit
import numpy as np

SCHEMA = 'armid/zero/1'


def fit_document(
    found: ZeroFit, known: Collection[str], link_error: float, external: bool
) -> dict[str, Any]:
    """Return the content of zero.json."""
    gains = [one.value for one in found.quantities if one.name == 'gain' and not one.reason]
    links = f'links within {100.0 * link_error:g} %' if link_error else 'links as described'
    held = [links, *known]
    held += [] if 'gain' in known else [f'gravity of {found.of("gravity").value:.4g} m/s^2']
    verdict = 'in part' if any(one.reason for one in found.quantities) else 'determined'
    if all(one.reason for one in found.quantities if one.name == 'zero'):
        verdict = 'not determined'
    # readings are explained to a tenth of the largest one of the joint
    if np.any(found.residual > 0.1 * found.largest) or min(gains, default=1.0) < 0.0:
        verdict = 'not explained'
    rms = zip(found.arm.robot.joints, found.before, found.residual, strict=True)
    return {
        'schema': SCHEMA,
        'robot': found.arm.robot.name,
        'verdict': verdict,
        'external': external,
        'held': held,
        'rests': found.rests,
        'poses': found.poses,
        'outliers': found.outliers,
        'quantities': [asdict(one) for one in found.quantities],
        'joints': [{'joint': j, 'before': float(b), 'residual': float(r)} for j, b, r in rms],
    }


def fit_summary(found: ZeroFit, document: dict[str, Any], step: str) -> Summary:
    """Return the summary of a fit; `step` is the next step after a good fit."""
    names = ('zero', 'gain', 'friction')
    rows = [
        (joint, *(_cell(found.of(name, joint)) for name in names), f'{residual:.2g}')
        for joint, residual in zip(found.arm.robot.joints, found.residual, strict=True)
    ]
    tilt, mass = found.of('tilt'), found.of('mass')
    center = [found.of(f'center_{axis}') for axis in 'xyz']
    parts = []
    if tilt.half_width and not tilt.reason:
        parts.append(f'base tilted by {_cell(tilt)} deg')
    if mass.half_width and not mass.reason:
        place = f' at {", ".join(_cell(one).split(" ± ")[0] for one in center)} m'
        known = any(not one.reason for one in center)
        parts.append(f'tool of {_cell(mass)} kg{place if known else ""}')
    determined = sum(not one.reason for one in found.quantities)
    title = ', '.join(parts) or f'{determined} of {len(found.quantities)} quantities'
    lines = [
        f'{found.rests} rests in {found.poses} poses; {found.outliers} outliers left out; '
        f'held known: {", ".join(document["held"])}'
    ]
    undetermined: dict[str, list[str]] = {}
    for one in found.quantities:
        if one.reason:
            undetermined.setdefault(one.reason, []).append(f'{one.name} {one.joint}'.strip())
    for why, which in undetermined.items():
        text = ', '.join(which) if len(which) < 9 else f'{len(which)} values'
        lines.append(f'not determined: {text}: {why}')
    if document['verdict'] == 'not explained':
        step = 'check --robot, --gravity, --effort-scale and contacts of the arm'
    elif document['verdict'] == 'not determined':
        step = MORE
    heads = ('joint', *names, 'residual [N m or N]')
    return Summary(title, document['verdict'], heads, rows, lines, [step])


def _cell(one: FittedQuantity) -> str:
    """Write a quantity with its interval."""
    if one.reason:
        return 'not det.'
    value, half = measured(one.value, one.half_width)
    return f'{value} ± {half}' if one.half_width else f'{value} (known)'
