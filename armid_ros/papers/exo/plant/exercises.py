# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Exercises of a person for an identification, with one foot on the ground.

Each is a sum of a few sines of hip and knee of both legs; the stance foot is flat and the trunk
upright, as in all of the pair's motions on one foot. The machine follows its wearer with less
amplitude, late, and with joints that are not quite aligned, as assumed.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.exo.plant.gait import Gait, read_gait
from armid_ros.papers.exo.plant.leg_pair import following, PairMotion, stepping, TiedPair
import numpy as np


@dataclass(frozen=True)
class Exercise:
    """
    An exercise.

    Attributes
    ----------
    what : str
        Description of the motion of the person.
    middle, reach : tuple of float, length 4
        Mean and amplitude of stance hip and knee, swing hip and knee [deg].
    period : float
        [s].

    """

    what: str
    middle: tuple[float, float, float, float]
    reach: tuple[float, float, float, float]
    period: float


#: Exercises by name; steps follow the gait, forward and back.
EXERCISES = {
    'step': Exercise('step forward and back', (0.0,) * 4, (0.0,) * 4, 1.8),
    'quick_step': Exercise('the same, twice as quickly', (0.0,) * 4, (0.0,) * 4, 0.9),
    'swing': Exercise('swing the free leg', (2.0, 5.0, 10.0, 25.0), (0.0, 0.0, 30.0, 20.0), 1.2),
    'lift': Exercise('lift the free knee', (2.0, 5.0, 40.0, 50.0), (0.0, 0.0, 35.0, 45.0), 1.2),
    'squat': Exercise(
        'bend the knees, the second foot on a force plate',
        (20.0, 35.0, 20.0, 35.0),
        (18.0, 30.0, 18.0, 30.0),
        1.6,
    ),
    'rock': Exercise(
        'rock to and fro over the standing ankle',
        (0.0, 8.0, 5.0, 15.0),
        (12.0, 6.0, 12.0, 6.0),
        0.9,
    ),
}


def exercise(pair: TiedPair, name: str, t: FloatArray, gait: Gait | None = None) -> PairMotion:
    """
    Return the motion of the shipped pair, on one foot, during an exercise.

    Parameters
    ----------
    pair : TiedPair
        The pair on one foot.
    name : str
        One of ``EXERCISES``.
    t : ndarray, shape (N,)
        Time [s].
    gait : Gait, optional
        Gait for stepping; the shipped one by default.

    """
    plan = EXERCISES[name]
    if name.endswith('step'):
        return stepping(pair, gait or read_gait(), t, plan.period)
    w, middle, reach = 2.0 * np.pi / plan.period, np.radians(plan.middle), np.radians(plan.reach)

    def moving(joints: tuple[str, ...], time: FloatArray) -> Motion:
        """Return sines of hips and knees with a flat foot and an upright trunk."""
        cosine, sine = (np.outer(f(w * time), reach) for f in (np.cos, np.sin))
        parts = [
            np.column_stack([knee - hip, knee, hip, far_hip, far_knee, np.zeros_like(time)])
            for hip, knee, far_hip, far_knee in (
                (middle - cosine).T,
                (w * sine).T,
                (w**2 * cosine).T,
            )
        ]
        return Motion(joints, time, *parts)

    return following(pair, t, moving)
