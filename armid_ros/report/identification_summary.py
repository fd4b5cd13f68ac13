# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An identification on one screen of a terminal: grade, error and friction by joint, next step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from armid_ros.arm import ArmModel
from armid_ros.identification import Fit, Grade, Identification, Score, Verification
from armid_ros.identification.fitting.identifiability import excludes_zero, HALF_WIDTH
from armid_ros.recording import Recording
from armid_ros.report.judgement import judge, residual_trends
from armid_ros.report.notation import counted, digits, measured, pretty
import numpy as np

#: Heads of the columns of friction, and the parameters in them.
_FRICTION = {'viscous': 'viscous_coefficient', 'Coulomb': 'coulomb_torque'}


def headline(
    graded: Grade,
    result: Identification,
    validation: Mapping[str, Sequence[Fit]],
    verification: Verification | None = None,
) -> list[str]:
    """Return the grade with its reasons, and what the residual still depends on."""
    first, *others = graded.reasons
    if verification is not None and verification.unfit:
        others = [f'The model cannot be simulated: {verification.unfit}.', *others]
    shown = [fit for fits in validation.values() for fit in fits] or result.training
    trends = residual_trends(result.arm.robot.joints, shown).values()
    return [f'{graded.word}: {first}', *others, *trends]


def joint_table(
    result: Identification, description: ArmModel, validation: Mapping[str, Sequence[Fit]]
) -> list[str]:
    """
    Return a table with a line for each joint: torque error, friction, difference from the URDF.

    Parameters
    ----------
    result : Identification
        The identified model.
    description : ArmModel
        The model before.
    validation : mapping of str to sequence of Fit
        Predictions of held-out recordings; the errors are theirs where there are any.

    """
    robot, estimate = result.arm.robot, result.estimate
    held_out = [fit for fits in validation.values() for fit in fits]
    errors = Score.of(held_out or result.training).joint_relative_error_percent
    found = {
        name: (float(value), float(std))
        for name, value, std in zip(
            estimate.parameters, estimate.values, estimate.std, strict=True
        )
    }
    columns = {
        'joint': list(robot.joints),
        f'error, {"held out" if held_out else "fit"}': [f'{digits(error)} %' for error in errors],
    }
    for head, parameter in _FRICTION.items():
        own = [one for one in found if one.name == parameter]
        units = {one.unit for one in own}
        cells = {
            one.joint: _value(*found[one], '' if len(units) == 1 else f' {pretty(one.unit)}')
            for one in own
        }
        if own:
            unit = f' [{pretty(units.pop())}]' if len(units) == 1 else ''
            columns[f'{head}{unit}'] = [cells.get(joint, '-') for joint in robot.joints]
    described = result.base.values(description.theta)
    differs = np.abs(estimate.values - described) > HALF_WIDTH * estimate.std
    rigid = [
        [k for k, one in enumerate(estimate.parameters) if one.rigid and one.joint == joint]
        for joint in robot.joints
    ]
    columns['not as in URDF'] = [f'{differs[own].sum()} of {len(own)}' for own in rigid]
    widths = [max(map(len, (head, *cells))) for head, cells in columns.items()]
    return [
        '  '.join(
            cell.rjust(width) if number else cell.ljust(width)
            for number, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in (tuple(columns), *zip(*columns.values(), strict=True))
    ]


def summary(
    result: Identification,
    validation: Mapping[str, Sequence[Fit]],
    recordings: Sequence[Recording],
    verification: Verification | None = None,
) -> list[str]:
    """
    Return damage of the recordings, the number of parameters known, and the next step.

    Parameters
    ----------
    result : Identification
        The identified model.
    validation : mapping of str to sequence of Fit
        Predictions of held-out recordings.
    recordings : sequence of Recording
        All that were read.
    verification : Verification, optional
        Checks of the identified model.

    """
    estimate = result.estimate
    known = int(np.sum(excludes_zero(estimate.values, estimate.std)))
    lines = [
        f'{one.source}: {one.report.describe()}'
        for one in recordings
        if one.report.unwrapped or not one.report.unharmed
    ]
    total = len(estimate.parameters)
    text = f'{known} of {counted(total, "parameter")} differ from zero'
    unseen = sum(one.parameter not in estimate.parameters for one in result.unidentified)
    if unseen:
        text += f'; {unseen} more cannot be identified from this motion'
    lines.append(f'{text}; condition number {result.condition_number:.3g}')
    steps = judge(result, validation, recordings, verification).next_steps
    return [*lines, *(f'next: {step}' for step in steps[:1])]


def _value(value: float, std: float, unit: str) -> str:
    """Return a value with its 95 % interval; no number where that includes zero."""
    number, reach = measured(value, HALF_WIDTH * std)
    return f'{number if excludes_zero(value, std) else "0"} ± {reach}{unit}'
