# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of a machine and its wearer: stiffness of the ties, forces, assumptions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.identification.ties.stiffness import Interaction
from armid_ros.model import LinkFrames
from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.gait import read_assumptions
from armid_ros.papers.exo.plant.leg_pair import pair_torques, PairMotion, TiedPair
from armid_ros.papers.exo.report.walk import by_torque_section, feet_section, SimulatedWalk, Walk
from armid_ros.report.arm_drawing import flat, SIDE, Strip, svg_points
from armid_ros.report.blocks import (
    ContentSection,
    DataTable,
    FactList,
    Fold,
    Origin,
    Panels,
    Paragraph,
    VerdictSection,
)
from armid_ros.report.charts import Chart, Role, Series
from armid_ros.report.notation import measured
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
from armid_ros.robots import Robot
import numpy as np

#: Intervals wider than this share of the value are called poor.
_NARROW = 0.1


def exo_report(
    pair: TiedPair,
    shown: tuple[PairMotion, FloatArray, str],
    found: Sequence[Interaction],
    walked: SimulatedWalk | None,
    provenance: Provenance,
) -> str:
    """
    Return report.html of a tied pair.

    Parameters
    ----------
    pair : TiedPair
        Both machines, with the estimated stiffness.
    shown : (PairMotion, ndarray, str)
        The motion of both machines, and abscissa of the plots, shape (N,), with name and unit.
    found : sequence of Interaction
        Estimates with one stiffness for all ties, then with one for each.
    walked : SimulatedWalk or None
        Truth of simulated data; None for recorded data.
    provenance : Provenance
        Files, versions, settings, seed.

    """
    motions, abscissa, name = shown
    samples = np.linspace(0, len(abscissa) - 1, 6).astype(int).tolist()
    captions = [f'{abscissa[k]:.2f}' for k in samples]
    sections: list[Section] = [
        verdict(found, walked),
        _stiffness_section(found, walked.truth if walked else {}),
    ]
    if walked is not None:
        sections += [
            Walk(walked.cycle, walked.driven),
            by_torque_section(walked),
            feet_section(walked.cycle),
        ]
    sections += [
        forces_section(pair, motions, abscissa, name),
        draw_poses(pair, motions, samples, captions),
        assumptions_section(),
        Origin(provenance),
    ]
    title = 'Springs between an exoskeleton and its wearer'
    return Page(title, f'{len(pair.ties)} springs · {len(abscissa)} samples', sections).html()


def verdict(found: Sequence[Interaction], walked: SimulatedWalk | None) -> VerdictSection:
    """Return the verdict: stiffness of the straps, interval, and joint errors over a walk."""
    overall = found[0]
    k, reach = overall.stiffness[0], HALF_WIDTH * overall.std[0]
    sentences = [
        f'The stiffness of the straps between exoskeleton and wearer is {k:.0f} ± {reach:.0f} N/m.'
    ]
    weak = [
        name.replace('_', ' ')
        for part in found[1:]
        for name, value, std in zip(part.segments, part.stiffness, part.std, strict=True)
        if HALF_WIDTH * std > _NARROW * abs(value)
    ]
    if walked is not None:
        each = ', '.join(f'{d.joint} {d.right.most:.2g}°' for d in walked.driven)
        sentences.append(f'Over a walking cycle, driven joints are off by at most: {each}.')
    beware = [f'{", ".join(weak)}: too slightly drawn out to know within 10 %.'] if weak else []
    if k - reach <= 0.0:
        return VerdictSection('no interaction', 'fair', ['No interaction is seen.'], beware)
    sure = reach < _NARROW * k
    return VerdictSection(
        'found' if sure else 'uncertain', 'good' if sure else 'fair', sentences, beware
    )


_ROLES: tuple[Role, ...] = ('residual', 'predicted', 'before', 'measured')


def _stiffness_section(found: Sequence[Interaction], truth: Mapping[str, float]) -> ContentSection:
    """Return a section with the stiffness of the ties and its intervals."""
    heads = ['Spring', 'Stiffness [N/m]', '± 95 %', 'Bias of plain least squares']
    rows = [
        [
            segment.replace('_', ' '),
            *measured(part.stiffness[k], HALF_WIDTH * part.std[k]),
            f'{100.0 * part.bias[k] / part.stiffness[k]:+z.2f} %',
            *([f'{truth[segment]:g}' if segment in truth else ''] if truth else []),
        ]
        for part in found
        for k, segment in enumerate(part.segments)
    ]
    noise = [
        ('Noise of the angles, as filtered', f'{_range(np.degrees(found[0].position_noise))}°'),
        ('Noise of the torques, as filtered', f'{_range(found[0].torque_noise)} N m'),
    ]
    text = (
        'Springs are drawn out by millimetres, the small difference of measured angles. Noise in '
        'the angles biases plain least squares, and more data do not help. '
        'The noise was measured in the recording and its effect taken out.'
    )
    table = DataTable([*heads, 'Simulated with'] if truth else heads, rows)
    return ContentSection('Stiffness', [table, FactList(noise), Paragraph(text, 'hint')])


def _range(values: FloatArray) -> str:
    """Format least and largest value to two digits, or one value if both are equal."""
    ends = dict.fromkeys(f'{end:.2g}' for end in (values.min(), values.max()))
    return ' to '.join(ends)


def forces_section(
    pair: TiedPair, motions: PairMotion, abscissa: FloatArray, name: str
) -> ContentSection:
    """Return a section with the spring forces, and their part of the torques."""
    torques = pair_torques(pair, *motions)
    alone = pair_torques(pair.with_stiffness(0.0), *motions)
    size = np.linalg.norm(torques.forces, axis=2)
    names = [name.replace('_', ' ') for name in pair.segments]
    series = [Series(name, size[:, k], _ROLES[k % len(_ROLES)]) for k, name in enumerate(names)]
    rows = [
        (name, f'{size[:, k].mean():.0f}', f'{size[:, k].max():.0f}')
        for k, name in enumerate(names)
    ]
    panels = []
    for k, joint in enumerate(pair.robot.joints):
        both = [
            Series('alone', alone.tau[:, k], 'measured'),
            Series('with springs', torques.tau[:, k], 'residual'),
        ]
        chart = Chart(abscissa, both, name, 'torque [N m]', height=180, link='torques')
        panels.append((joint, '', [chart]))
    return ContentSection(
        'Interaction',
        [
            Paragraph('Force of each spring on the machine; the wearer feels the opposite.'),
            Chart(abscissa, series, name, 'force [N]', height=260),
            DataTable(['Segment', 'Mean [N]', 'Largest [N]'], rows),
            Fold('What the springs make of the joint torques', [Panels(panels)]),
        ],
    )


def assumptions_section() -> ContentSection:
    """Return a section with the assumptions: name, value with unit, reason."""
    rows = []
    for name, entry in read_assumptions().items():
        value = entry.value
        if isinstance(value, dict):
            text = ', '.join(f'{part} {number:g}' for part, number in value.items())
        elif isinstance(value, list):
            text = ', '.join(f'{number:g}' for number in value)
        else:
            text = f'{value:g}' if isinstance(value, float) else str(value)
        rows.append((name.replace('_', ' '), f'{text} {entry.unit}'.strip(), entry.reason))
    said = 'What the literature leaves open and what was assumed instead.'
    table = DataTable(['Quantity', 'Value', 'Reason'], rows, words=(0, 1, 2))
    return ContentSection('Assumptions', [Paragraph(said), table])


@dataclass(frozen=True)
class Poses(Section):
    """
    Both bodies at instants of the motion, side by side.

    Attributes
    ----------
    width, height : float
        Size of the strip.
    own, other : tuple of str
        Polylines of both machines, as coordinates of SVG.
    ties : tuple of tuple of float
        x1, y1, x2, y2 of every spring, from the other machine; four times as long as it is.
    captions : tuple of (float, str)
        Position and time of each pose.

    """

    title: ClassVar[str] = 'Poses'
    package: ClassVar[str] = 'armid_ros.papers.exo.report'
    template: ClassVar[str] = 'poses.html'

    width: float
    height: float
    own: tuple[str, ...]
    other: tuple[str, ...]
    ties: tuple[tuple[float, ...], ...]
    captions: tuple[tuple[float, str], ...]


def draw_poses(
    pair: TiedPair, motions: PairMotion, samples: Sequence[int], captions: Sequence[str]
) -> Poses:
    """Draw a pair at some samples of its motion, side by side."""
    rows = np.asarray(samples)
    lines = [
        _lines(robot, motion.q[rows])
        for robot, motion in ((pair.robot, motions.own), (pair.other, motions.other))
    ]
    everything = np.concatenate([line for group in lines for line in group], axis=1)
    strip = Strip.around(everything.reshape(-1, 2), len(rows), margin=0.06, scale=260.0)
    geometry = pair.geometry(motions.own.select(rows), motions.other.select(rows))
    drawn = [
        tuple(
            svg_points(strip.place(line[pose], pose))
            for pose in range(len(rows))
            for line in group
        )
        for group in lines
    ]
    # magnified four times, to be visible
    ties = [
        tuple(
            np.round(strip.place(flat(SIDE, np.stack([start, start + 4.0 * way])), pose), 1)
            .ravel()
            .tolist()
        )
        for pose in range(len(rows))
        for start, way in zip(geometry.other_position[pose], geometry.way[pose], strict=True)
    ]
    return Poses(*strip.size, drawn[0], drawn[1], tuple(ties), strip.captions(captions))


def _lines(robot: Robot, q: FloatArray) -> list[FloatArray]:
    """Return the chain from base to last body, and a spur to every body's far end (N, P, 2)."""
    frames = LinkFrames.of(robot, q)
    origins = [np.zeros((len(q), 3))]
    origins += [frames.places(joint, np.zeros(3)) for joint in robot.joints]
    spurs = []
    for body, joint in enumerate(robot.joints):
        lever = np.array(robot.model.inertias[body + 1].lever)
        last = body == robot.n_joints - 1
        following = None if last else np.array(robot.model.jointPlacements[body + 2].translation)
        if following is None or np.linalg.norm(following) < 1e-9:
            end = frames.places(joint, (6.0 if last else 1.8) * lever)
            spurs.append(flat(SIDE, np.stack([origins[body + 1], end], axis=1)))
    return [flat(SIDE, np.stack(origins, axis=1)), *spurs]
