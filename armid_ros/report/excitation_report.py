# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of a designed excitation: is it fit to run, and what will it show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.excitation import (
    ClearanceModel,
    CollisionScene,
    CRITERIA,
    Design,
    Fitness,
    Limits,
    Obstacle,
    obstacles_alone,
    Run,
    SPEED_CLASSES,
    TARGETS,
    with_obstacles,
)
from armid_ros.excitation.fitness import FIT, UNFIT
from armid_ros.motion import FloatArray
from armid_ros.report.arm_drawing import draw_poses, OBSTACLE
from armid_ros.report.blocks import ContentSection, FactList, Legend
from armid_ros.report.families import effects_in_words, full_label
from armid_ros.report.judgement import GOOD_CONDITION, WEAK_CONDITION
from armid_ros.report.notation import counted, digits, pretty, robot_label
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
from armid_ros.report.sections.frame import Origin, VerdictSection
from armid_ros.report.sections.parameters import foreseen_section
from armid_ros.report.sections.plan import clearance_section, harmonics_section, motion_section
import numpy as np

_SAMPLES, _POSES, _WAY = 600, 6, 150


def excitation_report(
    design: Design,
    arm: ArmModel,
    run: Run,
    checked: Fitness,
    *,
    robot: str,
    scene: CollisionScene,
    provenance: Provenance | None = None,
) -> str:
    """
    Return report.html of a design.

    Parameters
    ----------
    design : Design
        What was found.
    arm : ArmModel
        Prior model, for the torque.
    run : Run
        The design with the way there and back.
    checked : Fitness
        What was checked of it.
    robot : str
        Shipped name or path of the description.
    scene : CollisionScene
        Bodies of the arm, its floor, and what stands around it.
    provenance : Provenance, optional
        Files, versions, settings, seed.

    Returns
    -------
    str
        One HTML file that loads nothing.

    """
    excitation, limits = design.excitation, design.limits
    motion = run.at(np.linspace(0.0, run.duration, _SAMPLES))
    collision, obstacles = scene.collision, scene.obstacles
    motion = replace(motion, tau=arm.joint_torque(motion))
    shares = design.limits_used(arm)
    bodies = {'links from each other': collision}
    if obstacles:
        bodies['arm from its environment'] = obstacles_alone(collision, obstacles)
    curves = {
        name: ClearanceModel.of(model).smallest(motion.q)
        for name, model in bodies.items()
        if len(model.geometry.collisionPairs)
    }
    said = (*collision.notes, *filter(None, [collision.excluded]))
    instants = excitation.run_in + np.arange(_POSES) * excitation.trajectory.period / _POSES
    poses = draw_poses(
        with_obstacles(collision, obstacles),
        excitation.at(instants).q,
        [f'{t:.1f} s' for t in instants],
        excitation.trajectory.one_period(_WAY).q,
    )
    colours = [
        ('residual', 'the arm, bluer towards its end'),
        ('predicted', 'path of the last body in one period'),
    ]
    if any(colour == OBSTACLE for _, colour in poses.bodies):
        colours.append(('line', ', '.join(obstacle.name for obstacle in obstacles)))
    sections: list[Section] = [
        _verdict(design, arm.robot.links, shares, checked, collision.notes),
        ContentSection('Poses', [poses, Legend(colours)]),
        foreseen_section(design, arm.robot.links),
        motion_section(limits, motion, shares),
        clearance_section(motion.t, curves, design.settings.clearance, said),
        harmonics_section(excitation.trajectory),
        _asked(design, arm, robot, obstacles, run),
        Origin(provenance or Provenance()),
    ]
    subtitle = (
        f'{robot_label(robot)} · {run.duration:.4g} s · {excitation.n_periods} periods · '
        f'{design.settings.speed}'
    )
    return Page(f'Excitation of {arm.robot.name}', subtitle, sections).html()


def _verdict(
    design: Design,
    links: Sequence[str],
    shares: Mapping[str, FloatArray],
    checked: Fitness,
    notes: Sequence[str],
) -> VerdictSection:
    """Say how much is seen, what is known worst, and that nothing is hit."""
    information, settings = design.information, design.settings
    std, names = information.std, information.parameters
    unseen = [
        full_label(name, links) for name, s in zip(names, std, strict=True) if not np.isfinite(s)
    ]
    seen = len(names) - len(unseen)
    sentences = [f'{seen} of {len(names)} parameters can be identified.']
    if not unseen:
        sentences = [
            f'All {len(names)} parameters can be identified (condition number '
            f'{information.condition:.3g}: {_conditioning(information.condition)}).'
        ]
        worst = int(np.argmax(std / information.scale))
        sure = int(np.sum(std <= 0.1 * np.abs(design.described)))
        sentences.append(
            f'{sure} of {len(names)} will be known to 10 % or better. The least accurate will be '
            f'{full_label(names[worst], links)}: ± {digits(float(std[worst]))} '
            f'{pretty(names[worst].unit)}.'
        )
    sentences.insert(0, _kept(shares, design.limits, checked))
    beware = []
    if unseen:
        beware.append(f'Not identifiable from this run: {", ".join(unseen)}.')
    if design.stopped:
        beware.append(
            f'The search was stopped early ({design.stopped}). This is the best result so far; '
            'the same seed may give another one.'
        )
    if settings.acceleration is None:
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
    return VerdictSection('blind' if unseen else checked.word, tone, sentences, beware)


def _conditioning(condition: float) -> str:
    """Return a condition number in words, with the limit of the usual advice."""
    word = 'good' if condition < GOOD_CONDITION else 'weak'
    if GOOD_CONDITION <= condition < WEAK_CONDITION:
        word = 'fair'
    return word if word == 'good' else f'{word}; below {GOOD_CONDITION:g} is good'


def _kept(shares: Mapping[str, FloatArray], limits: Limits, checked: Fitness) -> str:
    """Say that limits and clearance are kept, where it is tightest, and what was not checked."""
    name, share = max(shares.items(), key=lambda item: float(item[1].max()))
    joint = limits.joints[int(share.argmax())]
    text = (
        f'All limits are kept; the closest is the {name} of {joint} at {100.0 * share.max():.0f} %'
    )
    nearest = checked.nearest
    if nearest is not None:
        text += (
            f'. The smallest clearance is {100.0 * nearest.distance:.1f} cm, between '
            f'{nearest.first} and {nearest.second} at {nearest.time:.1f} s'
        )
    near = () if nearest is None else (nearest.first, nearest.second)
    if checked.lowest.link and 'floor' not in near:
        text += f'; {checked.height()} at {checked.lowest.time:.1f} s'
    if checked.unchecked:
        missing = '; '.join(checked.unchecked)
        text += f'. Before the run, check yourself what was not checked: {missing}'
    return f'{text}.'


def _asked(
    design: Design,
    arm: ArmModel,
    robot: str,
    obstacles: Sequence[Obstacle],
    whole: Run,
) -> ContentSection:
    settings, run = design.settings, design.excitation
    criterion = f'{settings.criterion}: {CRITERIA[settings.criterion]}'
    focus = f'; focus on {", ".join(settings.focus)}' if settings.focus else ''
    start = f'{_numbers(whole.approach.q[0])}, with an approach of {whole.approach.duration:.1f} s'
    name = settings.speed
    share = SPEED_CLASSES[name] if isinstance(name, str) else name
    speed = f'{name}: {100.0 * share:.0f} % of the velocity and acceleration limits'
    noise = ', '.join(
        f'{value:.3g} {unit}'
        for value, unit in zip(design.noise, arm.robot.torque_units, strict=True)
    )
    facts = [
        ('Robot', robot),
        ('Joints', ', '.join(run.joints)),
        ('Gravity', f'({_numbers(arm.robot.gravity)}) m/s²'),
        ('Effects', effects_in_words(arm.effects)),
        ('Target', f'{TARGETS[settings.target]}{focus}'),
        ('Criterion', criterion),
        ('Speed', speed),
        (
            'Run',
            f'{run.n_periods} periods of {run.trajectory.period:.4g} s, '
            f'{counted(run.trajectory.harmonics, "harmonic")}, {run.run_in:.3g} s of '
            f'fade-in and of fade-out; from {start}',
        ),
        ('Torque noise', f'{noise} at {settings.rate:g} Hz'),
        ('Clearance', f'{100.0 * settings.clearance:g} cm'),
        ('Around the arm', ', '.join(o.name for o in obstacles) or 'nothing'),
        (
            'Search',
            f'{counted(settings.starts, "start")}, at most {settings.iterations} iterations each',
        ),
    ]
    return ContentSection('What was asked', [FactList(facts)])


def _numbers(values: FloatArray) -> str:
    return ', '.join(f'{value:.3g}' for value in values)
