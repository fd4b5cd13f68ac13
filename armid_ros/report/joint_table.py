# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An identification joint by joint: torque error, friction, difference from the description."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.identification import Identification, Score
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.report.families import estimate_text
from armid_ros.report.notation import digits, pretty
import numpy as np

#: Heads of the columns of friction, and the parameters in them.
_FRICTION = {'viscous': 'viscous_coefficient', 'Coulomb': 'coulomb_torque'}


def joint_columns(
    result: Identification, description: ArmModel, held_out: Score | None
) -> dict[str, list[str]]:
    """
    Return the columns of a table with a row for each joint, by their heads.

    Parameters
    ----------
    result : Identification
        The identified model.
    description : ArmModel
        The model before.
    held_out : Score or None
        Errors on held-out recordings; those of the fit without.

    """
    estimate, joints = result.estimate, result.arm.robot.joints
    errors = (held_out or Score.of(result.training)).joint_relative_error_percent
    head = 'error (fit)' if held_out is None else 'error'
    columns = {'joint': list(joints), head: [f'{digits(error)} %' for error in errors]}
    for head, parameter in _FRICTION.items():
        own = [k for k, one in enumerate(estimate.parameters) if one.name == parameter]
        units = {estimate.parameters[k].unit for k in own}
        cells = dict.fromkeys(joints, '-')
        for k in own:
            number, reach = estimate_text(float(estimate.values[k]), float(estimate.std[k]))
            name = estimate.parameters[k]
            unit = '' if len(units) == 1 else f' {pretty(name.unit)}'
            cells[name.joint] = f'{number.replace("includes 0", "0")} ± {reach}{unit}'
        if own:
            unit = f' [{pretty(units.pop())}]' if len(units) == 1 else ''
            columns[f'{head}{unit}'] = [cells[joint] for joint in joints]
    described = result.base.values(description.theta)
    differs = np.abs(estimate.values - described) > HALF_WIDTH * estimate.std
    rigid = [
        [k for k, one in enumerate(estimate.parameters) if one.rigid and one.joint == joint]
        for joint in joints
    ]
    columns['not as URDF'] = [f'{differs[own].sum()} of {len(own)}' for own in rigid]
    return columns
