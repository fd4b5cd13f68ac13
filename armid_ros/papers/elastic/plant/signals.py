# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Experiments that show the springs of an arm: multisines through the resonances, and steps."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.papers.elastic.plant.run import Experiment
from armid_ros.simulation.elastic import multisine
import numpy as np
import numpy.typing as npt

#: For the shipped two-link arm: torque of the multisine [N m] rms, the share of the loop's gains
#: it runs under, and steps of velocity [rad/s] in poses [rad] that tell all parameters apart.
EXCITATION_RMS, WEAK = (60.0, 45.0), 0.15
STEP_POSES = ((0.0, 0.0), (0.0, np.pi / 2), (0.0, np.pi / 4), (0.0, 3 * np.pi / 4))
STEPS = ((1.0, 0.0), (0.0, 1.0), (1.0, -1.0), (1.0, 1.0))
#: Step of experiments [s], and the band of their multisine [Hz].
_DT, _BAND = 1e-3, (2.0, 100.0)


def resonance_experiments(
    count: int,
    *,
    rms: npt.ArrayLike,
    rng: np.random.Generator,
    duration: float = 4.0,
) -> list[Experiment]:
    """
    Return experiments that excite all joints through their resonances, in many poses.

    Motors follow a slow sine of velocity under a loop of low gain, so that friction has one sign
    most of the time, and get a multisine of torque on top. Poses are random, around the stretched
    arm, in which interaction is largest.

    Parameters
    ----------
    count : int
        Number of experiments.
    rms : array_like, shape (n,)
        Of the torque of the multisine [N m].
    rng : numpy.random.Generator
        Source of phases and poses.
    duration : float
        Of each experiment [s].

    """
    size = np.asarray(rms, dtype=float)
    steps = round(duration / _DT)
    t = _DT * np.arange(steps)[:, np.newaxis]
    experiments = []
    for _ in range(count):
        # 0.3 to 1 Hz and 0.8 rad/s; each experiment has its own frequency
        rate = 2.0 * np.pi * rng.uniform(0.3, 1.0, len(size))
        phase = 2.0 * np.pi * rng.random(len(size))
        ramp = np.minimum(t / 0.2, 1.0)
        velocity = ramp * 0.8 * np.cos(rate * t + phase)
        torque = ramp * multisine(steps, _DT, _BAND, size, rng)
        pose = np.pi / 3.0 * rng.uniform(-1.0, 1.0, len(size))
        experiments.append(Experiment(pose, velocity, torque))
    return experiments


def step_experiments(
    poses: Sequence[npt.ArrayLike], velocities: Sequence[npt.ArrayLike]
) -> list[Experiment]:
    """
    Return steps of the reference velocity from rest.

    Parameters
    ----------
    poses, velocities : sequence of array_like, each of shape (n,)
        Initial position [rad] and reference velocity [rad/s] of each experiment.

    """
    steps = round(0.5 / _DT)  # an experiment of 0.5 s
    return [
        Experiment(np.asarray(q, dtype=float), np.tile(np.asarray(v, dtype=float), (steps, 1)))
        for q, v in zip(poses, velocities, strict=True)
    ]
