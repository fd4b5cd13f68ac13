# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sections on a simulated gait cycle: animation, foot forces and torque-driven joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from armid_ros.model.kinematics import points_motion
from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.exo.plant.gait import read_assumptions
from armid_ros.papers.exo.plant.gait_cycle import GaitCycle
from armid_ros.papers.exo.plant.torque_driven import GaitCheck
from armid_ros.papers.exo.plant.walkers import columns, contacts, floating, leg_length, SIDES
from armid_ros.report.blocks import DataTable, Panels, Paragraph
from armid_ros.report.charts import Chart, Role, script_json, Series
from armid_ros.report.page import Section, Templated
from armid_ros.robots import Robot
from markupsafe import Markup
import numpy as np

#: Scale of the drawing [px/m], and position of the ground [px].
_SCALE, _GROUND = 260.0, 385.0
_ABSCISSA = 'gait cycle of the right leg'


#: Relative error of the stiffness of straps that are too soft.
STIFFNESS_ERROR = 0.2
#: Largest position error of a torque-driven joint in the paper [deg].
SOURCE_ERROR = {'exo_right_hip': 1.5, 'exo_right_knee': 2.5}


class DrivenJoint(NamedTuple):
    """
    Simulated gait cycles in which three different torques drive one exoskeleton joint.

    Attributes
    ----------
    right, softer : GaitCheck
        With the right torque, and with the torque for straps that are too soft.
    shared : GaitCheck
        With the torque for forces on the feet by (20) to (22).

    """

    right: GaitCheck
    softer: GaitCheck
    shared: GaitCheck


class SimulatedWalk(NamedTuple):
    """
    Simulated gait cycle of exoskeleton and wearer, and results of torque-driven joints.

    Attributes
    ----------
    stiffness : float
        True stiffness of all straps [N/m].
    cycle : GaitCycle
        Simulated gait cycle.
    driven : sequence of DrivenJoint
        Joints driven by torque.

    """

    stiffness: float
    cycle: GaitCycle
    driven: Sequence[DrivenJoint]


@dataclass(frozen=True)
class Walk(Templated):
    """
    Animation of exoskeleton and wearer over a gait cycle.

    Attributes
    ----------
    walked : SimulatedWalk
        The gait cycle, and the torque-driven joints that the reader can choose.

    """

    package: ClassVar[str] = 'armid_ros.papers.exo.report'
    template: ClassVar[str] = 'walk.html'
    #: Width and height of the drawing, and height of the ground [px].
    size: ClassVar[tuple[int, int, float]] = (640, 420, _GROUND)

    walked: SimulatedWalk

    @property
    def choices(self) -> list[str]:
        """Labels of the motions that the reader of the page can choose."""
        names = [one.right.joint.removeprefix('exo_') for one in self.walked.driven]
        return [
            'as prescribed',
            *(
                f'{name.replace("_", " ")} by its torque (figure {3 + name.endswith("knee")})'
                for name in names
            ),
        ]

    @property
    def held(self) -> list[str]:
        """Largest external moments [N m] on the trunks of exoskeleton and wearer, as text."""
        cycle = self.walked.cycle
        return [f'{np.abs(one.trunk_moment).max():.0f}' for one in (cycle.own, cycle.other)]

    @property
    def data(self) -> Markup:
        """Coordinates of all drawn lines in each frame, as JSON for the animation script."""
        _, cycle, driven = self.walked
        rows = np.linspace(0, len(cycle.phase) - 1, 73).astype(int)[:-1]
        wearer = cycle.motions.other.select(rows)
        ahead = wearer.q[:, floating(cycle.pair.other)[0]]
        machines = [cycle.motions.own.select(rows)]
        machines += [one.right.motion.select(rows // 2) for one in driven]
        geometry = cycle.pair.geometry(machines[0], wearer)
        start = geometry.other_position[..., [0, 2]]
        end = start + 4.0 * geometry.way[..., [0, 2]]  # magnified four times for visibility
        arrows = []  # points and forces of ground contact: feet of the wearer, then of the machine
        for robot, motion, ground in (
            (cycle.pair.other, wearer, cycle.other.ground),
            (cycle.pair.robot, machines[0], cycle.own.ground),
        ):
            force = ground[rows].reshape(len(rows), 2, 2, 2)
            place = points_motion(robot, *contacts(robot), motion.q)[0]
            place = place[..., [0, 2]].reshape(len(rows), 2, 2, 2)
            up = force[..., 1:]
            middle = (place * up).sum(axis=2) / np.maximum(up.sum(axis=2), 1e-9)
            foot = _placed(np.where(up.sum(axis=2) > 0.0, middle, place[:, :, 0]), ahead)
            tip = foot + 0.16 * force.sum(axis=2) * np.array([1.0, -1.0])
            arrows.append(np.stack([foot, tip], axis=2))
        return script_json(
            {
                'phase': np.round(cycle.phase[rows], 3).tolist(),
                'ground': _whole(_SCALE * ahead),
                'wearer': _bodies(cycle.pair.other, wearer, ahead),
                'machine': [_bodies(cycle.pair.robot, m, ahead) for m in machines],
                'springs': _whole(_placed(np.stack([start, end], axis=2), ahead)),
                'feet': _whole(np.concatenate(arrows, axis=1)),
                'error': [
                    np.round(np.degrees(one.right.error[rows // 2]), 4).tolist() for one in driven
                ],
            }
        )


def feet_section(cycle: GaitCycle) -> Section:
    """Return the section with foot forces: simulated, and by equations of the paper."""
    text = (
        'Ground forces on the feet, by the contact model of Table 3 of the paper '
        '(100 N/mm^1.5, 1 N s/mm, friction 0.3). Vertical lines: changes between one and two feet '
        'on the ground. With two feet on the ground, the paper divides the trunk between the legs '
        'by the distances of the thighs, equations (20) to (22).'
    )
    heads = (
        'Machine', 'Weight [N]', 'Largest foot force [N]', 'Time on both feet',
        'Error of the paper [N rms]',
    )  # fmt: skip
    panels, rows = [], []
    for machine in (cycle.own, cycle.other):
        feet, rule = machine.feet[..., 1], machine.feet_by_shares()[..., 1]
        two, name = machine.support == 2, machine.robot.name
        series = [
            Series('right foot', feet[:, 0], 'residual'),
            Series('left foot', feet[:, 1], 'predicted'),
            Series('right, paper', np.where(two, rule[:, 0], np.nan), 'measured'),
            Series('left, paper', np.where(two, rule[:, 1], np.nan), 'before'),
        ]
        marks = [(float(cycle.phase[k]), '', False) for k in np.flatnonzero(np.diff(two)) + 1]
        chart = Chart(
            cycle.phase, series, _ABSCISSA, 'force up [N]', height=240, link='feet', marks=marks
        )
        panels.append((name, '', [chart]))
        rows.append(
            (
                name,
                f'{machine.weight:.0f}',
                f'{feet.max():.0f}',
                f'{100.0 * np.mean(two):.0f} %',
                f'{np.sqrt(np.mean((rule - feet)[two] ** 2)):.0f}',
            )
        )
    return Section('Feet', [Paragraph(text), Panels(panels), DataTable(heads, rows)])


def by_torque_section(walked: SimulatedWalk) -> Section:
    """Return the section with position errors of torque-driven joints, here and in the paper."""
    rate = read_assumptions()['torque_rate'].value
    text = (
        f'One joint follows its torque ({rate:g} samples per second, cubic splines). The hips are '
        'free, and all other joints move as prescribed. Largest errors over the gait cycle:'
    )
    soft = f'Straps {100.0 * STIFFNESS_ERROR:g} % too soft [°]'
    heads = ('Joint', 'Paper [°]', 'Here [°]', soft, 'Foot forces of the paper [°]')
    phase, rows, panels = walked.cycle.phase[::2], [], []
    for right, softer, shared in walked.driven:
        joint = right.joint
        errors = f'{right.most:.2g}', f'{softer.most:.2f}', f'{shared.most:.2f}'
        rows.append((joint, f'{SOURCE_ERROR[joint]:g}', *errors))
        both: tuple[tuple[str, GaitCheck, Role], ...] = (
            ('by its torque', right, 'residual'),
            ('straps too soft', softer, 'predicted'),
        )
        angles = [
            Series('prescribed', np.degrees(right.prescribed), 'measured'),
            *(Series(name, np.degrees(check.followed), role) for name, check, role in both),
        ]
        curves = [Series(name, np.degrees(check.error), role) for name, check, role in both]
        error = Chart(
            phase, curves, _ABSCISSA, 'error [°]', height=150, link=joint, symmetric=True,
            legend=False,
        )  # fmt: skip
        panels.append((joint, '', [Chart(phase, angles, '', 'angle [°]', link=joint), error]))
    return Section(
        'Joints driven by their torque', [Paragraph(text), DataTable(heads, rows), Panels(panels)]
    )


def _bodies(robot: Robot, motion: Motion, ahead: FloatArray) -> list[Any]:
    """Return the lines of trunk and legs in each frame of the animation [px]."""
    leg = leg_length(robot)
    lean = robot.joints[floating(robot)[2]]
    joints, points = [lean, lean], [[0.0, 0.0, 0.55], [0.0, 0.0, 0.0]]
    for side in SIDES:
        names = [robot.joints[k] for k in columns(robot, side)]
        joints += [*names, names[-1]]
        points += [[0.0, 0.0, 0.0]] * 3 + [[leg.foot, 0.0, 0.0]]
    place, _ = points_motion(robot, joints, np.array(points), motion.q)
    drawn = _placed(place[..., [0, 2]], ahead)
    return [_whole(drawn[:, part]) for part in (slice(0, 2), slice(2, 6), slice(6, 10))]


def _placed(points: FloatArray, ahead: FloatArray) -> FloatArray:
    """Convert points (forward, up) [m] to pixels of a drawing that follows the wearer."""
    shape = (-1,) + (1,) * (points.ndim - 2)
    x = 300.0 + _SCALE * (points[..., 0] - ahead.reshape(shape))
    return np.stack([x, _GROUND - _SCALE * points[..., 1]], axis=-1)


def _whole(values: FloatArray) -> list[Any]:
    """Round coordinates to 0.1 px."""
    return list(np.round(values, 1).tolist())
