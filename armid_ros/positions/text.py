# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Terminal summary and JSON document of ``armid positions``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from armid_ros import Robot
from armid_ros.api.table import Summary
from armid_ros.estimate import measured
from armid_ros.positions.fit import MAX_RESIDUAL_TO_NOISE, PositionFit, Run
from armid_ros.recording import Recording
import numpy as np

SCHEMA = 'armid/positions/1'
#: Quantities of the joints in the table, and their headings.
_COLUMNS = {
    'position_gain': 'kp',
    'velocity_gain': 'kd',
    'rotor_inertia': 'rotor',
    'viscous_coefficient': 'viscous',
    'coulomb_torque': 'Coulomb',
}


def limit_hints(runs: Sequence[Run], torques: Sequence[Recording], robot: Robot) -> list[str]:
    """Return a hint for each joint with commands beyond position limits or torques at limits."""
    commands = np.concatenate([commands.q for _, commands in runs])
    torque = np.concatenate([one.tau for one in torques if one.tau is not None])
    beyond = np.mean((commands < robot.lower) | (commands > robot.upper), axis=0)
    reached = np.mean(np.abs(torque) > 0.99 * robot.torque_limit, axis=0)
    return [
        f'{joint}: {100.0 * share:.3g} % of the {text}'
        for shares, text in (
            (beyond, 'commands lie beyond its position limits; hard stops are not modelled'),
            (reached, 'torques reach the limit of the drive, which is not modelled; move slower'),
        )
        for joint, share in zip(robot.joints, shares, strict=True)
        if share > 0.001
    ]


def fit_document(found: PositionFit, hints: Sequence[str] = ()) -> dict[str, Any]:
    """Return the JSON document of a fit, the content of positions.json."""
    poor = bool(np.any(found.residual > 0.3 * found.tracking))
    std = [float(one) if np.isfinite(one) else None for one in found.std]
    values = zip(found.parameters, found.values.tolist(), std, found.reasons, strict=True)
    columns = 'tracking', 'residual', 'noise', 'gain_ratio', 'gain_ratio_std'
    rows = zip(*(getattr(found, name).tolist() for name in columns), strict=True)
    coloured = [
        f'{joint}: the residual is {rest / noise:.2g} times the noise of the positions: an effect '
        'is not modelled (soft or load-dependent friction, an elastic joint), or --gains are wrong'
        for joint, rest, noise in zip(
            found.arm.robot.joints, found.residual, found.noise, strict=True
        )
        if rest > MAX_RESIDUAL_TO_NOISE * noise
    ]
    partial = _reasons(found) or coloured or hints
    return {
        'schema': SCHEMA,
        'robot': found.arm.robot.name,
        'verdict': 'not explained' if poor else 'in part' if partial else 'determined',
        'duration': found.duration,
        'quantities': [
            {
                'name': one.name,
                'joint': one.joint,
                'unit': one.unit,
                'value': value,
                'std': error,
                'reason': reason,
            }
            for one, value, error, reason in values
        ],
        'joints': [
            {'joint': joint, **dict(zip(columns, row, strict=True))}
            for joint, row in zip(found.arm.robot.joints, rows, strict=True)
        ],
        'hints': [*coloured, *hints],
    }


def _reasons(found: PositionFit) -> dict[str, list[str]]:
    """Return undetermined parameters as a mapping from reasons to parameter names."""
    mass, std = found.of('payload_m', found.arm.robot.joints[-1])
    absent, reasons = mass < 1.96 * std, dict[str, list[str]]()
    for one, reason in zip(found.parameters, found.reasons, strict=True):
        if reason and not (absent and one.name.startswith('payload_center')):
            reasons.setdefault(reason, []).append(f'{one.words} {one.joint}'.strip())
    return reasons


def fit_summary(found: PositionFit, document: dict[str, Any], step: str) -> Summary:
    """Return the terminal summary of a fit; `step` is the user's next step after a good fit."""
    verdict = document['verdict']
    joints = found.arm.robot.joints

    def cell(name: str, joint: str = '', factor: float = 1.0) -> str:
        value, std = found.of(name, joint)
        if not np.isfinite(std):
            return 'not det.'
        # all quantities but the centre of mass are positive, and have an upper limit at least
        positive = not name.startswith('payload_center')
        if positive and 0.0 < std and value < 1.96 * std:
            return f'< {measured(value + 1.96 * std, 1.96 * std)[0]}'
        text, half = measured(factor * value, factor * 1.96 * std)
        return f'{text} ± {half}' if std else f'{text} (given)'

    rows = [
        (
            joint,
            *(cell(name, joint) for name in _COLUMNS),
            f'{1e3 * rest:.2g} of {1e3 * behind:.2g}',
        )
        for joint, rest, behind in zip(joints, found.residual, found.tracking, strict=True)
    ]
    center = [cell(f'payload_center_{a}', joints[-1]).split(' ± ')[0] for a in 'xyz']
    mass = cell('payload_m', joints[-1])
    tool = f'none ({mass} kg)' if '<' in mass else f'{mass} kg at {", ".join(center)} m'
    title = f'command delay {cell("command_delay", factor=1e3)} ms, tool {tool}'
    lines = [f'{found.duration:.0f} s compared; links are assumed as described']
    ratio, error = found.gain_ratio, found.gain_ratio_std
    if error.any():
        # by more than three standard errors and 2 %
        differs = np.abs(ratio - 1.0) > np.maximum(3.0 * error, 0.02)
        text = f'agree with the data within {100.0 * 1.96 * error.max():.2g} %'
        if differs.any():
            places = np.flatnonzero(differs)
            text = 'differ from the data, which fit ' + ', '.join(
                f'{ratio[k]:.3g} ± {1.96 * error[k]:.1g} times that of {joints[k]}' for k in places
            )
        lines.append(f'given position gains {text}')
    for reason, names in _reasons(found).items():
        text = ', '.join(names) if len(names) < 9 else f'{len(names)} values'
        lines.append(f'not determined: {text}: {reason}')
    lines += document['hints']
    if verdict == 'not explained':
        step = (
            'check --robot, --gravity, --gains, --commands, contacts, and whether the controller '
            'compensates gravity (--gravity-compensation)'
        )
    heads = 'joint', *_COLUMNS.values(), 'residual [mrad or mm]'
    return Summary(title, verdict, heads, rows, lines, [step])
