# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The learned residual: torque over position and velocity, and its standard deviation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.effects.learned import TorqueMap
from armid_ros.motion import FloatArray
from armid_ros.report.blocks import ContentSection, DataTable, Paragraph, SmallMultiples, TableCell
from armid_ros.report.charts import image_data
from armid_ros.report.notation import digits, percent
from armid_ros.report.page import render
from armid_ros.residual.law import Law
from markupsafe import Markup
import numpy as np


@dataclass(frozen=True)
class JointResidual:
    """
    The learned map and the suggested law of one joint.

    Attributes
    ----------
    joint : str
        The joint.
    learned : TorqueMap
        The map.
    ranges : ndarray, shape (3, 2)
        Smallest and largest position, velocity and load in the data.
    before, after : float
        Root mean square of the residual without and with the map [N m].
    gain : float
        Share of the squared residual that the map predicts in held-out data: blocks left out in
        turn, and samples of held-out recordings near the training data.
    held_out : float or None
        The same share for held-out recordings alone; None if none is near the training data.
    law : Law or None
        Suggested law; None if no law approximates the residual.

    """

    joint: str
    learned: TorqueMap
    ranges: FloatArray
    before: float
    after: float
    gain: float
    held_out: float | None
    law: Law | None

    def axis(self, number: int, count: int) -> FloatArray:
        """Return evenly spaced values over the range of an input, shape (count,)."""
        return np.linspace(float(self.ranges[number, 0]), float(self.ranges[number, 1]), count)


def residual_map_section(
    arm: ArmModel, joints: Sequence[JointResidual], table_file: str
) -> ContentSection:
    """Return maps of the unexplained residual at the middle load of some joints."""
    robot = arm.robot
    rows, pictures = [], []
    for one in joints:
        j = robot.joints.index(one.joint)
        unit, length = robot.torque_units[j], robot.position_units[j]
        held_out = '' if one.held_out is None else percent(one.held_out)
        if one.held_out is not None and one.held_out < 0.0:
            held_out = 'worse'
        rows.append(
            (
                one.joint,
                f'{digits(one.before)} {unit}',
                f'{digits(one.after)} {unit}',
                percent(one.gain),
                held_out,
                TableCell('no simple law' if one.law is None else one.law.text, 'law'),
                '' if one.law is None else percent(one.law.share),
            )
        )
        pictures += _pictures(one, unit, length)
    heads = (
        'Joint',
        'Residual, rms',
        'With the map',
        'Share, map',
        'Held-out alone',
        'Looks like',
        'Share, law',
    )
    return ContentSection(
        'Learned residual',
        [
            Paragraph(
                'No effect of the catalogue explains the residual of these joints. A Gaussian '
                'process over position, velocity and load has learned it. model.yaml has it as '
                f'an effect, {table_file} as a table. It is zero where there were no '
                'data. Shares are of the squared residual in cross-validation, and in held-out '
                'recordings close to the data.'
            ),
            DataTable(heads, rows, (0, 5)),
            Paragraph(
                'q: position, dq: velocity, w: gravity torque. A law is a suggestion: write it as '
                'an effect of your own if it is plausible, and diagnose again.',
                'hint',
            ),
            SmallMultiples(pictures),
        ],
    )


def _pictures(one: JointResidual, unit: str, length: str) -> list[tuple[str, str, Markup, str]]:
    """Return pictures of torque and deviation at the middle load, the largest velocity on top."""
    # cells along position and velocity
    q, dq = (one.axis(number, count) for number, count in enumerate((80, 60)))
    load = np.full((len(dq), len(q)), one.ranges[2].mean())
    inputs = np.stack([*np.meshgrid(q, dq[::-1]), load], axis=-1)
    torque, std = one.learned.torque(inputs), one.learned.std(inputs)
    peak = max(float(np.abs(torque).max()), 1e-12)
    row, column = np.unravel_index(np.argmax(np.abs(torque)), torque.shape)
    most = f'most at {digits(q[column])} {length} and {digits(dq[::-1][row])} {length}/s'
    blue, orange = (0.0, 0.447, 0.698), (0.835, 0.369, 0.0)
    colours = np.where((torque >= 0.0)[..., None], blue, orange)
    unsure = f'{digits(one.learned.amplitude)} {unit}'
    ends = {
        **{name: f'{digits(x)} {length}' for name, x in (('left', q[0]), ('right', q[-1]))},
        **{name: f'{digits(x)} {length}/s' for name, x in (('low', dq[0]), ('high', dq[-1]))},
    }
    maps = (
        (
            f'{one.joint}: torque, blue up to {digits(peak)} {unit}, orange down to '
            f'-{digits(peak)} {unit}',
            image_data(colours, torque / peak),
            f'Learned torque of {one.joint} over position and velocity, {most}',
        ),
        (
            f'{one.joint}: standard deviation (shaded: large; {unsure} far from data)',
            image_data(np.broadcast_to(0.5, (*std.shape, 3)), std / one.learned.amplitude),
            'Standard deviation of that torque',
        ),
    )
    return [
        (caption, '', render('heat_map.html', {'image': image, 'words': words, **ends}), 'heat')
        for caption, image, words in maps
    ]
