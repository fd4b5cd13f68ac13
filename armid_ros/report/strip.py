# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Poses side by side on paper: where a point of space is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.motion import FloatArray
import numpy as np

#: Height of the line of captions [px].
_CAPTION = 30.0


def view(azimuth: float, elevation: float) -> FloatArray:
    """
    Return the directions right, up and towards the eye, as seen without perspective, shape (3, 3).

    Parameters
    ----------
    azimuth : float
        Direction of the eye about z, from x [rad].
    elevation : float
        Height of the eye over the horizon [rad].

    """
    (sa, ca), (se, ce) = ((np.sin(x), np.cos(x)) for x in (azimuth, elevation))
    return np.array([[-sa, ca, 0.0], [-ca * se, -sa * se, ce], [ca * ce, sa * ce, se]])


#: From the left, x to the right and z up.
SIDE = view(-np.pi / 2.0, 0.0)
#: From the front right and above.
CORNER = view(np.radians(-55.0), np.radians(18.0))


def flat(seen: FloatArray, points: FloatArray) -> FloatArray:
    """Return what is right and up of points in a view, shape (..., 3) to (..., 2) [m]."""
    return np.asarray(points @ seen[:2].T)


@dataclass(frozen=True)
class Strip:
    """
    Equal frames, one for each pose.

    Attributes
    ----------
    left, top : float
        Edges of every frame [m].
    pitch, height : float
        Size of a frame [px].
    scale : float
        [px/m].
    count : int
        Number of poses.

    """

    left: float
    top: float
    pitch: float
    height: float
    scale: float
    count: int

    @classmethod
    def around(cls, points: FloatArray, count: int, margin: float, scale: float) -> Strip:
        """Make frames that hold all points, shape (K, 2), with a margin [m]."""
        left, low = (points.min(axis=0) - margin).tolist()
        right, high = (points.max(axis=0) + margin).tolist()
        return cls(left, high, (right - left) * scale, (high - low) * scale, scale, count)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height with captions [px]."""
        return round(self.pitch * self.count, 1), round(self.height + _CAPTION, 1)

    def place(self, points: FloatArray, pose: int) -> FloatArray:
        """Return where flat points, shape (..., 2) [m], are in the frame of a pose [px]."""
        right = pose * self.pitch + self.scale * (points[..., 0] - self.left)
        return np.stack([right, self.scale * (self.top - points[..., 1])], axis=-1)

    def captions(self, texts: Sequence[str]) -> tuple[tuple[float, str], ...]:
        """Return texts with the middle of their frames [px]."""
        return tuple((round((k + 0.5) * self.pitch, 1), text) for k, text in enumerate(texts))


def svg_points(points: FloatArray) -> str:
    """Return points, shape (K, 2) [px], as coordinates of SVG."""
    return ' '.join(f'{x:.1f},{y:.1f}' for x, y in points)
