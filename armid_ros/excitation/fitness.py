# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Summary of the safety checks of a run: results, and items that could not be checked."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.excitation.geometry.clearance import Approach, ClearanceModel
from armid_ros.excitation.geometry.floor import Floor
from armid_ros.excitation.geometry.heights import lowest_point, LowestPoint
from armid_ros.excitation.limits import Limits
from armid_ros.excitation.scene import CollisionScene
from armid_ros.motion import Motion

FIT, PARTLY, UNFIT = 'fit to run', 'partly checked', 'not to be run'


@dataclass(frozen=True)
class Fitness:
    """
    Results of the checks of a run.

    Attributes
    ----------
    lowest : LowestPoint
        The lowest point of the motion.
    floor : Floor
        The assumed floor.
    nearest : Approach or None
        The closest approach of two bodies; None if no pair is checked.
    unchecked : tuple of str
        Items that could not be checked.

    """

    lowest: LowestPoint
    floor: Floor
    nearest: Approach | None
    unchecked: tuple[str, ...]

    @property
    def word(self) -> str:
        """Return the verdict: `FIT` only if everything was checked and no fault was found."""
        if self.nearest is not None and self.nearest.distance < 0.0:
            return UNFIT
        if self.floor.height is not None and self.lowest.height < self.floor.height:
            return UNFIT
        return PARTLY if self.unchecked else FIT

    def __str__(self) -> str:
        """Return a sentence on the results and on the unchecked items."""
        parts = ['no limit violated', *self.distances()]
        sentence = f'{self.word}: {", ".join(parts)}'
        if self.unchecked:
            sentence += f'; not checked: {"; ".join(self.unchecked)}'
        return sentence

    def distances(self) -> list[str]:
        """Return phrases on the smallest clearance and on the lowest point, where known."""
        parts = []
        if self.nearest is not None:
            parts.append(
                f'smallest clearance {1e3 * self.nearest.distance:.0f} mm '
                f'({self.nearest.first} and {self.nearest.second})'
            )
        if self.lowest.link:
            parts.append(self.height())
        return parts

    def height(self) -> str:
        """Return a phrase on the lowest point of the motion."""
        height, what = self.lowest.height, 'base'
        if self.floor.height is not None:
            height, what = height - self.floor.height, 'floor'
        side = 'above' if height >= 0.0 else 'below'
        return f'lowest point {abs(height):.3f} m {side} the {what} ({self.lowest.link})'


def fitness(motion: Motion, limits: Limits, scene: CollisionScene) -> Fitness:
    """
    Return the results for a run that keeps its limits and its clearance.

    Parameters
    ----------
    motion : Motion
        The whole run.
    limits : Limits
        Limits in force.
    scene : CollisionScene
        Bodies, floor and obstacles of the clearance check.

    """
    exempt = [link for o in scene.obstacles if o.kind == 'plane' for link in o.ignore]
    return Fitness(
        lowest_point(scene.collision, scene.floor.up, motion, exempt),
        scene.floor,
        ClearanceModel.of(scene.bodies).closest(motion),
        scene.not_checked(limits),
    )
