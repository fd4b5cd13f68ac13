# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Page of a designed excitation: limits, clearance, and expected accuracy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.next_run.isolability import Isolability
from armid_ros.excitation import (
    ClearanceModel,
    CollisionScene,
    CRITERIA,
    Design,
    Fitness,
    Limits,
    Obstacle,
    Run,
    SPEED_CLASSES,
    TARGETS,
    with_obstacles,
)
from armid_ros.excitation.geometry.environment import obstacles_alone
from armid_ros.excitation.scene import FIT, UNFIT
from armid_ros.motion import FloatArray, Motion
from armid_ros.report.arm_drawing import draw_poses, OBSTACLE
from armid_ros.report.blocks import (
    Bar,
    BarChart,
    BulletList,
    Cells,
    DataTable,
    FactList,
    Legend,
    Panels,
    Paragraph,
    SmallMultiples,
    TableCell,
    VerdictSection,
)
from armid_ros.report.charts import Chart, Role, Series
from armid_ros.report.judgement import GOOD_CONDITION, WEAK_CONDITION
from armid_ros.report.notation import counted, digits, plain, pretty, robot_label
from armid_ros.report.page import Page, Section, Templated
from armid_ros.report.parameter_tables import arm_facts, full_label, parameter_folds
from armid_ros.report.provenance import ResultOrigin
from armid_ros.report.sections.diagnosed import isolability_section
from armid_ros.report.sections.fit import ZOOM
from armid_ros.robots import Robot
import numpy as np


def excitation_report(
    design: Design,
    arm: ArmModel,
    run: Run,
    checked: Fitness,
    *,
    scene: CollisionScene,
    isolability: Isolability | None = None,
    start_reason: str = '',
    origin: ResultOrigin,
) -> str:
    """
    Return the HTML page of a designed excitation.

    Parameters
    ----------
    design : Design
        The design.
    arm : ArmModel
        Prior model, for the torque.
    run : Run
        The design with approach and return.
    checked : Fitness
        Results of the checks of the run.
    scene : CollisionScene
        Bodies of the arm, floor and obstacles.
    isolability : Isolability, optional
        Detectable sizes of the effects, and effects that are not distinguishable.
    start_reason : str
        Reason why the run does not start at zero.
    origin : ResultOrigin
        Robot, files, versions, settings, seed, and the command that follows.

    """
    excitation, limits = design.excitation, design.limits
    motion = run.at(np.linspace(0.0, run.duration, 600))
    collision, obstacles = scene.collision, scene.obstacles
    motion = replace(motion, tau=arm.joint_torque(motion))
    shares = design.robot_limits_used(arm)
    bodies = {'links from each other': collision}
    if obstacles:
        bodies['arm from its environment'] = obstacles_alone(collision, obstacles)
    curves = {
        name: ClearanceModel.of(model).smallest(motion.q)
        for name, model in bodies.items()
        if len(model.geometry.collisionPairs)
    }
    remarks = (*collision.notes, *filter(None, [collision.excluded]))
    # six poses of a period
    instants = excitation.run_in + np.arange(6) * excitation.trajectory.period / 6
    poses = draw_poses(
        with_obstacles(collision, obstacles),
        excitation.at(instants).q,
        excitation.trajectory.one_period(150).q,
    )
    figures = [
        (f'{t:.1f} s', '', pose.html(), '') for t, pose in zip(instants, poses, strict=True)
    ]
    colours = [
        ('residual', 'the arm, bluer towards its end'),
        ('predicted', 'path of the last body in one period'),
    ]
    if any(colour == OBSTACLE for pose in poses for _, colour in pose.bodies):
        colours.append(('line', ', '.join(obstacle.name for obstacle in obstacles)))
    verdict = _verdict(design, arm.robot, shares, checked, collision.notes, origin.step)
    sections = [
        Section('Poses', [SmallMultiples(figures), Legend(colours)]),
        _accuracy_section(design, arm.robot.links),
        *([] if isolability is None else [isolability_section(isolability)]),
        _motion_section(limits, motion, shares),
        _clearance_section(motion.t, curves, design.settings.clearance, remarks),
        _input_section(design, arm, origin.robot, obstacles, run, start_reason),
    ]
    subtitle = (
        f'{robot_label(origin.robot)} · {run.duration:.4g} s · {excitation.n_periods} periods · '
        f'{design.settings.speed}'
    )
    names = (*arm.robot.joints, *arm.robot.links)
    title = f'Excitation of {arm.robot.name}'
    return Page(title, subtitle, verdict, sections, origin.provenance, names).html()


def _verdict(
    design: Design,
    robot: Robot,
    shares: Mapping[str, FloatArray],
    checked: Fitness,
    notes: Sequence[str],
    step: str,
) -> VerdictSection:
    """Return the verdict box: use of limits, clearance, and identifiable parameters."""
    settings, links, joints = design.settings, robot.links, design.limits.joints
    unseen = [
        full_label(name, links)
        for name, s in zip(design.information.parameters, design.information.std, strict=True)
        if not np.isfinite(s)
    ]
    used = [max((float(x[j]), name) for name, x in shares.items()) for j in range(len(joints))]
    rows = [
        (joint, [Bar(share, 'after', f'{100.0 * share:.0f} % of the {quantity} limit')])
        for joint, (share, quantity) in zip(joints, used, strict=True)
    ]
    rows.sort(key=lambda row: -row[1][0].value)
    bars = BarChart(
        rows, [('after', 'largest share of a limit of the robot that the joint uses')], full=1.0
    )
    first, *others = checked.sentences()
    sentences = [first, *others, ' '.join(identifiable(design, links))]
    if unseen:
        sentences.insert(0, sentences.pop())
    beware = []
    if unseen:
        beware.append(f'Not identifiable from this run: {", ".join(unseen)}.')
    if design.stopped:
        beware.append(
            f'The search was stopped early ({design.stopped}). This is the best result so far; '
            'the same seed may give another one.'
        )
    if np.isinf(robot.acceleration_limit).all():
        beware.append(
            'Acceleration limits are assumed, as a URDF has none: each joint reaches its top '
            'speed in 0.25 s.'
        )
    if settings.noise is None:
        beware.append(
            'The standard deviations assume a torque noise of 1 % of the torque limits; it was '
            'not measured.'
        )
    if notes:
        beware.append('Not all bodies were checked for collision; see Clearance.')
    tone = 'good' if checked.word == FIT and not design.stopped else 'fair'
    tone = 'bad' if unseen or checked.word == UNFIT else tone
    word = 'not identifiable' if unseen else checked.word
    return VerdictSection(word, tone, sentences, beware, bars, step)


def identifiable(design: Design, links: Sequence[str]) -> list[str]:
    """Return sentences on the number of identifiable parameters and on their accuracy."""
    information = design.information
    std, names = information.std, information.parameters
    seen = int(np.sum(np.isfinite(std)))
    if seen < len(names):
        return [f'{seen} of {len(names)} parameters can be identified.']
    worst = int(np.argmax(std / information.scale))
    least = f'{full_label(names[worst], links)}: ± {digits(float(std[worst]))}'
    least = f'Least accurate: {" ".join([least, pretty(names[worst].unit)]).rstrip()}.'
    size = np.abs(design.described)
    accurate, known = int(np.sum(std <= 0.1 * size)), int(np.sum(size > 0.0))
    if not known:  # the condition number depends on the size of the parameters
        return [f'All {len(names)} parameters can be identified.', least]
    remark = '; the others hardly change the torque' * (accurate < known)
    grade = 'good'
    if information.condition >= GOOD_CONDITION:
        weak = information.condition >= WEAK_CONDITION
        grade = f'{"weak" if weak else "fair"}; below {GOOD_CONDITION:g} is good'
        grade += '; a longer duration helps' * weak
    return [
        f'All {len(names)} parameters can be identified (condition number '
        f'{plain(information.condition)}: {grade}).',
        f'{accurate} of {known} parameters that are not zero in the description will be known to '
        f'10 %{remark}. {least}',
    ]


def _input_section(
    design: Design,
    arm: ArmModel,
    robot: str,
    obstacles: Sequence[Obstacle],
    approached: Run,
    start_reason: str,
) -> Section:
    """Return the section with robot, settings of the design, and obstacles."""
    settings, run = design.settings, design.excitation
    criterion = f'{settings.criterion}: {CRITERIA[settings.criterion]}'
    focus = f'; focus on {", ".join(settings.focus)}' if settings.focus else ''
    pose = ', '.join(f'{q:.3g}' for q in approached.approach.q[0])
    start = f'{pose}, with an approach of {approached.approach.duration:.1f} s'
    if start_reason:
        start += f'; {start_reason}'
    name = settings.speed
    share = SPEED_CLASSES[name] if isinstance(name, str) else name
    speed = f'{name}: {100.0 * share:.0f} % of the velocity and acceleration limits'
    noise = ', '.join(
        f'{value:.3g} {unit}'
        for value, unit in zip(design.noise, arm.robot.torque_units, strict=True)
    )
    facts = [
        *arm_facts(arm, robot),
        ('Target', f'{TARGETS[settings.target]}{focus}'),
        ('Criterion', criterion),
        ('Speed', speed),
        (
            'Run',
            f'{run.n_periods} periods of {run.trajectory.period:.4g} s, '
            f'{counted(run.trajectory.harmonics, "harmonic")}, {run.run_in:.3g} s of '
            f'run-in and of run-out; from {start}',
        ),
        ('Torque noise', f'{noise} at {settings.rate:g} Hz'),
        ('Clearance', f'{100.0 * settings.clearance:g} cm'),
        ('Obstacles', ', '.join(o.name for o in obstacles) or 'none'),
        (
            'Search',
            f'{counted(settings.starts, "start")}, at most {settings.iterations} iterations each',
        ),
    ]
    return Section('Input', [FactList(facts)])


def _motion_section(limits: Limits, motion: Motion, shares: Mapping[str, FloatArray]) -> Section:
    assert motion.tau is not None
    quantities = (
        ('position', motion.q, limits.lower, limits.upper),
        ('velocity', motion.dq, -limits.velocity, limits.velocity),
        ('acceleration', motion.ddq, -limits.acceleration, limits.acceleration),
        ('torque', motion.tau, -limits.torque, limits.torque),
    )
    rows, panels = [], []
    for j, joint in enumerate(limits.joints):
        used = [f'{100.0 * s[j]:.0f} %' if s[j] > 0.0 else 'no limit' for s in shares.values()]
        rows.append((joint, *used))
        charts = [
            Chart(
                motion.t,
                [Series(name, values[:, j], 'residual')],
                'time [s]' if name == 'torque' else '',
                f'{name} [{pretty(limits.unit(name, j))}]',
                height=180 if name == 'torque' else 145,
                link='planned',
                levels=[(float(e[j]), '') for e in (lower, upper) if np.isfinite(e[j])],
                legend=False,
            )
            for name, values, lower, upper in quantities
        ]
        panels.append((joint, '', charts))
    return Section(
        'Motion and limits',
        [
            Paragraph(
                'Largest share of each limit of the robot that the excitation uses. Positions are '
                'measured from the middle of the range. Approach and return may use the full '
                'range.'
            ),
            DataTable(('Joint', *shares), rows),
            Paragraph(f'Horizontal lines are the limits of the design. {ZOOM}', 'hint'),
            Panels(panels),
        ],
    )


def _clearance_section(
    t: FloatArray, curves: Mapping[str, FloatArray], margin: float, notes: Sequence[str]
) -> Section:
    """Return the section with distances of links from each other and from obstacles."""
    roles: tuple[Role, ...] = ('residual', 'before')
    blocks: list[Templated] = [
        Chart(
            t,
            [
                Series(name, 100.0 * curve, role)
                for (name, curve), role in zip(curves.items(), roles, strict=False)
            ],
            'time [s]',
            'distance [cm]',
            height=240,
            link='planned',
            levels=[(100.0 * margin, f'{100.0 * margin:g} cm required')],
        )
    ]
    if not curves:
        none = 'the description has no collision bodies that could touch'
        blocks = [Paragraph(f'Clearance is not checked: {none}.')]
    if notes:
        blocks.append(BulletList([(note, 'warn') for note in notes]))
    return Section('Clearance', blocks)


def _accuracy_section(design: Design, links: Sequence[str] = ()) -> Section:
    information, described = design.information, design.described
    size = information.std / information.scale

    def cells(k: int) -> Cells:
        name, std, value = information.parameters[k], information.std[k], described[k]
        seen, known = bool(np.isfinite(std)), name.rigid or bool(value)
        relative = f'{digits(100.0 * std / abs(value))} %' if value and seen else ''
        return (
            f'{value:.3g}' if known else 'not known',
            digits(float(std)) if seen else TableCell('not identifiable', 'unknown'),
            relative if std < abs(value) or not relative else TableCell('> 100 %', 'unknown'),
        )

    return Section(
        'Expected accuracy',
        [
            Paragraph(
                'Expected standard deviation of each parameter for the stated torque noise and a '
                'correct model; the smallest torque uncertainty first.'
            ),
            *parameter_folds(
                information.parameters,
                ('Prior model', '± 1 \N{GREEK SMALL LETTER SIGMA}', 'Relative'),
                cells,
                links,
                order=lambda k: float(size[k]),
            ),
        ],
    )
