# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The leg pair's own recursion, (2) to (15) and (27), as plain vectors in the plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

G = np.array([0.0, -9.81])


def cross(a: np.ndarray, b: np.ndarray) -> float:
    """Return the component of a x b out of the plane x forward, y up."""
    return float(a[0] * b[1] - a[1] * b[0])


def turned(angle: float) -> np.ndarray:
    """Return the rotation that leans the upward vertical forward by an angle."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s], [-s, c]])


@dataclass(frozen=True)
class Segment:
    """Mass [kg], inertia [kg m^2], centroid and next joint from the joint, upright [m]."""

    mass: float
    inertia: float
    centroid: np.ndarray
    following: np.ndarray
    sign: float  # of the anatomical angle as a lean forward


def joint_torques(
    segments: list[Segment],
    base: np.ndarray,
    q: np.ndarray,
    dq: np.ndarray,
    ddq: np.ndarray,
    pushes: dict[int, np.ndarray],
    foot_force: np.ndarray | None = None,
) -> tuple[np.ndarray, list[np.ndarray]]:
    """
    Go from the swing foot inwards: forces and moments of each segment, then of the next.

    Parameters
    ----------
    segments : list of Segment
        Stance shank to swing foot.
    base : ndarray, shape (2,)
        Where the stance ankle is [m].
    q, dq, ddq : ndarray, shape (6,)
        Anatomical angles [rad] and their derivatives.
    pushes : dict of int to ndarray
        Forces on centroids of segments, by position in the list [N].
    foot_force : ndarray, shape (2,), optional
        What the ground does to the swing foot at its ankle [N].

    Returns
    -------
    tau : ndarray, shape (6,)
        Joint torques along the anatomical angles [N m].
    centroids : list of ndarray
        Where the centroids are [m].

    """
    lean = rate = growth = 0.0
    joint, acceleration = base, np.zeros(2)
    states = []
    for segment, angle, speed, change in zip(segments, q, dq, ddq, strict=True):
        lean, rate = lean + segment.sign * angle, rate + segment.sign * speed
        growth += segment.sign * change
        arms = [turned(lean) @ arm for arm in (segment.centroid, segment.following)]
        # forward lean turns y into x: derivative of an arm (x, y) is rate (y, -x)
        moved = [acceleration + growth * np.array([a[1], -a[0]]) - rate**2 * a for a in arms]
        states.append((joint, joint + arms[0], moved[0], growth))
        joint, acceleration = joint + arms[1], moved[1]
    force, moment, end = np.zeros(2), 0.0, joint
    tau = np.empty(len(segments))
    for number in reversed(range(len(segments))):
        segment, (joint, centroid, moving, growth) = segments[number], states[number]
        push = pushes.get(number, np.zeros(2))
        ground = foot_force if foot_force is not None and number == 5 else np.zeros(2)
        inner = segment.mass * (moving - G) + force - push - ground
        # moments about the centroid, counted along the forward lean, which is -z of the plane
        moment = (
            segment.inertia * growth
            + moment
            - cross(end - centroid, force)
            + cross(joint - centroid, inner)
            + cross(joint - centroid, ground)
        )
        force, end = inner, joint
        tau[number] = segment.sign * moment
    return tau, [state[1] for state in states]
