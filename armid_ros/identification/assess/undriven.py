# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Joints that are recorded where the model does not have them.

A joint that is not driven is held. Where it moves, or stands elsewhere and carries driven joints,
the arm is another one than the model; how much that matters is what its position makes of the
described torque along the recorded motion, beside the torque that was measured.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.rows.checks import REST_RANGE
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.robots import described_at, held_joints, HeldJoint, Robot
import numpy as np

#: Places of its range at which a joint that moves is compared: weight and inertia may be the same
#: at both ends, as those of a link that swings as far to either side.
_PLACES = 7


@dataclass(frozen=True)
class Elsewhere:
    """
    A joint that is not where the model holds it.

    Attributes
    ----------
    text : str
        Joint, positions, what they make of the torque and what to do, without a full stop.
    share : float
        Norm of the largest change of the described torque of one driven joint over that of its
        measured torque.

    """

    text: str
    share: float

    @property
    def spoils(self) -> bool:
        """Whether a model with such an error would be poor."""
        return 100.0 * self.share > LIMITS.poor


def held_elsewhere(
    robot: Robot, recordings: Sequence[Recording], motions: Sequence[Motion]
) -> Iterator[Elsewhere]:
    """
    Yield the joints that are not driven and were elsewhere, as far as it matters.

    Parameters
    ----------
    robot : Robot
        Whose description it is.
    recordings : sequence of Recording
        With the range of joints that were not asked for.
    motions : sequence of Motion
        Of the driven joints, with their torque.

    """
    for joint in held_joints(robot):
        seen = [other for one in recordings for other in one.others if other.joint == joint.name]
        if not seen:
            continue
        lowest, highest = min(one.lowest for one in seen), max(one.highest for one in seen)
        moves = highest - lowest > REST_RANGE
        if not (moves or joint.carries):
            continue  # a part of the body that carries it, in whatever position
        places = list(np.linspace(lowest, highest, _PLACES if moves else 1))
        places.append(joint.position)
        # the largest change of the described torque between places, as a share
        measured = np.concatenate([motion.tau for motion in motions if motion.tau is not None])
        described = [
            np.concatenate(
                [
                    inverse_dynamics(described_at(robot, {joint.name: place}), motion)
                    for motion in motions
                ]
            )
            for place in places
        ]
        changes = [np.linalg.norm(a - b, axis=0) for a, b in combinations(described, 2)]
        whole = np.linalg.norm(measured, axis=0)
        largest = np.max(changes, axis=0)
        shares: FloatArray = np.divide(largest, whole, out=np.zeros_like(whole), where=whole > 0.0)
        worst = int(np.argmax(shares))
        if shares[worst] > LIMITS.floor or (moves and joint.carries):
            what = f'{100.0 * shares[worst]:.0f} % of the torque of {robot.joints[worst]}'
            yield Elsewhere(_text(joint, lowest, highest, moves, what), float(shares[worst]))


def _text(joint: HeldJoint, lowest: float, highest: float, moves: bool, change: str) -> str:
    name, unit = joint.name, joint.unit
    if not moves:
        return (
            f'joint {name} is not driven and stands at {lowest:.3g} {unit}, where '
            f'the model has it at {joint.position:.3g} {unit}, which makes {change}; '
            'make it fixed there in the description, or drive it (--joints)'
        )
    carries = f', and carries {", ".join(joint.carries)}' if joint.carries else ''
    remedy = (
        'leave out where it moves'
        if joint.follows
        else 'drive it as well (--joints), or hold it still where its torque is not measured'
    )
    return (
        f'joint {name} is not driven, but moves from {lowest:.3g} to {highest:.3g} '
        f'{unit}{carries}; the model has it at {joint.position:.3g} {unit}; where it is makes '
        f'up to {change}; {remedy}'
    )
