# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sections on a whole cycle of walking: both bodies, forces on the feet, torque-driven joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from armid_ros.model.kinematics import points_motion
from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.exo.plant.gait_cycle import feet_by_shares, GaitCycle, weight
from armid_ros.papers.exo.plant.torque_driven import GaitCheck
from armid_ros.papers.exo.plant.walkers import columns, contacts, floating, leg_length, SIDES
from armid_ros.report.blocks import ContentSection, DataTable, Panels, Paragraph
from armid_ros.report.charts import Chart, Role, script_json, Series
from armid_ros.report.page import Section
from armid_ros.robots import Robot
from markupsafe import Markup
import numpy as np

#: Scale of the drawing [px/m], and position of the ground [px].
_SCALE, _GROUND = 260.0, 385.0
_ABSCISSA = 'gait cycle of the right leg'


@dataclass(frozen=True)
class Driven:
    """
    Results for a joint driven by its torque.

    Attributes
    ----------
    right, softer : GaitCheck
        Results with the right torque, and with the torque for springs that are too soft.
    shared : GaitCheck
        Result with the torque for forces on the feet by (20) to (22).

    """

    right: GaitCheck
    softer: GaitCheck
    shared: GaitCheck

    @property
    def joint(self) -> str:
        """Its name."""
        return self.right.joint

    @property
    def source(self) -> float:
        """Largest error of the joint position in the source [deg]."""
        return {'hip': 1.5, 'knee': 2.5}[self.joint.split('_')[-1]]


@dataclass(frozen=True)
class SimulatedWalk:
    """
    True values of a simulated pair.

    Attributes
    ----------
    truth : mapping of str to float
        True stiffnesses [N/m].
    cycle : GaitCycle
        A whole cycle of walking.
    driven : sequence of Driven
        Joints driven by torque over this cycle.
    softer : float
        Relative error of the stiffness of springs that are too soft.
    rate : float
        Torque samples per second.

    """

    truth: Mapping[str, float]
    cycle: GaitCycle
    driven: Sequence[Driven]
    softer: float
    rate: float


@dataclass(frozen=True)
class Walk(Section):
    """
    Animation of both bodies over a cycle.

    Attributes
    ----------
    cycle : GaitCycle
        The motion of both bodies.
    driven : sequence of Driven
        Joints driven by torque, to choose from.

    """

    title: ClassVar[str] = 'Walking'
    package: ClassVar[str] = 'armid_ros.papers.exo.report'
    template: ClassVar[str] = 'walk.html'
    #: Width and height of the drawing, and height of the ground [px].
    size: ClassVar[tuple[int, int, float]] = (640, 420, _GROUND)

    cycle: GaitCycle
    driven: Sequence[Driven]

    @property
    def choices(self) -> list[str]:
        """Return the choices of the animation."""
        figure = {'hip': ' (figure 3)', 'knee': ' (figure 4)'}
        return [
            'as prescribed',
            *(
                f'{d.joint.removeprefix("exo_").replace("_", " ")} by its torque'
                f'{figure.get(d.joint.split("_")[-1], "")}'
                for d in self.driven
            ),
        ]

    @property
    def held(self) -> tuple[str, str]:
        """Return the largest external moments on the trunks, machine and wearer [N m]."""
        own, other = (
            f'{np.abs(self.cycle.trunk_moment(other=other)).max():.0f}' for other in (False, True)
        )
        return own, other

    @property
    def data(self) -> Markup:
        """Return the data of the animation script: a list of frames, each with lines."""
        cycle = self.cycle
        rows = np.linspace(0, len(cycle.phase) - 1, 73).astype(int)[:-1]
        wearer = cycle.motions.other.select(rows)
        ahead = wearer.q[:, floating(cycle.pair.other)[0]]
        machines = [cycle.motions.own.select(rows)]
        machines += [d.right.motion.select(rows // 2) for d in self.driven]
        geometry = cycle.pair.geometry(machines[0], wearer)
        start = geometry.other_position[..., [0, 2]]
        end = start + 4.0 * geometry.way[..., [0, 2]]  # magnified four times for visibility
        arrows = []  # points and forces of ground contact: feet of the wearer, then of the machine
        for robot, motion, ground in (
            (cycle.pair.other, wearer, cycle.other_ground),
            (cycle.pair.robot, machines[0], cycle.ground),
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
                    np.round(np.degrees(d.right.error[rows // 2]), 4).tolist() for d in self.driven
                ],
            }
        )


def feet_section(cycle: GaitCycle) -> ContentSection:
    """Return a section with forces on the feet, from the simulation and from the source's rule."""
    text = (
        "Forces of the ground on the feet, by the contact law of the source's Table 3 "
        '(100 N/mm^1.5, 1 N s/mm, friction 0.3). Vertical lines: changes between one and two feet '
        'on the ground. In double support the source splits the trunk between the legs by the '
        'distances of the thighs, equations (20) to (22).'
    )
    off = 'source off by [N rms]'
    heads = ('Machine', 'Weight [N]', 'Most on a foot [N]', 'On both feet', off)
    panels, rows = [], []
    for robot, other in ((cycle.pair.robot, False), (cycle.pair.other, True)):
        feet = cycle.feet(other=other)[..., 1]
        rule = feet_by_shares(cycle, other=other)[..., 1]
        two = cycle.support(other=other) == 2
        series = [
            Series('right foot', feet[:, 0], 'residual'),
            Series('left foot', feet[:, 1], 'predicted'),
            Series('right, source', np.where(two, rule[:, 0], np.nan), 'measured'),
            Series('left, source', np.where(two, rule[:, 1], np.nan), 'before'),
        ]
        marks = [(float(cycle.phase[k]), '', False) for k in np.flatnonzero(np.diff(two)) + 1]
        chart = Chart(
            cycle.phase, series, _ABSCISSA, 'force up [N]', height=240, link='feet', marks=marks
        )
        panels.append((robot.name, '', [chart]))
        rows.append(
            (
                robot.name,
                f'{weight(robot):.0f}',
                f'{feet.max():.0f}',
                f'{100.0 * np.mean(two):.0f} %',
                f'{np.sqrt(np.mean((rule - feet)[two] ** 2)):.0f}',
            )
        )
    return ContentSection('Feet', [Paragraph(text), Panels(panels), DataTable(heads, rows)])


def by_torque_section(walked: SimulatedWalk) -> ContentSection:
    """Return a section with torque-driven joints over the cycle, and the source's results."""
    text = (
        f'One joint follows its torque alone ({walked.rate:g} samples per second, cubic splines) '
        'through swing and stance; hips are free, all other joints move as prescribed. Largest '
        'errors over the cycle:'
    )
    soft = f'Springs {100.0 * walked.softer:g} % too soft [°]'
    heads = ('Joint', 'Source [°]', 'Here [°]', soft, 'Feet of the source [°]')
    rows = [
        (
            d.joint,
            f'{d.source:g}',
            f'{d.right.most:.2g}',
            f'{d.softer.most:.2f}',
            f'{d.shared.most:.2f}',
        )
        for d in walked.driven
    ]
    phase, panels = walked.cycle.phase[::2], []
    for d in walked.driven:
        both: tuple[tuple[str, GaitCheck, Role], ...] = (
            ('by its torque', d.right, 'residual'),
            ('springs too soft', d.softer, 'predicted'),
        )
        angles = [
            Series('prescribed', np.degrees(d.right.prescribed), 'measured'),
            *(Series(name, np.degrees(check.followed), role) for name, check, role in both),
        ]
        errors = [Series(name, np.degrees(check.error), role) for name, check, role in both]
        error = Chart(
            phase, errors, _ABSCISSA, 'error [°]', height=150, link=d.joint, symmetric=True,
            legend=False,
        )  # fmt: skip
        panels.append((d.joint, '', [Chart(phase, angles, '', 'angle [°]', link=d.joint), error]))
    return ContentSection(
        'Whole cycle by torque', [Paragraph(text), DataTable(heads, rows), Panels(panels)]
    )


def _bodies(robot: Robot, motion: Motion, ahead: FloatArray) -> list[Any]:
    """Return lines of trunk, right and left leg in every frame, in px."""
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
    """Return points forward and up [m] in px, relative to the wearer."""
    shape = (-1,) + (1,) * (points.ndim - 2)
    x = 300.0 + _SCALE * (points[..., 0] - ahead.reshape(shape))
    return np.stack([x, _GROUND - _SCALE * points[..., 1]], axis=-1)


def _whole(values: FloatArray) -> list[Any]:
    return list(np.round(values, 1).tolist())
