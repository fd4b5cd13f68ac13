# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Bodies with floating hips, ground contact, and gaits whose feet do not slide.

The root of the description becomes the trunk instead of a foot, so each foot can be on the
ground. Two slides and a hinge connect ground and trunk; hip, knee and ankle of each leg follow.
Bodies, inertias and anatomical angles do not change.

Ground under a foot: F = max(0, k d^e + c d'), with the depth d of a point below the ground;
tangential friction is at most mu F, a smooth function of the sliding speed. This contact is from
Table 3 of the source (IMPACT of ADAMS): k = 100 N/mm^1.5, e = 1.5, c = 1 N s/mm, mu = 0.3. The
damper acts from the first contact (penetration depth 0).

Published curves of hip, knee and ankle do not fit segments of given lengths, as feet on the
ground would slide and sink by centimetres. Least squares find the nearest curves without this
error, and the path of the hips.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.gait import Gait, read_assumptions
from armid_ros.papers.exo.plant.leg_pair import assumed_stiffness, TiedPair
from armid_ros.robots import load_robot, Robot
from armid_ros.robots.load import robot_from_urdf
from armid_ros.robots.ties import centroid_ties
import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.optimize import least_squares

#: Harmonics of the curves; hips have only even ones, because both legs make the same motion.
_HARMONICS = 8
_SAMPLES = 100
#: Intervals with heel and toe on the ground, in cycles since heel strike.
HEEL_DOWN, TOE_DOWN = (0.0, 0.42), (0.12, 0.62)


@dataclass(frozen=True)
class LegLength:
    """
    Segment lengths of a leg [m].

    Attributes
    ----------
    thigh, shank, foot : float
        Lengths of the segments; that of the foot is from heel to toe.

    """

    thigh: float
    shank: float
    foot: float


@dataclass(frozen=True)
class WalkableGait:
    """
    Gait without sliding feet, with lean of the trunk, stride and path of the hips.

    Attributes
    ----------
    gait : Gait
        Hip flexion, knee flexion, ankle dorsiflexion.
    lean : float
        Forward lean of the trunk [rad].
    stride : float
        Distance per cycle [m].
    hips : ndarray, shape (N, 2)
        Path of the hips forward and up over a cycle, evenly sampled, without the mean forward
        motion [m].

    """

    gait: Gait
    lean: float
    stride: float
    hips: FloatArray


def foot_points(
    angles: FloatArray, hips: FloatArray, lean: float, leg: LegLength
) -> tuple[FloatArray, FloatArray]:
    """
    Return the positions of heel and toe of a leg, each of shape (N, 2) [m].

    Parameters
    ----------
    angles : ndarray, shape (N, 3)
        Hip, knee and ankle [rad].
    hips : ndarray, shape (N, 2)
        Position of the hips, forward and up [m].
    lean : float
        Forward lean of the trunk [rad].
    leg : LegLength
        Lengths.

    """
    thigh = angles[:, 0] - lean
    shank = thigh - angles[:, 1]
    foot = shank + angles[:, 2]
    heel = hips + leg.thigh * _downward(thigh) + leg.shank * _downward(shank)
    return heel, heel + leg.foot * np.column_stack([np.cos(foot), np.sin(foot)])


def walkable(
    gait: Gait,
    leg: LegLength,
    cycle: float,
    *,
    stride: float | None = None,
    lean: float | None = None,
) -> WalkableGait:
    """
    Return the gait without sliding or sinking feet that is nearest to a desired gait.

    Parameters
    ----------
    gait : Gait
        The desired curves.
    leg : LegLength
        Lengths of the legs.
    cycle : float
        Time of a cycle [s].
    stride, lean : float, optional
        Distance per cycle [m] and lean of the trunk [rad]; fitted to the curves by default.

    """
    phase = np.arange(_SAMPLES) / _SAMPLES
    turn = 2.0 * np.pi * np.outer(phase, np.arange(1, _HARMONICS + 1))
    basis = np.hstack([np.ones((_SAMPLES, 1)), np.cos(turn), np.sin(turn)])
    even = np.hstack([basis[:, :1], np.cos(turn[:, 1::2]), np.sin(turn[:, 1::2])])
    waves = np.concatenate([[0.0], *2 * [np.arange(2, _HARMONICS + 1, 2)]])
    bent = -((2.0 * np.pi * waves / cycle) ** 2) * even  # second derivative of the path
    count, paths, wanted = basis.shape[1], even.shape[1], gait(phase)
    heel_down, toe_down = _inside(phase, HEEL_DOWN), _inside(phase, TOE_DOWN)
    swing, foot_std = _inside(phase, (0.68, 0.93)), 0.3e-3  # of a foot that stands [m]

    def curves(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, float, float]:
        """Return leg angles, hip path, hip acceleration [m/s^2], trunk lean and stride."""
        # coefficients of hip, knee, ankle and path, lean, stride, position of the fixed foot
        joints, path = x[: 3 * count].reshape(3, count).T, x[3 * count : -3].reshape(2, paths).T
        own_lean = float(x[-3]) if lean is None else lean
        own_stride = float(x[-2]) if stride is None else stride
        return basis @ joints, even @ path, bent @ path, own_lean, own_stride

    def residual(x: FloatArray) -> FloatArray:
        angles, hips, acceleration, own_lean, own_stride = curves(x)
        way = np.column_stack([own_stride * phase, np.zeros(_SAMPLES)])
        heel, toe = foot_points(angles, hips + way, own_lean, leg)
        lowest = np.minimum(heel[:, 1], toe[:, 1])
        heel, toe = heel - [x[-1], 0.0], toe - [x[-1] + leg.foot, 0.0]
        return np.concatenate(
            [
                # angles keep to the given curves, the hips accelerate little, and the foot is
                # 20 mm above the ground in mid-swing
                ((angles - wanted) / np.radians([3.0, 3.0, 10.0])).ravel() / 10.0,
                heel[heel_down].ravel() / foot_std / 10.0,
                toe[toe_down].ravel() / foot_std / 10.0,
                (acceleration / np.array([1.0, 1.5])).ravel() / 10.0,
                np.minimum(lowest[swing] - 0.02, 0.0) / 3e-3,
            ]
        )

    start = np.zeros(3 * count + 2 * paths + 3)
    start[: 3 * count] = np.linalg.lstsq(basis, wanted, rcond=None)[0].T.ravel()
    start[3 * count + paths] = 0.9 * (leg.thigh + leg.shank)
    start[-3:] = 0.15 if lean is None else lean, 1.6 * (leg.thigh + leg.shank), 0.3
    found = least_squares(residual, start, x_scale='jac').x
    angles, hips, _, own_lean, own_stride = curves(found)
    return WalkableGait(
        Gait.fit(phase, angles, harmonics=_HARMONICS),
        own_lean,
        own_stride,
        hips - np.array([found[-1], 0.0]),
    )


def _downward(angle: FloatArray) -> FloatArray:
    """Return unit vectors, (N, 2), that point down, rotated forward by angles [rad]."""
    return np.column_stack([np.sin(angle), -np.cos(angle)])


def _inside(phase: FloatArray, ends: tuple[float, float]) -> np.typing.NDArray[np.bool_]:
    return np.asarray((phase >= ends[0]) & (phase <= ends[1]))


def ground_force(height: FloatArray, rising: FloatArray, sliding: FloatArray) -> FloatArray:
    """
    Return the contact force of the ground on points of a foot, forward and up [N].

    Parameters
    ----------
    height, rising, sliding : ndarray, shape (...)
        Height of the points above the ground [m], and their velocity up and forward [m/s].

    Returns
    -------
    ndarray, shape (..., 2)
        Forward and up [N].

    """
    depth = np.maximum(-height, 0.0)
    pressed = 100.0 * 1e3**1.5 * depth**1.5 - 1000.0 * rising
    up = np.where(height < 0.0, np.maximum(pressed, 0.0), 0.0)
    # sliding speed at 3/4 of the largest friction; the source does not describe the transition
    # from rest to sliding
    creep = read_assumptions()['ground_creep'].value
    return np.stack([-0.3 * up * np.tanh(sliding / creep), up], axis=-1)


SIDES = ('right', 'left')
#: Joints of the trunk: forward and up [m], lean [rad].
FLOATING = ('forward', 'up', 'lean')
_LEG = ('hip', 'knee', 'ankle')
#: Links of a leg and their axes: flexion and dorsiflexion are positive.
_LINKS, _AXES = ('thigh', 'shank', 'foot'), ('0 -1 0', '0 1 0', '0 -1 0')
#: Segments with a spring of a walking pair.
SEGMENTS = tuple(f'{side}_{link}' for side in SIDES for link in ('shank', 'thigh'))


def walker(robot: Robot) -> Robot:
    """
    Convert a robot with a fixed standing foot to a robot with a floating trunk and two legs.

    Parameters
    ----------
    robot : Robot
        A shipped body, such as human_legs.

    Returns
    -------
    Robot
        With the joints forward, up and lean of the trunk, and hip, knee and ankle of both legs,
        each with the prefix of the body.

    """
    prefix = robot.joints[0].split('_')[0]
    trunk, parent = f'{prefix}_trunk', f'{prefix}_ground'
    parts = [f'<robot name="{robot.name.replace("legs", "walker")}"><link name="{parent}"/>']
    for joint, child, axis, of in (
        (FLOATING[0], f'{prefix}_forward_slide', '1 0 0', None),
        (FLOATING[1], f'{prefix}_up_slide', '0 0 1', None),
        (FLOATING[2], trunk, '0 1 0', 'stance_hip'),
    ):
        body = None if of is None else robot.model.inertias[robot.index(f'{prefix}_{of}') + 1]
        parts.append(_joint_urdf(f'{prefix}_{joint}', parent, child, axis, body))
        parent = child
    lengths = leg_length(robot)
    for side in SIDES:
        parent = trunk
        ends = (0.0, -lengths.thigh, -lengths.shank)
        for joint, link, axis, end in zip(_LEG, _LINKS, _AXES, ends, strict=True):
            child = f'{prefix}_{side}_{link}'
            body = robot.model.inertias[robot.index(f'{prefix}_swing_{joint}') + 1]
            parts.append(_joint_urdf(f'{prefix}_{side}_{joint}', parent, child, axis, body, end))
            parent = child
    return robot_from_urdf(''.join([*parts, '</robot>']), source=robot.name)


def leg_length(robot: Robot) -> LegLength:
    """Return the segment lengths of a shipped exoskeleton or wearer."""
    assumed = read_assumptions()['segment_length'].value
    prefix = robot.joints[0].split('_')[0]
    side = 'right' if f'{prefix}_right_knee' in robot.joints else 'swing'
    knee, ankle = (
        robot.model.jointPlacements[robot.index(f'{prefix}_{side}_{joint}') + 1].translation
        for joint in ('knee', 'ankle')
    )
    return LegLength(float(-knee[2]), float(-ankle[2]), float(assumed['foot']))


def walking_pair(stiffness: npt.ArrayLike | None = None) -> TiedPair:
    """
    Return the shipped exoskeleton and wearer with floating trunks and four straps.

    Parameters
    ----------
    stiffness : array_like, optional
        Stiffness of all springs or of each [N/m]; by default that of ``assumptions.yaml``.

    """
    exo, human = (walker(load_robot(name)) for name in ('exoskeleton_legs', 'human_legs'))
    # a knee moves the shank, and a hip the thigh
    joints = [s.replace('shank', 'knee').replace('thigh', 'hip') for s in SEGMENTS]
    ties = centroid_ties(exo, human, [(f'exo_{j}', f'human_{j}') for j in joints])
    named = tuple(replace(tie, name=s) for tie, s in zip(ties, SEGMENTS, strict=True))
    return TiedPair(exo, human, named, assumed_stiffness(stiffness))


def columns(robot: Robot, side: str) -> list[int]:
    """Return the joint indices of hip, knee and ankle of a leg."""
    prefix = robot.joints[0].split('_')[0]
    return [robot.index(f'{prefix}_{side}_{joint}') for joint in _LEG]


def floating(robot: Robot) -> list[int]:
    """Return the joint indices of the floating trunk: forward, up and lean."""
    prefix = robot.joints[0].split('_')[0]
    return [robot.index(f'{prefix}_{name}') for name in FLOATING]


def contacts(robot: Robot) -> tuple[list[str], FloatArray]:
    """Return ankle joints, and heels and toes in the frames of these joints, (4, 3) [m]."""
    prefix = robot.joints[0].split('_')[0]
    ankles = [f'{prefix}_{side}_ankle' for side in SIDES for _ in range(2)]
    return ankles, np.tile([[0.0, 0.0, 0.0], [leg_length(robot).foot, 0.0, 0.0]], (2, 1))


def _joint_urdf(
    joint: str, parent: str, child: str, axis: str, body: pin.Inertia | None, up: float = 0.0
) -> str:
    """Return URDF text of a joint and its link: prismatic without a body, else revolute."""
    kind, far, inside = 'prismatic', '1000', ''
    if body is not None:
        kind, far = 'revolute', '3.2'
        lever = ' '.join(map(repr, body.lever.tolist()))
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.inertia.tolist()
        inside = (
            f'<inertial><origin xyz="{lever}"/><mass value="{body.mass!r}"/><inertia ixx="{xx!r}" '
            f'ixy="{xy!r}" ixz="{xz!r}" iyy="{yy!r}" iyz="{yz!r}" izz="{zz!r}"/></inertial>'
        )
    return (
        f'<joint name="{joint}" type="{kind}"><origin xyz="0 0 {up!r}"/><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="{axis}"/>'
        f'<limit lower="-{far}" upper="{far}" velocity="100" effort="1e6"/></joint>'
        f'<link name="{child}">{inside}</link>'
    )
