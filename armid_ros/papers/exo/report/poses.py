# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Poses of two tied machines as a strip of line drawings, in the plane x forward, z up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.model import LinkFrames
from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.leg_pair import PairMotion, TiedPair
from armid_ros.report.arm_drawing import flat, SIDE, Strip, svg_points
from armid_ros.report.page import Section
from armid_ros.robots import Robot
import numpy as np


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
