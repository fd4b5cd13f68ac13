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


@dataclass(frozen=True)
class Camera:
    """
    Where space is looked at from, without perspective.

    Attributes
    ----------
    azimuth : float
        Direction of the eye about z, from x [rad].
    elevation : float
        Height of the eye over the horizon [rad].

    """

    azimuth: float
    elevation: float

    def flat(self, points: FloatArray) -> FloatArray:
        """Return what is right and up of points, shape (..., 3) to (..., 2) [m]."""
        (sa, ca), (se, ce) = _sine_cosine(self.azimuth), _sine_cosine(self.elevation)
        axes = np.array([[-sa, ca, 0.0], [-ca * se, -sa * se, ce]])
        return np.asarray(points @ axes.T)

    def near(self, points: FloatArray) -> FloatArray:
        """Return how near points are to the eye, shape (..., 3) to (...) [m]."""
        (sa, ca), (se, ce) = _sine_cosine(self.azimuth), _sine_cosine(self.elevation)
        return np.asarray(points @ np.array([ca * ce, sa * ce, se]))


#: From the left, x to the right and z up.
SIDE = Camera(-np.pi / 2.0, 0.0)
#: From the front right and above.
CORNER = Camera(np.radians(-55.0), np.radians(18.0))


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


def _sine_cosine(angle: float) -> tuple[float, float]:
    return float(np.sin(angle)), float(np.cos(angle))
