# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Selection of the driven joints, and positions of the other joints."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from armid_ros.errors import meant, RobotError
from armid_ros.robots.description import Description, Joint, MOVABLE
from armid_ros.robots.robot import Robot


@dataclass(frozen=True)
class HeldJoint:
    """
    Movable joint that the model locks, and its position.

    Attributes
    ----------
    name : str
        Name in the description.
    position : float
        Position at which the model locks the joint [rad or m].
    unit : str
        'rad' or 'm'.
    follows : str
        The joint that this joint mimics, the first of several; empty if none.
    carries : tuple of str
        The driven joints that this joint moves.

    """

    name: str
    position: float
    unit: str
    follows: str
    carries: tuple[str, ...]


def driven_joints(description: Description, names: Sequence[str] | None) -> tuple[Joint, ...]:
    """
    Return the driven joints: the joints `names`, or by default all but gripper joints.

    A joint that mimics others, or that a loop moves, is never driven. By default, a joint of a
    gripper is not driven either: this is a joint with a single mimic joint, or with finger,
    gripper or jaw in its name, unless it or a joint that follows it carries a joint of the arm.

    Raises
    ------
    RobotError
        If a name is unknown, repeated, not movable, a mimic joint, or a passive joint of a loop.
        The message lists the joints that can be named.

    """
    if names is None:
        free = _free(description)
        mimics = [(joint.name, joint.mimic) for joint in description.joints if joint.mimic]
        led = {mimic.joint for _, mimic in mimics if len(mimic.multipliers) == 1}
        gripper = {
            joint.name
            for joint in free
            if joint.name in led
            or any(word in joint.name.lower() for word in ('finger', 'gripper', 'jaw'))
        }
        carriers = _carriers(description, [j.name for j in free if j.name not in gripper])
        carriers |= {leader for name, m in mimics if name in carriers for leader in m.multipliers}
        chosen = tuple(j for j in free if j.name not in gripper or j.name in carriers)
        chosen = chosen or tuple(joint for joint in free if joint.name not in led)
    else:
        chosen = _by_name(description, names)
    if not chosen:
        raise RobotError('no joint of the robot can be driven; at least one is needed')
    # Pinocchio keeps tensors of the joints cubed, 1 GB for 250; a humanoid with both hands has 70
    most = 150
    if len(chosen) > most:
        raise RobotError(
            f'{len(chosen)} joints are driven; at most {most} can be '
            'identified together; name the joints of one arm with --joints'
        )
    return chosen


def several_arms(description: Description, driven: Sequence[str]) -> tuple[str, ...]:
    """Return a note that lists the arms if the driven joints belong to several arms."""
    arms = _arms(description, driven)
    if len(arms) < 2:
        return ()
    begins = ', '.join(f"'{arm[0]}' ({len(arm)} joints)" for arm in arms)
    return (f'{len(arms)} arms are driven, beginning with {begins}; --joints A,B,... selects one',)


def _arms(description: Description, joints: Sequence[str]) -> list[list[str]]:
    """Return the joint names of each arm: a chain of >= 3 joints from the last fork to a tip."""
    carriers = {name: _carriers(description, [name]) for name in joints}
    kept = list(joints)
    while kept:
        beyond = {j: {k for k in kept if j in carriers[k]} for j in kept}
        tips = {j for j in kept if not beyond[j]}
        limbs = {tip: [j for j in kept if (beyond[j] | {j}) & tips == {tip}] for tip in tips}
        # a shorter branch, such as a head or a trunk, is no arm
        short = {j for limb in limbs.values() if len(limb) < 3 for j in limb}
        if not short:
            arms = [sorted(limb, key=lambda j: len(carriers[j])) for limb in limbs.values()]
            return sorted(arms, key=lambda arm: joints.index(arm[0]))
        kept = [j for j in kept if j not in short]
    return []


def driven_in_words(robot: Robot) -> tuple[str, ...]:
    """Return notes on undriven joints, and on driven joints of several arms."""
    locked = [
        f'{joint.name} (follows {joint.follows})' if joint.follows else joint.name
        for joint in held_joints(robot)
    ]
    arms = several_arms(robot.description, robot.joints)
    if not locked:
        return arms
    most = 8  # joints are named
    more = f' and {len(locked) - most} more' if len(locked) > most else ''
    named = ', '.join(locked[:most])
    return (f'not driven, and locked: {named}{more}; --joints A,B,... selects others', *arms)


def joints_beside_arms(robot: Robot) -> tuple[str, ...]:
    """
    Return driven joints that belong to no arm, such as wheels, a head or a torso.

    The result is empty for a robot without an arm.

    """
    of_arms = {joint for arm in _arms(robot.description, robot.joints) for joint in arm}
    return tuple(joint for joint in robot.joints if joint not in of_arms) if of_arms else ()


def load_arms(
    load: Callable[[Sequence[str] | None], Robot], joints: Sequence[str] | None
) -> tuple[Robot, tuple[str, ...]]:
    """Load a robot with only the joints of its arms driven; also return the omitted joints."""
    robot = load(joints)
    others = () if joints else joints_beside_arms(robot)
    if others:
        robot = load([joint for joint in robot.joints if joint not in others])
    return robot, others


def held_joints(robot: Robot) -> tuple[HeldJoint, ...]:
    """Return the movable joints that the model locks, with their positions."""
    description = robot.description
    carriers = {name: _carriers(description, [name]) for name in robot.joints}
    return tuple(
        HeldJoint(
            joint.name,
            standing_position(description, joint, {}),
            joint.unit,
            joint.mimic.joint if joint.mimic else '',
            tuple(name for name in robot.joints if joint.name in carriers[name]),
        )
        for joint in description.movable()
        if joint.name not in (*robot.joints, *robot.moving)
    )


def standing_position(description: Description, joint: Joint, known: Mapping[str, float]) -> float:
    """Return the position of a locked joint [rad or m]: from `known`, or nearest to zero."""
    factors, position = leaders(description, joint, known)
    for name, factor in factors.items():
        leader = description.by_name[name]
        position += factor * known.get(name, min(max(0.0, leader.lower), leader.upper))
    return position


def leaders(
    description: Description, joint: Joint, stop: Collection[str], above: tuple[str, ...] = ()
) -> tuple[dict[str, float], float]:
    """
    Express the position of a mimic joint as weighted sum of independent joints plus offset.

    Parameters
    ----------
    description : Description
        The description.
    joint : Joint
        The joint.
    stop : collection of str
        Joints that count as free although they follow others.
    above : tuple of str
        The joints that follow this joint.

    Returns
    -------
    factors : dict of str to float
        Factor of each independent joint; 1 for the joint itself if it follows none.
    offset : float
        Position if the independent joints are at zero [rad or m].

    Raises
    ------
    RobotError
        If the joint follows itself.

    """
    if joint.mimic is None or joint.name in stop:
        return {joint.name: 1.0}, 0.0
    factors, offset = dict[str, float](), joint.mimic.offset
    above = (*above, joint.name)
    for name, multiplier in joint.mimic.multipliers.items():
        leader = description.by_name.get(name)
        if leader is None:
            continue
        if name in above:
            raise RobotError(f"joint '{name}' mimics itself, directly or through other joints")
        further, shift = leaders(description, leader, stop, above)
        offset += multiplier * shift
        for free, factor in further.items():
            factors[free] = factors.get(free, 0.0) + multiplier * factor
    return factors, offset


def _free(description: Description) -> list[Joint]:
    """Return movable joints that are neither mimic joints nor in a closed loop."""
    passive = description.passive
    return [j for j in description.movable() if not j.mimic and j.name not in passive]


def _by_name(description: Description, names: Sequence[str]) -> tuple[Joint, ...]:
    known, named = description.by_name, set[str]()
    free = ', '.join(joint.name for joint in _free(description))
    for name in names:
        if name not in known:
            raise RobotError(
                f"no joint is named '{name}'; joints to drive: {free}{meant(name, known)}"
            )
        if known[name].kind not in MOVABLE:
            raise RobotError(f"joint '{name}' is fixed; joints to drive: {free}")
        if known[name].mimic:
            raise RobotError(f"joint '{name}' is a mimic joint; joints to drive: {free}")
        if name in description.passive:
            raise RobotError(
                f"joint '{name}' is a passive joint of a closed loop; joints to drive: {free}"
            )
        if name in named:
            raise RobotError(f"joint '{name}' is named twice among the driven joints")
        named.add(name)
    return tuple(joint for joint in description.joints if joint.name in named)


def _carriers(description: Description, joints: Iterable[str]) -> set[str]:
    """Return the names of all joints between the base and any joint of `joints`."""
    by_child = {joint.child: joint for joint in description.joints}
    found: set[str] = set()
    for joint in joints:
        carrier = by_child.get(description.by_name[joint].parent)
        while carrier is not None and carrier.name not in found:
            found.add(carrier.name)
            carrier = by_child.get(carrier.parent)
    return found
