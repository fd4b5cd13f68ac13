# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated runs of an elastic arm under a velocity loop, and its sensors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from armid_ros.errors import TrajectoryError
from armid_ros.motion import ElasticRun, FloatArray, Motion
from armid_ros.simulation.closed_loop import command, run
from armid_ros.simulation.controller import MotorControl, Targets, VelocityLoop
from armid_ros.simulation.plant import limit_slack, Plant
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
        [rad/s], the motors' at the joints.
    link_acceleration : float or ndarray, shape (n,)
        [rad/s^2].
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

    The loop sees the true velocity of the motors; the torque is held within the limits of the
    robot. Accelerations of the motors are not measured, and set to zero.

    Raises
    ------
    TrajectoryError
        If a link exceeds its limits.

    """
    control, still = MotorControl(loop, plant.dt), np.zeros_like(experiment.velocity)
    extra = still if experiment.torque is None else experiment.torque
    targets = Targets(still, experiment.velocity, still, extra)
    state = plant.state(experiment.q)
    torque = command(plant, control, state, targets.at(0))
    trace = run(plant, control, state, torque, targets[1:])
    robot, slack, end = plant.robot, limit_slack(plant.robot), trace.state
    beyond = (end.q < robot.lower - slack) | (end.q > robot.upper + slack)
    for joint in np.flatnonzero(beyond)[:1]:
        raise TrajectoryError(
            f"{robot.name}: joint '{robot.joints[joint]}' reaches {end.q[joint]:.4g} at "
            f'{end.t:.3f} s, beyond its limits of {robot.lower[joint]:.4g} and '
            f'{robot.upper[joint]:.4g}'
        )
    joints, t = robot.joints, plant.times(0, len(targets))
    q, dq, _ = trace.motors
    motor = Motion(joints, t, q, dq, still, trace.tau)
    return ElasticRun(motor, Motion(joints, t, *trace.links), experiment.velocity)


def run_all(
    plant: Plant,
    loop: VelocityLoop,
    experiments: list[Experiment],
    progress: Callable[[float], None] | None = None,
) -> list[ElasticRun]:
    """Run experiments one after the other."""
    runs = []
    for number, experiment in enumerate(experiments):
        runs.append(run_elastic(plant, loop, experiment))
        if progress is not None:
            progress((number + 1) / len(experiments))
    return runs
