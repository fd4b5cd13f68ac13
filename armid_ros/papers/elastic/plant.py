# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated runs of an elastic arm under a velocity loop: experiments and sensors."""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.errors import TrajectoryError
from armid_ros.motion import ElasticRun, FloatArray, Motion
from armid_ros.robots.reference import limit_slack
from armid_ros.simulation.closed_loop import command, run
from armid_ros.simulation.controller import MotorControl, VelocityLoop
from armid_ros.simulation.elastic import multisine
from armid_ros.simulation.plant import Plant
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class Experiment:
    """
    The inputs of an experiment with an elastic arm that starts from rest.

    Attributes
    ----------
    q : ndarray, shape (n,)
        Initial positions of the links [rad].
    velocity : ndarray, shape (N, n)
        Reference of the velocity loop, a row per step [rad/s].
    torque : ndarray, shape (N, n), or None
        Torque that is added to the torque of the loop [N m].

    """

    q: FloatArray
    velocity: FloatArray
    torque: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class ElasticSensors:
    """
    Standard deviations of the noise of encoders and accelerometers, zero by default.

    Attributes
    ----------
    motor_velocity, link_velocity : float or ndarray, shape (n,)
        Of velocity readings [rad/s]; those of the motors are at the joints.
    link_acceleration : float or ndarray, shape (n,)
        Of the accelerometers on the links [rad/s^2].
    position : float or ndarray, shape (n,)
        Of all encoders [rad].

    """

    motor_velocity: npt.ArrayLike = 0.0
    link_velocity: npt.ArrayLike = 0.0
    link_acceleration: npt.ArrayLike = 0.0
    position: npt.ArrayLike = 0.0

    def measure(self, run: ElasticRun, rng: np.random.Generator) -> ElasticRun:
        """Return a run with sensor noise added."""

        def noisy(values: FloatArray, std: npt.ArrayLike) -> FloatArray:
            return np.asarray(values + np.asarray(std) * rng.standard_normal(values.shape))

        motor = replace(
            run.motor,
            q=noisy(run.motor.q, self.position),
            dq=noisy(run.motor.dq, self.motor_velocity),
        )
        link = replace(
            run.link,
            q=noisy(run.link.q, self.position),
            dq=noisy(run.link.dq, self.link_velocity),
            ddq=noisy(run.link.ddq, self.link_acceleration),
        )
        return replace(run, motor=motor, link=link)


def run_elastic(plant: Plant, loop: VelocityLoop, experiment: Experiment) -> ElasticRun:
    """
    Run one experiment from rest, one row per step, and return the true motion.

    The loop uses the true velocity of the motors, and the torque stays within the limits of the
    robot. Accelerations of the motors are not measured, and set to zero.

    Raises
    ------
    TrajectoryError
        If a link exceeds its limits.

    """
    control, still = MotorControl(loop, plant.dt), np.zeros_like(experiment.velocity)
    extra = still if experiment.torque is None else experiment.torque
    joints, t = plant.robot.joints, plant.times(0, len(still))
    targets = Motion(joints, t, still, experiment.velocity, still, extra)
    state = plant.state(experiment.q)
    torque = command(plant, control, state, targets, 0)
    trace = run(plant, control, state, torque, targets, range(1, len(targets)))
    robot, slack, end = plant.robot, limit_slack(plant.robot), trace.state
    beyond = (end.q < robot.lower - slack) | (end.q > robot.upper + slack)
    for joint in np.flatnonzero(beyond)[:1]:
        raise TrajectoryError(
            f"{robot.name}: joint '{robot.joints[joint]}' reaches {end.q[joint]:.4g} at "
            f'{end.t:.3f} s, beyond its limits of {robot.lower[joint]:.4g} and '
            f'{robot.upper[joint]:.4g}'
        )
    q, dq, _ = trace.motors
    motor = Motion(joints, t, q, dq, still, trace.tau)
    return ElasticRun(motor, Motion(joints, t, *trace.links), experiment.velocity)


#: Factor on the gains of the velocity loop during the multisine.
RESONANCE_GAIN = 0.15
#: Step of experiments [s].
_DT = 1e-3


def resonance_experiments(count: int, rng: np.random.Generator) -> list[Experiment]:
    """
    Return experiments that excite both joints of the shipped arm through their resonances.

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
    t = _DT * np.arange(steps)[:, np.newaxis]
    experiments = []
    for _ in range(count):
        # 0.3 to 1 Hz and 0.8 rad/s; each experiment has its own frequency
        rate = 2.0 * np.pi * rng.uniform(0.3, 1.0, 2)
        phase = 2.0 * np.pi * rng.random(2)
        ramp = np.minimum(t / 0.2, 1.0)
        velocity = ramp * 0.8 * np.cos(rate * t + phase)
        # band of the multisine [Hz]
        torque = ramp * multisine(steps, _DT, (2.0, 100.0), rms, rng)
        pose = np.pi / 3.0 * rng.uniform(-1.0, 1.0, 2)
        experiments.append(Experiment(pose, velocity, torque))
    return experiments


def step_experiments() -> list[Experiment]:
    """Return steps of the reference velocity, in poses that make all parameters identifiable."""
    steps = round(0.5 / _DT)  # an experiment of 0.5 s
    angles = (0.0, np.pi / 2, np.pi / 4, 3 * np.pi / 4)  # of joint 2 [rad]
    velocities = ((1.0, 0.0), (0.0, 1.0), (1.0, -1.0), (1.0, 1.0))  # [rad/s]
    return [
        Experiment(np.array([0.0, angle]), np.tile(velocity, (steps, 1)))
        for angle, velocity in zip(angles, velocities, strict=True)
    ]
