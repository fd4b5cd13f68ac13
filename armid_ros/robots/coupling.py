# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Joints that follow driven joints, as mimic joints or in closed loops, and the limits of all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
import itertools

from armid_ros.errors import RobotError
from armid_ros.motion import FloatArray, read_only
from armid_ros.robots.description import Description, Joint
from armid_ros.robots.mechanism import Mechanism
from armid_ros.robots.robot import joint_fields, Robot
from armid_ros.robots.selection import leaders, standing_position
import numpy as np
import pinocchio as pin


def moving_joints(description: Description, driven: Sequence[str]) -> tuple[str, ...]:
    """
    Return the names of joints that move a link when `driven` joints move, in file order.

    A driven joint that others follow is a motor without a body if neither its link nor the links
    that it carries have inertia.

    """
    free, bodies = (
        {*driven, *description.passive},
        {name for name, inertial in description.links.items() if inertial},
    )
    while True:  # links above a link with inertia move with it
        more = {j.parent for j in description.joints if j.child in bodies} - bodies
        if not more:
            break
        bodies |= more
    led = {name for joint in description.joints if joint.mimic for name in joint.mimic.multipliers}
    return tuple(
        joint.name
        for joint in description.movable()
        if free & set(leaders(description, joint, ())[0])
        and not (joint.name in led and joint.name in driven and joint.child not in bodies)
    )


def couple(tree: Robot, driven: Sequence[Joint], known: Mapping[str, float]) -> Robot:
    """
    Return the robot in which only `driven` joints are driven, and coupled joints follow.

    Parameters
    ----------
    tree : Robot
        The robot with all moving joints driven.
    driven : sequence of Joint
        The driven joints.
    known : mapping of str to float
        Positions of joints that neither are driven nor move [rad or m].

    Returns
    -------
    Robot
        Limits of the driven joints are narrowed, so that all moving joints keep theirs.

    Raises
    ------
    RobotError
        If a loop does not close, or leaves passive joints free.

    """
    order = {name: number for number, name in enumerate(tree.joints)}
    driven = sorted(driven, key=lambda joint: order.get(joint.name, len(order)))
    names = [joint.name for joint in driven]
    if tuple(names) == tree.joints:
        return tree
    own = joint_fields(driven)
    start = np.clip(np.zeros(len(names)), own['lower'], own['upper'])
    mechanism = _mechanism(tree, names, start, known)
    lower, upper = _narrowed_limits(mechanism, tree, own['lower'], own['upper'])
    if mechanism.loops:
        mechanism, lower, upper = _closing_range(mechanism, tree, lower, upper)
    share = np.sum(mechanism.largest, axis=1)
    rates = tree.velocity_limit / np.where(share > 0.0, share, 1.0)
    acts = mechanism.largest > 0.0
    velocity = np.min(np.where(acts, rates[:, np.newaxis], np.inf), axis=0, initial=np.inf)
    follow = [name for name in tree.joints if name not in names]
    limits = {
        'lower': lower,
        'upper': upper,
        'velocity_limit': np.minimum(velocity, own['velocity_limit']),
    }
    notes = (*tree.notes, f'coupled to the driven joints: {", ".join(follow)}')
    return replace(tree, **(own | limits), mechanism=mechanism, notes=notes)


def _mechanism(
    tree: Robot, names: Sequence[str], start: FloatArray, known: Mapping[str, float]
) -> Mechanism:
    """Return the map from positions of the driven joints to positions of all moving joints."""
    description = tree.description
    passive = [name for name in description.passive if name in tree.joints]
    matrix, offset = np.zeros((len(tree.joints), len(names) + len(passive))), []
    place = {name: column for column, name in enumerate([*names, *passive])}
    for row, name in zip(matrix, tree.joints, strict=True):
        factors, shift = leaders(description, description.by_name[name], ())
        for leader, factor in factors.items():
            if leader in place:
                row[place[leader]] += factor
            else:
                held = description.by_name[leader]
                shift += factor * standing_position(description, held, known)
        offset.append(shift)
    model, loops = tree.model.copy(), []
    for loop in description.loops:
        frames = []
        for link, point in zip(loop.links, loop.points, strict=True):
            carrier = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
            placement = carrier.placement * pin.SE3(np.eye(3), np.array(point))
            named = f'{link}_loop_{len(model.frames)}'
            frames.append(pin.Frame(named, carrier.parentJoint, placement, pin.FrameType.OP_FRAME))
        loops.append((model.addFrame(frames[0]), model.addFrame(frames[1])))
    ends = [(description.by_name[name].lower, description.by_name[name].upper) for name in passive]
    n = len(names)
    return Mechanism(
        joints=tree.joints,
        driven=read_only(matrix[:, :n]),
        passive=read_only(matrix[:, n:]),
        offset=read_only(offset),
        start=(
            start,
            np.array([min(max(0.0, lower), upper) for lower, upper in ends]),
        ),
        model=model,
        loops=tuple(loops),
        lower=np.full(n, -np.inf),
        upper=np.full(n, np.inf),
        largest=read_only(np.abs(matrix[:, :n])),
    )


def _narrowed_limits(
    mechanism: Mechanism, tree: Robot, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Narrow the position limits of driven joints so that coupled joints keep their limits."""
    lower, upper = lower.copy(), upper.copy()
    followers = ~np.any(mechanism.passive, axis=1)
    ends = np.stack([tree.lower, tree.upper], axis=1) - mechanism.offset[:, np.newaxis]
    rows = list(zip(mechanism.driven[followers], ends[followers], strict=True))
    for row, end in rows:
        if np.count_nonzero(row) == 1:
            k = int(np.flatnonzero(row)[0])
            low, high = np.sort(end / row[k])
            lower[k], upper[k] = max(lower[k], low), min(upper[k], high)
    several = [
        (row, end) for row, end in rows if np.count_nonzero(row) > 1 and np.isfinite(end).all()
    ]
    if several:  # a box within the polytope, around the middle of the ranges
        matrix = np.array([row for row, _ in several])
        middle = np.linalg.lstsq(matrix, np.mean([end for _, end in several], axis=1))[0]
        for row, end in several:
            acts = row != 0.0  # noqa: RUF069 - as described
            room = np.abs(end - row @ middle).min() / np.abs(row).sum()
            lower[acts] = np.maximum(lower, middle - room)[acts]
            upper[acts] = np.minimum(upper, middle + room)[acts]
    if np.any(lower >= upper):
        raise RobotError(
            'the position limits of coupled joints leave no range of motion for driven joints; '
            'widen these limits in the description'
        )
    return lower, upper


def _closing_range(
    mechanism: Mechanism, tree: Robot, lower: FloatArray, upper: FloatArray
) -> tuple[Mechanism, FloatArray, FloatArray]:
    """
    Narrow the limits of driven joints so that loops close and passive joints keep their limits.

    Both conditions hold up to 10 % beyond the new limits, because motions may overshoot limits.

    """
    start = mechanism.start[0]
    moved = np.any(mechanism.passive, axis=1)
    slopes = [np.abs(mechanism.at(start + shift).jacobian[moved]) for shift in (0.0, 0.01, -0.01)]
    own = np.flatnonzero(np.max(slopes, axis=(0, 1)) > 1e-9)
    ends = np.array([lower, upper])
    ends = np.where(np.isfinite(ends), ends, start + np.array([[-np.pi], [np.pi]]))
    count = 21 if len(own) < 3 else 5
    for share in np.linspace(1.1, 0.1, 21):
        box = start + share * (ends - start)
        grid = np.tile(start, (count ** len(own), 1))
        grid[:, own] = list(itertools.product(*np.linspace(box[0, own], box[1, own], count).T))
        try:
            q, jacobian, _ = mechanism.states(grid)
        except RobotError:
            continue
        inside = (q > tree.lower) & (q < tree.upper)
        # near a dead centre, the passive joints are much faster than the driven ones
        if inside[:, moved].all() and np.abs(jacobian).max() < 10.0:
            break
    else:
        raise RobotError(
            'a closed loop of the description does not close near zero positions of driven joints '
            'within the limits of passive joints; correct the points of the loop or these limits'
        )
    ends[:, own] = (start + share / 1.1 * (ends - start))[:, own]
    within = [np.maximum(lower, ends[0]), np.minimum(upper, ends[1])]
    reach = np.array([np.full(len(start), -np.inf), np.full(len(start), np.inf)])
    reach[:, own] = box[:, own]
    largest = mechanism.largest.copy()
    # margin for J between the samples: half of its change over the range
    largest[moved] = (np.abs(jacobian).max(axis=0) + 0.5 * np.ptp(jacobian, axis=0))[moved]
    found = replace(mechanism, lower=reach[0], upper=reach[1], largest=read_only(largest))
    return found, within[0], within[1]
