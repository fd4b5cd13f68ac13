# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whether a run is fit to be run: what was checked, what came out, and what was not checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.excitation.geometry.clearance import Approach, ClearanceModel
from armid_ros.excitation.geometry.environment import Obstacle, with_obstacles
from armid_ros.excitation.geometry.floor import Floor
from armid_ros.excitation.geometry.heights import lowest_point, LowestPoint
from armid_ros.excitation.limits import has_velocity_limit, Limits, SLOW_VELOCITY
from armid_ros.excitation.run import Run
from armid_ros.motion import Motion
from armid_ros.robots import CollisionModel
import numpy as np

FIT, PARTLY, UNFIT = 'fit to run', 'partly checked', 'not to be run'
#: Names that are listed before the rest is counted.
_NAMED = 4


@dataclass(frozen=True)
class Fitness:
    """
    What was checked of a run.

    Attributes
    ----------
    lowest : LowestPoint
        The lowest point of the motion.
    floor : Floor
        What was reckoned with as the floor.
    nearest : Approach or None
        Where bodies come closest; None where none are kept apart.
    unchecked : tuple of str
        What nobody could check.

    """

    lowest: LowestPoint
    floor: Floor
    nearest: Approach | None
    unchecked: tuple[str, ...]

    @property
    def word(self) -> str:
        """Return the verdict in a few words: `FIT` only when all was checked and is clear."""
        if self.nearest is not None and self.nearest.distance < 0.0:
            return UNFIT
        if self.floor.height is not None and self.lowest.height < self.floor.height:
            return UNFIT
        return PARTLY if self.unchecked else FIT

    def __str__(self) -> str:
        """Say in one sentence what was found and what was not checked."""
        parts = ['no limit violated']
        if self.nearest is not None:
            parts.append(
                f'smallest clearance {1e3 * self.nearest.distance:.0f} mm '
                f'({self.nearest.first} and {self.nearest.second})'
            )
        if self.lowest.link:
            parts.append(self.height())
        sentence = f'{self.word}: {", ".join(parts)}'
        if self.unchecked:
            sentence += f'; not checked: {"; ".join(self.unchecked)}'
        return sentence

    def height(self) -> str:
        """Say how low the motion comes."""
        height, what = self.lowest.height, 'base'
        if self.floor.height is not None:
            height, what = height - self.floor.height, 'floor'
        side = 'above' if height >= 0.0 else 'below'
        return f'lowest point {abs(height):.3f} m {side} the {what} ({self.lowest.link})'


def fitness(
    run: Run | Motion,
    limits: Limits,
    collision: CollisionModel,
    floor: Floor,
    obstacles: Sequence[Obstacle],
) -> Fitness:
    """
    Look at a run that keeps its limits and its clearance.

    Parameters
    ----------
    run : Run or Motion
        From the first sample to the last.
    limits : Limits
        Limits in force.
    collision : CollisionModel
        Bodies of the arm.
    floor : Floor
        What is taken for the floor.
    obstacles : sequence of Obstacle
        What it was kept clear of, the floor among it.

    """
    motion = run.motion() if isinstance(run, Run) else run
    exempt = [link for o in obstacles if o.kind == 'plane' for link in o.ignore]
    model = ClearanceModel.of(with_obstacles(collision, obstacles))
    return Fitness(
        lowest_point(collision, floor.up, motion, exempt),
        floor,
        model.closest(motion),
        not_checked(limits, collision, floor, obstacles),
    )


def not_checked(
    limits: Limits, collision: CollisionModel, floor: Floor, obstacles: Sequence[Obstacle]
) -> tuple[str, ...]:
    """Return what could not be checked of any run of an arm, each in a few words."""
    found = []
    if floor.height is None and not any(obstacle.kind == 'plane' for obstacle in obstacles):
        if floor.source == 'given':
            found.append('the floor (none is given)')
        elif floor.source == 'environment':
            found.append('the floor (the environment has no plane)')
    found += _bodies_not_checked(collision)
    by_name = collision.robot.description.by_name
    endless = np.array([by_name[joint].kind == 'continuous' for joint in limits.joints])
    free = {
        'position': (np.isinf(limits.lower) | np.isinf(limits.upper)) & ~endless,
        'velocity': np.isinf(limits.velocity),
        'torque': np.isinf(limits.torque),
    }
    for name, where in free.items():
        joints = [joint for joint, one in zip(limits.joints, where, strict=True) if one]
        if joints:
            found.append(f'the {name} of {_listed(joints)} (no limit)')
    slow = [
        joint
        for joint, own in zip(limits.joints, has_velocity_limit(collision.robot), strict=True)
        if not own
    ]
    if slow:
        taken = f'{SLOW_VELOCITY:g} rad/s or m/s'
        found.append(f'the velocity of {_listed(slow)} (no limit is given; {taken} is taken)')
    mass = collision.robot.rigid_parameters.reshape(collision.robot.n_joints, -1)[:, 0]
    massless = [link for link, m in zip(collision.robot.links, mass, strict=True) if not m > 0.0]
    if massless:
        found.append(f'the weight of {_listed(massless)} (no inertia)')
    return tuple(found)


def _bodies_not_checked(collision: CollisionModel) -> list[str]:
    found = []
    if collision.left_out:
        found.append(f'bodies of {_listed(collision.left_out)} (mesh not found)')
    joints = {int(body.parentJoint) - 1 for body in collision.geometry.geometryObjects}
    bare = [
        link
        for j, link in enumerate(collision.robot.links)
        if j not in joints and link not in collision.left_out
    ]
    if bare:
        found.append(f'bodies of {_listed(bare)} (no collision body)')
    if collision.touching:
        pairs = [f'{first} and {second}' for first, second in collision.touching]
        found.append(f'the clearance of {_listed(pairs)} (touch at zero, no SRDF)')
    return found


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _NAMED
    text = ', '.join(names[:_NAMED])
    return f'{text} and {more} more' if more > 0 else text
