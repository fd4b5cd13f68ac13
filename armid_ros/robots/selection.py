# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which joints of a description are driven, and where the others stand."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.errors import RobotError
from armid_ros.robots.description import Description, Joint

GRIPPER_WORDS = ('finger', 'gripper', 'jaw')
#: Branches of fewer joints are no arms: a head, a trunk.
SHORTEST_ARM = 3


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
    return chosen


def several_arms(description: Description, driven: Sequence[Joint]) -> tuple[str, ...]:
    """Return a note where the driven joints are those of several arms; none where of one."""
    names = {joint.name for joint in driven}
    after = {
        joint.name: [other for other in description.beyond(joint) if other.name in names]
        for joint in driven
    }
    # An arm begins where a joint is not carried by another driven one, or beside others.
    firsts = [
        joint
        for joint in driven
        if not any(joint in after[other.name] for other in driven)
        or any(_beside(joint, other, after) for other in driven)
    ]
    arms = [
        joint
        for joint in firsts
        if len(after[joint.name]) + 1 >= SHORTEST_ARM
        and not any(other in after[joint.name] for other in firsts)
    ]
    if len(arms) < 2:
        return ()
    begins = ', '.join(f"'{joint.name}' ({len(after[joint.name]) + 1} joints)" for joint in arms)
    return (f'{len(arms)} arms are driven, beginning with {begins}; --joints A,B,... takes one',)


def _beside(joint: Joint, other: Joint, after: dict[str, list[Joint]]) -> bool:
    """Whether two joints are the first ones of branches that part after one driven joint."""
    if joint is other or other in after[joint.name] or joint in after[other.name]:
        return False
    return _carriers(joint, after) == _carriers(other, after)


def _carriers(joint: Joint, after: dict[str, list[Joint]]) -> set[str]:
    return {name for name, beyond in after.items() if joint in beyond}


def standing_position(description: Description, joint: Joint) -> float:
    """Position [rad or m] at which a joint that is not driven stands: 0 or what is nearest."""
    if joint.mimic:
        masters = [other for other in description.joints if other.name == joint.mimic.joint]
        leader = standing_position(description, masters[0]) if masters else 0.0
        return joint.mimic.multiplier * leader + joint.mimic.offset
    return min(max(0.0, joint.lower), joint.upper)


def _by_name(description: Description, names: Sequence[str], source: str) -> tuple[Joint, ...]:
    known = {joint.name: joint for joint in description.joints}
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
        if list(names).count(name) > 1:
            raise RobotError(f"{source}: joint '{name}' is named twice among the driven joints")
    return tuple(joint for joint in description.joints if joint.name in names)


def _by_default(description: Description) -> tuple[Joint, ...]:
    free = [joint for joint in description.movable() if not joint.mimic]
    led = {joint.mimic.joint for joint in description.joints if joint.mimic}
    gripper = {joint.name for joint in free if joint.name in led or _says_gripper(joint)}

    def carries_arm(joint: Joint) -> bool:
        beyond = description.beyond(joint)
        return any(other in free and other.name not in gripper for other in beyond)

    driven = tuple(joint for joint in free if joint.name not in gripper or carries_arm(joint))
    return driven or tuple(joint for joint in free if joint.name not in led)


def _says_gripper(joint: Joint) -> bool:
    return any(word in joint.name.lower() for word in GRIPPER_WORDS)
