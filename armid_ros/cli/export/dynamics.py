# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Export of the joint torque tau = f(q, dq, ddq) of an arm as code without dependencies."""

from __future__ import annotations

from importlib.resources import files
import re
from string import Template
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.arm.export import place_values
from armid_ros.effects import Effect, USUAL_EFFECTS
from armid_ros.errors import ModelError
import numpy as np
import numpy.typing as npt

#: Tables of the torque law by MJCF attribute; an offset has no attribute.
_TABLES = {'damping': 'VISCOUS', 'frictionloss': 'COULOMB', 'armature': 'ROTOR', '': 'OFFSET'}
#: Template, brackets of a table and prefix of a comment, for each language.
_LANGUAGES = {'cpp': ('torque.hpp', '{}', '//'), 'python': ('torque.py.txt', '[]', '#')}
#: Largest speed without Coulomb friction [rad/s or m/s]: the noise of a velocity at rest.
DEAD_BAND = 1e-3


def torque_tables(arm: ArmModel) -> tuple[dict[str, npt.NDArray[Any]], tuple[str, ...]]:
    """
    Return the constants of an arm's torque function as tables, one row per joint.

    Returns
    -------
    dict of str to ndarray, each of shape (n, ...)
        Geometry as in `JointGeometry`, inertial parameters with payloads, friction, offset and
        rotor inertia; and the gravity, shape (3,). The templates state what each is.
    tuple of str
        Parameters that the tables have no place for, as lines.

    """
    if arm.robot.mechanism is not None:
        raise ModelError(
            f'{arm.robot.name} has coupled joints, which the code cannot represent; use its '
            'model.yaml'
        )

    def table_of(effect: Effect) -> str:
        attribute = effect.traits.mjcf_attribute
        known = attribute or effect.name in USUAL_EFFECTS  # shipped law only
        return _TABLES.get(attribute, '') if known else ''

    placed, left_out = place_values(arm, table_of)
    rigid = arm.body.rigid_parameters.reshape(arm.robot.n_joints, -1)
    tables: dict[str, npt.NDArray[Any]] = {
        'GRAVITY': arm.body.gravity,
        'MASS': rigid[:, 0],
        'FIRST': rigid[:, 1:4],
        'INERTIA': rigid[:, [[4, 5, 7], [5, 6, 8], [7, 8, 9]]],
    }
    for name in ('parent', 'turn', 'slide', 'origin', 'sliding', 'turning'):
        tables[name.upper()] = np.array([getattr(joint, name) for joint in arm.body.geometry])
    for name in _TABLES.values():
        values = placed.get(name, {})
        tables[name] = np.array([values.get(joint, 0.0) for joint in arm.robot.joints])
    return tables, left_out


def torque_code(arm: ArmModel, language: str, source: str) -> tuple[str, tuple[str, ...]]:
    """
    Return source code of an arm's joint torques, and the parameters that the code omits.

    The language is 'cpp', a C++17 header with torque(q, dq, ddq, tau), or 'python', a module with
    torque(q, dq, ddq) that returns tau; neither needs more than the standard library. A
    comment names the source of the arm, and each parameter of an effect that is not in the code.

    """
    template, brackets, comment = _LANGUAGES[language]
    tables, left_out = torque_tables(arm)
    lines = [
        f'Joint torque of {arm.robot.name}: written by armid export, from {source}.',
        f'Joints: {", ".join(arm.robot.joints)}.',
    ]
    if left_out:
        lines += ['The model has these too, which are not in the torque:', *left_out]
    law = files('armid_ros.cli.export').joinpath('templates', template).read_text('utf-8')
    text = Template(law).substitute(
        {name: _nested(values.tolist(), brackets, '\n') for name, values in tables.items()},
        comment='\n'.join(f'{comment} {" ".join(line.split())}' for line in lines),
        name='armid_' + re.sub(r'\W', '_', arm.robot.name, flags=re.ASCII),
        n=arm.robot.n_joints,
        joints=', '.join(map(repr, arm.robot.joints)),
        dead_band=DEAD_BAND,
    )
    return text, left_out


def _nested(values: Any, brackets: str, apart: str = ' ') -> str:
    """Format nested lists with a language's brackets; `apart` separates outer elements."""
    if not isinstance(values, list):
        return repr(values)
    apart = apart if isinstance(values[0], list) else ' '
    inner = f',{apart}'.join(_nested(row, brackets) for row in values)
    return f'{brackets[0]}{apart.strip(" ")}{inner}{brackets[1]}'
