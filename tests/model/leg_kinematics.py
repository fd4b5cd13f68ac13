# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A seven-link body in the sagittal plane by the formulas of its source, to hold robots against.

Links 1 to 7: stance foot, stance shank, stance thigh, trunk, swing thigh, swing shank, swing foot.
The origin is the toe of the stance foot, x forward, y up. All angles are anatomical [rad]:
flexion of hips and knees, dorsiflexion of ankles. The source counts the swing hip from the upward
vertical; it is pi - flexion.
Source: lower-limb exoskeleton with elastic human-machine interaction, Table 1, (16) to (26).

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray
import numpy as np


@dataclass(frozen=True)
class LegAngles:
    """
    Angles of both legs [rad], each an array of any one shape.

    Attributes
    ----------
    hip, knee, ankle : ndarray
        Of the stance leg. A foot that is flat on the ground has ankle = knee - hip when the trunk
        is upright, which it is in this model.
    swing_hip, swing_knee, swing_ankle : ndarray
        Of the swing leg.

    """

    hip: FloatArray
    knee: FloatArray
    ankle: FloatArray
    swing_hip: FloatArray
    swing_knee: FloatArray
    swing_ankle: FloatArray


@dataclass(frozen=True)
class LegLengths:
    """
    Lengths of the segments and where their centroids are [m].

    Attributes
    ----------
    foot, shank, thigh : float
        l1, l2 and l3, the same for l7, l6 and l5.
    shank_centroid, thigh_centroid : float
        From the ankle and from the knee; r6 and r5, l2 - r2 and l3 - r3.
    trunk_centroid : float
        r4, above the hip.
    pelvis : float
        Half the way between the hips along the plane, d1; zero where they are beside each other.

    """

    foot: float
    shank: float
    thigh: float
    shank_centroid: float
    thigh_centroid: float
    trunk_centroid: float
    pelvis: float = 0.0


@dataclass(frozen=True)
class LegCentroids:
    """
    Centroids of the segments, each of shape (..., 2) [m]: x forward, y up.

    Attributes
    ----------
    stance_shank, stance_thigh, trunk, swing_thigh, swing_shank : ndarray
        c2 to c6; of the exoskeleton c9 to c13.

    """

    stance_shank: FloatArray
    stance_thigh: FloatArray
    trunk: FloatArray
    swing_thigh: FloatArray
    swing_shank: FloatArray


def leg_centroids(angles: LegAngles, lengths: LegLengths) -> LegCentroids:
    """Return the centroids by the closed formulas, (17) to (26)."""
    shank_angle = angles.knee - angles.hip
    foot_angle = shank_angle - angles.ankle
    swing_hip = np.pi - angles.swing_hip
    thigh, shank = lengths.thigh, lengths.shank
    ankle = lengths.foot * _vector(-np.cos(foot_angle), np.sin(foot_angle))
    hip = (
        ankle
        + shank * _vector(np.sin(shank_angle), np.cos(shank_angle))
        + thigh * _vector(-np.sin(angles.hip), np.cos(angles.hip))
    )
    stance_r2, stance_r3 = shank - lengths.shank_centroid, thigh - lengths.thigh_centroid
    other_hip = hip + np.array([-2.0 * lengths.pelvis, 0.0])
    along_thigh = _vector(np.sin(swing_hip), np.cos(swing_hip))
    calf = swing_hip + angles.swing_knee
    return LegCentroids(
        stance_shank=ankle
        + (shank - stance_r2) * _vector(np.sin(shank_angle), np.cos(shank_angle)),
        stance_thigh=hip + stance_r3 * _vector(np.sin(angles.hip), -np.cos(angles.hip)),
        trunk=hip + np.array([-lengths.pelvis, lengths.trunk_centroid]),
        swing_thigh=other_hip + (thigh - lengths.thigh_centroid) * along_thigh,
        swing_shank=other_hip
        + (shank - lengths.shank_centroid) * _vector(np.sin(calf), np.cos(calf))
        + thigh * along_thigh,
    )


def leg_frames(angles: LegAngles, lengths: LegLengths) -> FloatArray:
    """
    Chain the Denavit-Hartenberg rows of Table 1 from the toe of the stance foot.

    Parameters
    ----------
    angles : LegAngles
        One posture, numbers or arrays of shape ().
    lengths : LegLengths
        The body.

    Returns
    -------
    ndarray, shape (8, 4, 4)
        Frames at the ends of the rows 0, 8, ..., 14: stance ankle, knee and hip, middle of the
        pelvis, swing hip, knee, ankle and toe.

    Notes
    -----
    Standard Denavit-Hartenberg, T = Rz(theta) Tx(a) Rx(alpha), every d = 0. Rows with alpha = 180
    deg turn the plane over and back.

    """
    q8 = angles.knee - angles.hip - angles.ankle
    rows: tuple[tuple[FloatArray | float, float, bool], ...] = (
        (np.pi - q8, lengths.foot, False),
        (-np.pi / 2.0 - angles.ankle, lengths.shank, False),
        (angles.knee, lengths.thigh, False),
        (np.pi / 2.0 - angles.hip, lengths.pelvis, True),
        (0.0, lengths.pelvis, False),
        (np.pi / 2.0 + (np.pi - angles.swing_hip), lengths.thigh, True),
        (-angles.swing_knee, lengths.shank, False),
        (np.pi - (np.pi / 2.0 - angles.swing_ankle), lengths.foot, False),
    )
    frames = np.empty((len(rows), 4, 4))
    frame = np.eye(4)
    for number, (theta, a, turned) in enumerate(rows):
        frame = frame @ _dh(float(theta), a, -1.0 if turned else 1.0)
        frames[number] = frame
    return frames


def _vector(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.stack([x, y], axis=-1)


def _dh(theta: float, a: float, up: float) -> FloatArray:
    c, s = np.cos(theta), np.sin(theta)
    return np.array(
        [
            [c, -s * up, 0.0, a * c],
            [s, c * up, 0.0, a * s],
            [0.0, 0.0, up, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
