# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Hip, knee and ankle angles over a gait cycle, and the joint motion of both legs.

Values that are missing in the source of the leg pair are assumptions with reasons.

The phase of a leg is 0 at heel strike; the other leg is half a cycle later. The stance foot stays
flat and the trunk upright, so that the stance ankle is knee - hip.

"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from armid_ros.files import load_yaml
from armid_ros.motion import FloatArray, freeze, Motion
import numpy as np

#: Number of harmonics of a gait; higher harmonics are negligible in walking.
_HARMONICS = 6


@dataclass(frozen=True)
class Assumption:
    """
    Assumed value of a quantity that the source paper on the exoskeleton does not state.

    Attributes
    ----------
    value : float, list, dict or str
        Assumed value.
    unit : str
        Its unit.
    reason : str
        Reason for the value.

    """

    value: Any
    unit: str
    reason: str


@lru_cache
def read_assumptions() -> Mapping[str, Assumption]:
    """Read `assumptions.yaml`: assumed quantities of exoskeleton and wearer, by name."""
    text = leg_pair_file('exoskeleton_legs/assumptions.yaml').read_text(encoding='utf-8')
    return {name: Assumption(**entry) for name, entry in load_yaml(text).items()}


def leg_pair_file(name: str) -> Path:
    """Return the path of a shipped robot file, such as 'human_legs/gait.csv'."""
    return Path(str(resources.files('armid_ros.robots').joinpath(name)))


@dataclass(frozen=True)
class Gait:
    """
    Hip, knee and ankle angles of a leg as a Fourier series of the gait phase.

    Attributes
    ----------
    cosine, sine : ndarray, shape (H + 1, 3)
        Coefficients of hip flexion, knee flexion and ankle dorsiflexion [rad].

    """

    cosine: FloatArray
    sine: FloatArray

    def __post_init__(self) -> None:
        """Make the coefficients read-only."""
        freeze(self, 'cosine', 'sine')

    @classmethod
    def fit(cls, phase: FloatArray, angles: FloatArray, harmonics: int = _HARMONICS) -> Gait:
        """Fit a Fourier series to joint angles, (N, 3) [rad], at gait phases 0 to 1, (N,)."""
        turn = 2.0 * np.pi * np.outer(phase, np.arange(harmonics + 1))
        basis = np.hstack([np.cos(turn), np.sin(turn[:, 1:])])
        solution = np.linalg.lstsq(basis, angles, rcond=None)[0]
        cosine = solution[: harmonics + 1]
        return cls(cosine, np.vstack([np.zeros((1, 3)), solution[harmonics + 1 :]]))

    def __call__(self, phase: FloatArray, derivative: int = 0) -> FloatArray:
        """Return joint angles, or a derivative by the phase, (N, 3) [rad], at N gait phases."""
        w = 2.0 * np.pi * np.arange(len(self.cosine))
        turn = np.outer(phase, w) + derivative * np.pi / 2.0
        return np.asarray(
            np.cos(turn) @ (w[:, np.newaxis] ** derivative * self.cosine)
            + np.sin(turn) @ (w[:, np.newaxis] ** derivative * self.sine)
        )


@lru_cache
def read_gait() -> Gait:
    """Read the shipped gait of level walking."""
    path = leg_pair_file('human_legs/gait.csv')
    lines = [line for line in path.read_text(encoding='utf-8').splitlines() if line[:1].isdigit()]
    rows = np.loadtxt(lines, delimiter=',')  # phase and three angles in degrees
    return Gait.fit(rows[:, 0], np.radians(rows[:, 1:]))


def stance_motion(joints: tuple[str, ...], t: FloatArray, phase: FloatArray) -> Motion:
    """
    Return the joint motion of a person or exoskeleton on one foot, while the other leg swings.

    Parameters
    ----------
    joints : tuple of str, length 6
        Stance ankle, knee, hip, swing hip, knee, ankle.
    t : ndarray, shape (N,)
        Time [s].
    phase : ndarray, shape (3, N)
        Phase of the stance leg at these times, 0 at heel strike, and its derivatives by time
        [1/s, 1/s^2].

    """
    gait = read_gait()
    speed, acceleration = phase[1:, :, np.newaxis]
    here = []
    for derivative in range(3):  # a flat foot and an upright trunk
        hip, knee, _ = gait(phase[0], derivative).T
        far = gait(phase[0] + 0.5, derivative)
        here.append(np.column_stack([knee - hip, knee, hip, far]))
    return Motion(joints, t, here[0], here[1] * speed, here[2] * speed**2 + here[1] * acceleration)
