# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Runs of an elastic arm under a velocity loop, and what its sensors make of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from armid_ros.elastic.plant.integrator import elastic_step
from armid_ros.elastic.plant.plant import ElasticPlant
from armid_ros.motion import FloatArray, Motion, read_only
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class VelocityLoop:
    """
    Proportional-integral control of the motors' velocities, sampled at every step of the plant.

    tau_k = kp e_k + ki s_k, with e_k = reference - velocity and s_k = s_k-1 + dt e_k.

    Attributes
    ----------
    proportional : ndarray, shape (n,)
        kp [N m s/rad], at the joints.
    integral : ndarray, shape (n,)
        ki [N m/rad].

    """

    proportional: FloatArray
    integral: FloatArray

    def __post_init__(self) -> None:
        """Freeze the gains."""
        object.__setattr__(self, 'proportional', read_only(self.proportional))
        object.__setattr__(self, 'integral', read_only(self.integral))

    def torque(self, error: FloatArray, integral: FloatArray) -> FloatArray:
        """Return the torque for errors of velocity [rad/s] and their integral [rad], (n,)."""
        return np.asarray(self.proportional * error + self.integral * integral)

    @classmethod
    def of_drive(
        cls,
        proportional: npt.ArrayLike,
        integral: npt.ArrayLike,
        torque_per_volt: FloatArray,
        gear: FloatArray,
    ) -> VelocityLoop:
        """Convert gains of drives, V s/rad and V/rad at the motors, to the joints."""
        scale = torque_per_volt * gear
        return cls(np.asarray(proportional) * scale, np.asarray(integral) * scale)


@dataclass(frozen=True, eq=False)
class Experiment:
    """
    What is asked of an elastic arm that stands somewhere.

    Attributes
    ----------
    q : ndarray, shape (n,)
        Where the links are [rad].
    velocity : ndarray, shape (N, n)
        Reference of the velocity loop, a row per step [rad/s].
    torque : ndarray, shape (N, n), or None
        What is added to the torque of the loop [N m].

    """

    q: FloatArray
    velocity: FloatArray
    torque: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class ElasticRun:
    """
    What happened, or what was measured, during one experiment.

    Attributes
    ----------
    motor, link : Motion
        Motion of either side, that of the motors as seen at the joints. The torque of the motors
        is the drives' [N m], constant from each sample to the next; the links have none.
    reference : ndarray, shape (N, n)
        Reference of the velocity loop [rad/s].
    integral : ndarray, shape (n,), or None
        What the integral of the loop held at the beginning [rad]; None for nothing. A motor that
        sticks keeps it from one experiment to the next.
    felt : ndarray, shape (n, N, 3), or None
        What accelerometers on the links read [m/s^2], where it is not what they should read.

    """

    motor: Motion
    link: Motion
    reference: FloatArray
    integral: FloatArray | None = None
    felt: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class ElasticSensors:
    """
    Noise of encoders and accelerometers, standard deviations; perfect unless told otherwise.

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
        """Return a true run as it is measured."""

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


def run_elastic(plant: ElasticPlant, loop: VelocityLoop, experiment: Experiment) -> ElasticRun:
    """
    Run one experiment from rest, one row per step, and return the true motion.

    The loop sees the true velocity of the motors; the torque is held within the limits of the
    robot. Accelerations of the motors are zero: nothing measures them.

    Raises
    ------
    TrajectoryError
        If a link gets beyond its limits.

    """
    count, n = experiment.velocity.shape
    limit = plant.rigid.torque_limit
    extra = np.zeros((count, n)) if experiment.torque is None else experiment.torque
    q_m, v_m, q_l, v_l, a_l, tau = np.empty((6, count, n))
    state, integral = plant.state(experiment.q), np.zeros(n)
    for k in range(count):
        q_m[k], v_m[k] = plant.motor(state)
        q_l[k], v_l[k], a_l[k] = plant.link(state)
        error = experiment.velocity[k] - v_m[k]
        integral += plant.dt * error
        asked = loop.torque(error, integral) + extra[k]
        tau[k] = np.clip(asked, -limit, limit)
        state = elastic_step(plant, state, tau[k])
    plant.require_range(state)
    t = plant.rigid.times(0, count) * plant.substeps
    motor = Motion(plant.joints, t, q_m, v_m, np.zeros_like(v_m), tau)
    return ElasticRun(motor, Motion(plant.joints, t, q_l, v_l, a_l), experiment.velocity)


def run_all(
    plant: ElasticPlant,
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
