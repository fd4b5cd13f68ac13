# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which joints of a description are driven, and where the others stand."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.errors import RobotError
from armid_ros.robots.description import Description, Joint

#: Pinocchio keeps tensors of the joints cubed, 1 GB for 250; a humanoid with both hands has 70.
MAX_DRIVEN = 150
GRIPPER_WORDS = ('finger', 'gripper', 'jaw')


def driven_joints(
    description: Description, names: Sequence[str] | None, source: str
) -> tuple[Joint, ...]:
    """
    Return the driven joints: those named, or all but the gripper's.

    A joint that mimics another one is never driven. By default neither is a joint that opens and
    closes a gripper: one that a mimic joint follows, or whose name says finger, gripper
    or jaw, as long as it carries no joint of the arm.

    Raises
    ------
    RobotError
        If a name is unknown, repeated, not movable, a mimic joint, or followed by one; the
        message lists the joints that could be named.

    """
    chosen = _by_default(description) if names is None else _by_name(description, names, source)
    followers = {joint.mimic.joint: joint for joint in description.joints if joint.mimic}
    for joint in chosen:
        if joint.name in followers:
            raise RobotError(
                f"{source}: joint '{followers[joint.name].name}' mimics the driven joint "
                f"'{joint.name}'; coupled mechanisms are not supported: leave '{joint.name}' out "
                f"of the driven joints, or make '{followers[joint.name].name}' fixed"
            )
    if not chosen:
        raise RobotError(f'{source}: no joint can be driven; a robot needs one at least')
    if len(chosen) > MAX_DRIVEN:
        raise RobotError(
            f'{source}: {len(chosen)} joints are driven; {MAX_DRIVEN} are the most that can be '
            'identified together: name those of one arm with --joints'
        )
    return chosen


def standing_position(description: Description, joint: Joint) -> float:
    """Position [rad or m] at which a joint that is not driven stands: 0 or what is nearest."""
    multiplier, offset = 1.0, 0.0
    followed = {joint.name}
    while joint.mimic:
        offset += multiplier * joint.mimic.offset
        multiplier *= joint.mimic.multiplier
        leader = description.by_name.get(joint.mimic.joint)
        if leader is None:
            return offset
        if leader.name in followed:
            raise RobotError(f"joint '{leader.name}' mimics itself, by way of others or not")
        followed.add(leader.name)
        joint = leader
    return multiplier * min(max(0.0, joint.lower), joint.upper) + offset


def _by_name(description: Description, names: Sequence[str], source: str) -> tuple[Joint, ...]:
    known, named = description.by_name, set[str]()
    free = ', '.join(joint.name for joint in description.movable() if not joint.mimic)
    for name in names:
        if name not in known:
            raise RobotError(f"{source}: no joint is named '{name}'; joints to drive: {free}")
        if not known[name].movable:
            raise RobotError(f"{source}: joint '{name}' is fixed; joints to drive: {free}")
        if known[name].mimic:
            raise RobotError(
                f"{source}: joint '{name}' mimics another one and cannot be driven; "
                f'joints to drive: {free}'
            )
        if name in named:
            raise RobotError(f"{source}: joint '{name}' is named twice among the driven joints")
        named.add(name)
    return tuple(joint for joint in description.joints if joint.name in named)


def _by_default(description: Description) -> tuple[Joint, ...]:
    free = [joint for joint in description.movable() if not joint.mimic]
    led = {joint.mimic.joint for joint in description.joints if joint.mimic}
    gripper = {joint.name for joint in free if joint.name in led or _says_gripper(joint)}

    carriers = _carriers(description, [joint for joint in free if joint.name not in gripper])
    driven = tuple(j for j in free if j.name not in gripper or j.name in carriers)
    return driven or tuple(joint for joint in free if joint.name not in led)


def _carriers(description: Description, joints: Sequence[Joint]) -> set[str]:
    """Return the joints that carry one of these."""
    by_child = {joint.child: joint for joint in description.joints}
    found: set[str] = set()
    for joint in joints:
        carrier = by_child.get(joint.parent)
        while carrier is not None and carrier.name not in found:
            found.add(carrier.name)
            carrier = by_child.get(carrier.parent)
    return found


def _says_gripper(joint: Joint) -> bool:
    return any(word in joint.name.lower() for word in GRIPPER_WORDS)
