# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated experiments with the shipped two-link arm under velocity control."""

from __future__ import annotations

from armid_ros.motion import ElasticRun, FloatArray
from armid_ros.robots.reference import Reference
from armid_ros.robots.two_link import TwoLinkSet
from armid_ros.simulation import Sensors
from armid_ros.simulation.elastic import make_simulated_arm, multisine, two_link_arm
from armid_ros.simulation.run import record
import numpy as np
from scipy.integrate import cumulative_trapezoid

#: Factor on the gains of the velocity loop during the multisine.
RESONANCE_GAIN = 0.15
#: Time between two points of a reference [s].
_DT = 1e-3
_JOINTS = ('joint1', 'joint2')


def resonance_experiments(count: int, rng: np.random.Generator) -> list[Reference]:
    """
    Return `count` reference motions that excite the resonances of both joints.

    The motors follow a slow sine of velocity under a loop of low gain, so that friction rarely
    changes its sign. A multisine of torque is added. Poses are random around the stretched arm,
    where the interaction of the joints is largest.

    Parameters
    ----------
    count : int
        Number of experiments.
    rng : numpy.random.Generator
        Source of phases and poses.

    """
    rms = np.array([60.0, 45.0])  # of the multisine of each joint [N m]
    steps = round(4.0 / _DT)  # an experiment of 4 s
    t: FloatArray = _DT * np.arange(steps, dtype=np.float64)
    experiments = []
    for _ in range(count):
        # 0.3 to 1 Hz and 0.8 rad/s; each experiment has its own frequency
        rate = 2.0 * np.pi * rng.uniform(0.3, 1.0, 2)
        phase = 2.0 * np.pi * rng.random(2)
        ramp = np.minimum(t / 0.2, 1.0)[:, np.newaxis]
        velocity = ramp * 0.8 * np.cos(np.outer(t, rate) + phase)
        # band of the multisine [Hz]
        torque = ramp * multisine(steps, _DT, (2.0, 100.0), rms, rng)
        pose = np.pi / 3.0 * rng.uniform(-1.0, 1.0, 2)
        q = pose + cumulative_trapezoid(velocity, dx=_DT, axis=0, initial=0.0)
        experiments.append(Reference(_JOINTS, t, q, velocity, None, torque))
    return experiments


def step_experiments() -> list[Reference]:
    """Return steps of velocity from four poses that make all parameters identifiable."""
    angles = (0.0, np.pi / 2, np.pi / 4, 3 * np.pi / 4)  # of joint 2 [rad]
    velocities = ((1.0, 0.0), (0.0, 1.0), (1.0, -1.0), (1.0, 1.0))  # [rad/s]
    return [
        step_of_velocity(np.array([0.0, angle]), np.array(velocity))
        for angle, velocity in zip(angles, velocities, strict=True)
    ]


def step_of_velocity(pose: FloatArray, velocity: FloatArray) -> Reference:
    """Return a motion that rests in a pose [rad], then has a velocity [rad/s] for 0.5 s."""
    t = np.array([0.0, _DT, _DT + 0.5])
    return Reference(_JOINTS, t, np.array([pose, pose, pose + 0.5 * velocity]))


def run_experiment(
    reference: Reference,
    drives: TwoLinkSet,
    rng: np.random.Generator,
    *,
    gain: float = 1.0,
    sensors: Sensors | None = None,
) -> ElasticRun:
    """
    Simulate a two-link arm that follows a reference; return the motions of motors and links.

    Parameters
    ----------
    reference : Reference
        Motion of the motors, and torque that is added to the torque of the loops.
    drives : TwoLinkSet
        Parameters of the arm and gains of its velocity loops.
    rng : numpy.random.Generator
        Source of the sensors' noise.
    gain : float
        Factor on the gains of the velocity loops.
    sensors : Sensors, optional
        Noise of the sensors; none by default.

    """
    arm = make_simulated_arm(
        two_link_arm(drives.parameters),
        rng=rng,
        warn=print,
        drives=drives,
        gain=gain,
        sensors=sensors,
        start=reference.q[0],
    )
    run = record(arm, reference).sides
    assert run is not None  # the joints are elastic
    return run
