# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A walkable gait: feet on the ground do not move over the whole cycle.

Published curves of hip, knee and ankle do not fit segments of given lengths: feet on the ground
would slide and sink by centimetres. Least squares find the nearest curves without this error,
together with the path of the hips.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.gait import Gait
import numpy as np
from scipy.optimize import least_squares

#: Harmonics of the curves; the hips have only even ones, because both legs move alike.
_HARMONICS = 8
_SAMPLES = 100
#: Intervals with heel and toe on the ground, in cycles since heel strike.
HEEL_DOWN, TOE_DOWN = (0.0, 0.42), (0.12, 0.62)
#: Standard deviations of the least squares: angles from the given curves [rad], and foot on the
#: ground from its fixed position [m].
_FREEDOM = np.radians([3.0, 3.0, 10.0])
_PLACE = 0.3e-3
#: Standard deviation of the acceleration of the hips forward and up [m/s^2]: walking is smooth.
_HURRY = np.array([1.0, 1.5])
#: Height of the swing foot in mid-swing [m], its phase, and its standard deviation [m].
_CLEARANCE, _SWING, _CLEAR = 0.02, (0.68, 0.93), 3e-3


@dataclass(frozen=True)
class LegLength:
    """
    Lengths of a leg [m].

    Attributes
    ----------
    thigh, shank, foot : float
        Of the segments, the foot from heel to toe.

    """

    thigh: float
    shank: float
    foot: float


@dataclass(frozen=True)
class WalkableGait:
    """
    Curves of one leg, and the motion of the hips.

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
    Return heel and toe of a leg, both of shape (N, 2) [m].

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
    heel = hips + leg.thigh * _hanging(thigh) + leg.shank * _hanging(shank)
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
    Find the nearest gait whose feet do not move on the ground.

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
    curves = _Curves(cycle, stride, lean)
    phase, count, paths = curves.phase, curves.basis.shape[1], curves.even.shape[1]
    wanted = gait(phase)
    heel_down, toe_down = _inside(phase, HEEL_DOWN), _inside(phase, TOE_DOWN)
    swing = _inside(phase, _SWING)

    def feet(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return distances of heel and toe from the fixed foot, and height of the lower."""
        angles, hips, own_lean, own_stride = curves.of(x)
        way = np.column_stack([own_stride * phase, np.zeros(_SAMPLES)])
        heel, toe = foot_points(angles, hips + way, own_lean, leg)
        stand, far = np.array([x[-1], 0.0]), np.array([leg.foot, 0.0])
        return heel - stand, toe - stand - far, np.minimum(heel[:, 1], toe[:, 1])

    def residual(x: FloatArray) -> FloatArray:
        heel, toe, lowest = feet(x)
        return np.concatenate(
            [
                ((curves.of(x)[0] - wanted) / _FREEDOM).ravel() / 10.0,
                heel[heel_down].ravel() / _PLACE / 10.0,
                toe[toe_down].ravel() / _PLACE / 10.0,
                (curves.hurry(x) / _HURRY).ravel() / 10.0,
                np.minimum(lowest[swing] - _CLEARANCE, 0.0) / _CLEAR,
            ]
        )

    start = np.zeros(3 * count + 2 * paths + 3)
    start[: 3 * count] = np.linalg.lstsq(curves.basis, wanted, rcond=None)[0].T.ravel()
    start[3 * count + paths] = 0.9 * (leg.thigh + leg.shank)
    start[-3:] = 0.15 if lean is None else lean, 1.6 * (leg.thigh + leg.shank), 0.3
    found = least_squares(residual, start, x_scale='jac').x
    angles, hips, own_lean, own_stride = curves.of(found)
    return WalkableGait(
        Gait.fit(phase, angles, harmonics=_HARMONICS),
        own_lean,
        own_stride,
        hips - np.array([found[-1], 0.0]),
    )


class _Curves:
    """Curves of a leg and a path of the hips, by the coefficients of their series."""

    # order of the vector: hip, knee, ankle, path of the hips forward and up, lean, stride,
    # position of the fixed foot

    def __init__(self, cycle: float, stride: float | None, lean: float | None):
        self.phase = np.arange(_SAMPLES) / _SAMPLES
        turn = 2.0 * np.pi * np.outer(self.phase, np.arange(1, _HARMONICS + 1))
        self.basis = np.hstack([np.ones((_SAMPLES, 1)), np.cos(turn), np.sin(turn)])
        self.even = np.hstack([self.basis[:, :1], np.cos(turn[:, 1::2]), np.sin(turn[:, 1::2])])
        waves = np.concatenate([[0.0], *2 * [np.arange(2, _HARMONICS + 1, 2)]])
        self._bent = -((2.0 * np.pi * waves / cycle) ** 2) * self.even
        self._stride, self._lean = stride, lean

    def of(self, x: FloatArray) -> tuple[FloatArray, FloatArray, float, float]:
        """Return angles, path of the hips, lean and stride."""
        count = self.basis.shape[1]
        angles = self.basis @ x[: 3 * count].reshape(3, count).T
        lean, stride = x[-3:-1].tolist()
        return (
            angles,
            self.even @ self._path(x),
            lean if self._lean is None else self._lean,
            stride if self._stride is None else self._stride,
        )

    def hurry(self, x: FloatArray) -> FloatArray:
        """Return the acceleration of the hips, shape (N, 2) [m/s^2]."""
        return np.asarray(self._bent @ self._path(x))

    def _path(self, x: FloatArray) -> FloatArray:
        paths = self.even.shape[1]
        return x[3 * self.basis.shape[1] : -3].reshape(2, paths).T


def _hanging(angle: FloatArray) -> FloatArray:
    """Return unit vectors down, turned forward, shape (N, 2)."""
    return np.column_stack([np.sin(angle), -np.cos(angle)])


def _inside(phase: FloatArray, ends: tuple[float, float]) -> np.typing.NDArray[np.bool_]:
    return np.asarray((phase >= ends[0]) & (phase <= ends[1]))
