# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The actions of several effects as one."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.effects.action import (
    Action,
    Displacement,
    DryFriction,
    NO_FRICTION,
    TorqueLaw,
    Transmission,
)
from armid_ros.effects.slipping import Hysteresis
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np


def merge_actions(robot: Robot, actions: Sequence[Action]) -> Action:
    """
    Join the actions of several effects on one robot.

    Matrices and torques add up; dry friction along one direction becomes one element; what acts on
    the recording acts in the order given.

    """
    zero = np.zeros((robot.n_joints, robot.n_joints))
    readings = [a.reading for a in actions if a.reading is not None]
    drives = [a.drive for a in actions if a.drive is not None]
    displacements = [a.displacement for a in actions if a.displacement is not None]

    def reading(motion: Motion, tau: FloatArray) -> FloatArray:
        for read in readings:
            tau = read(motion, tau)
        return tau

    def drive(tau: FloatArray) -> FloatArray:
        for give in drives:
            tau = give(tau)
        return tau

    def displacement(motion: Motion) -> Displacement:
        parts = [displace(motion) for displace in displacements]
        return Displacement(*(np.sum(arrays, axis=0) for arrays in zip(*parts, strict=True)))

    return Action(
        damping=sum((a.damping for a in actions if a.damping is not None), zero),
        inertia=sum((a.inertia for a in actions if a.inertia is not None), zero),
        dry_friction=_merge_friction([a.dry_friction for a in actions if a.dry_friction]),
        hysteresis=_merge_hysteresis([a.hysteresis for a in actions if a.hysteresis]),
        torque=_sum([a.torque for a in actions if a.torque is not None]),
        link_torque=_sum([a.link_torque for a in actions if a.link_torque is not None]),
        robot=robot,
        transmission=_merge_transmissions([a.transmission for a in actions if a.transmission]),
        drive=drive if drives else None,
        displacement=displacement if displacements else None,
        reading=reading if readings else None,
        reading_memory=sum(a.reading_memory for a in actions),
    )


def _sum(laws: list[TorqueLaw]) -> TorqueLaw | None:
    def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
        return np.asarray(sum(law(t, q, dq) for law in laws))

    return torque if laws else None


def _merge_friction(elements: list[DryFriction]) -> DryFriction | None:
    """Stack friction elements; those along the same direction become one with summed levels."""
    if not elements:
        return None
    directions = np.vstack([e.directions for e in elements])
    unique, inverse = np.unique(directions, axis=0, return_inverse=True)
    sums = np.zeros((3, len(unique)))
    for row, values in enumerate(
        (
            [e.lower for e in elements],
            [e.upper for e in elements],
            [np.zeros(len(e.lower)) if e.load_share is None else e.load_share for e in elements],
        )
    ):
        np.add.at(sums[row], inverse.ravel(), np.concatenate(values))
    active = np.any(np.abs(sums) > NO_FRICTION, axis=0)
    lower, upper, share = sums[:, active]
    return DryFriction(unique[active], lower, upper, share if np.any(share) else None)


def _merge_hysteresis(elements: list[Hysteresis]) -> Hysteresis | None:
    if not elements:
        return None
    level = np.concatenate([e.level for e in elements])
    active = level != 0.0  # noqa: RUF069 - any other level is an element
    if not np.any(active):
        return None
    directions = np.vstack([e.directions for e in elements])
    distance = np.concatenate([e.distance for e in elements])
    return Hysteresis(directions[active], level[active], distance[active])


def _merge_transmissions(parts: list[Transmission]) -> Transmission | None:
    """Put transmissions in series: compliances and gaps add up."""
    if not parts:
        return None
    compliance = np.sum([1.0 / part.stiffness for part in parts], axis=0)
    with np.errstate(divide='ignore'):
        stiffness = 1.0 / compliance
    return Transmission(
        stiffness,
        np.sum([part.damping for part in parts], axis=0),
        np.sum([part.gap for part in parts], axis=0),
    )
