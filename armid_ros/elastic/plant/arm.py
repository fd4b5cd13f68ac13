# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm with elastic joints that stands there, takes trajectories, and is read on both sides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from armid_ros.elastic.plant.integrator import elastic_step
from armid_ros.elastic.plant.motor_control import MotorControl
from armid_ros.elastic.plant.plant import ElasticPlant, ElasticState
from armid_ros.elastic.plant.run import ElasticRun
from armid_ros.motion import FloatArray, Motion
from armid_ros.simulation.accelerometers import LinkAccelerometers
from armid_ros.simulation.course import Course
from armid_ros.simulation.plant import middle_position
from armid_ros.simulation.readings import RecentPast
from armid_ros.simulation.reference import Reference
from armid_ros.simulation.run import whole_steps
from armid_ros.simulation.sensors import Sensors
from armid_ros.simulation.simulated_arm import Sample
import numpy as np
import numpy.typing as npt

#: Steps of the reference that are evaluated in one go.
_BLOCK = 1000


@dataclass(frozen=True, eq=False)
class ElasticSample(Sample):
    """
    One reading of the sensors on both sides; q, dq and tau are those of the motors at the joints.

    The torque is what the drives give from now on.

    Attributes
    ----------
    link_q, link_dq : ndarray, shape (n,)
        Encoders at the links [rad or m].
    link_ddq : ndarray, shape (n,)
        True acceleration of the links [rad/s^2 or m/s^2].
    acceleration : ndarray, shape (n, 3)
        Accelerometers on the links [m/s^2].
    asked_q, asked_dq : ndarray, shape (n,)
        Where the loop wants the motors, and its velocity over the last step.

    """

    link_q: FloatArray
    link_dq: FloatArray
    link_ddq: FloatArray
    acceleration: FloatArray
    asked_q: FloatArray
    asked_dq: FloatArray


class ElasticArm:
    """
    A simulated arm with elastic joints, its drives and its sensors.

    It holds its pose until it is given a trajectory, and the last point of that when it ends. The
    loop acts at every step, on the true motion of the motors.

    Parameters
    ----------
    plant : ElasticPlant
        The arm.
    rng : numpy.random.Generator
        Source of the sensors' noise.
    control : MotorControl, optional
        That which suits the plant by default.
    sensors : Sensors, optional
        Of motors and links alike; perfect by default.
    accelerometers : LinkAccelerometers, optional
        In the centroids of the links by default.
    start : array_like, shape (n,), optional
        Where the links stand [rad or m]: the middle of the range of motion by default.

    Raises
    ------
    TrajectoryError
        If it cannot stand there.

    """

    def __init__(
        self,
        plant: ElasticPlant,
        *,
        rng: np.random.Generator,
        control: MotorControl | None = None,
        sensors: Sensors | None = None,
        accelerometers: LinkAccelerometers | None = None,
        start: npt.ArrayLike | None = None,
    ) -> None:
        self.plant = plant
        self.control = control or MotorControl.of(plant)
        self.sensors = sensors or Sensors()
        self.accelerometers = accelerometers or LinkAccelerometers(plant.robot)
        self._rng = rng
        home = middle_position(plant.robot) if start is None else start
        self._home = np.array(np.broadcast_to(np.asarray(home, dtype=float), (len(self.joints),)))
        self._course = Course(plant.robot, plant.dt)
        self._state: ElasticState
        self._torque: FloatArray
        self._asked: FloatArray
        self._velocity: FloatArray
        self._previous: tuple[FloatArray | None, FloatArray | None]
        self.reset()

    @property
    def joints(self) -> tuple[str, ...]:
        """Joint names in column order."""
        return self.plant.joints

    @property
    def state(self) -> ElasticState:
        """The true state of the arm."""
        return self._state

    @property
    def ends_at(self) -> float:
        """Time at which the trajectory ends, or has ended [s]."""
        return self._course.ends_at

    def reset(self, steps: int = 0) -> None:
        """
        Put the arm back to where it stood first, at rest and without a trajectory.

        Parameters
        ----------
        steps : int
            What time it is then, in steps of the plant.

        """
        hold = Reference(self.joints, np.zeros(1), self._home[np.newaxis])
        self._begin(hold, steps)

    def start_on(self, reference: Reference) -> None:
        """
        Put the arm on the first point of a reference, at its velocity, and begin it there.

        Raises
        ------
        TrajectoryError
            If the reference does not fit the robot or passes a limit; the message names both.

        """
        curve = reference.for_robot(self.plant.robot)
        curve.require_limits(self.plant.robot, self.plant.dt)
        self._begin(curve, 0)

    def set_trajectory(self, reference: Reference) -> None:
        """
        Begin a trajectory now, in place of the one that may be under way.

        A first point later than time zero gives the arm that time to get there from where it is
        to be now.

        Raises
        ------
        TrajectoryError
            As for an arm of rigid joints. The arm goes on with what it was doing.

        """
        self._course.begin(reference, self._state.steps)
        self._look_ahead(self._state.steps)

    def advance(self, steps: int = 1) -> ElasticSample:
        """
        Let time go on, and read the sensors.

        Parameters
        ----------
        steps : int
            Steps of the plant, 1 or more.

        """
        if steps < 1:
            raise ValueError(f'an arm advances by 1 step or more, not {steps}')
        for _ in range(steps):
            self._state = elastic_step(self.plant, self._state, self.plant.given(self._torque))
            self._command()
        return self.read(steps)

    def read(self, steps: int = 1) -> ElasticSample:
        """Read the sensors now, some steps after they were read last."""
        state, dt = self._state, steps * self.plant.dt
        none = np.zeros((1, len(self.joints)))
        q, dq, tau = (row[np.newaxis] for row in self._past.latest())
        q, dq, tau = self.sensors.measure(q, dq, tau, dt, self._rng, self._previous[0])
        true_q, true_dq, ddq = self.plant.link(state)
        link_q, link_dq, _ = self.sensors.measure(
            true_q[np.newaxis], true_dq[np.newaxis], none, dt, self._rng, self._previous[1]
        )
        self._previous = q[0], link_q[0]
        felt = self.accelerometers.read(true_q, true_dq, ddq)
        if np.any(self.sensors.acceleration_noise):
            felt = felt + self.sensors.acceleration_noise * self._rng.standard_normal(felt.shape)
        return ElasticSample(
            state.steps, state.t, q[0], dq[0], tau[0], link_q[0], link_dq[0], ddq, felt,
            self._asked, self._velocity,
        )  # fmt: skip

    def _begin(self, reference: Reference, steps: int) -> None:
        """Put the arm on a reference, with the loop relaxed."""
        first = reference.sample(np.zeros(1))
        state = self.plant.state(first.q[0], first.dq[0])
        self.plant.require_range(state)
        self._state = replace(state, steps=steps, t=steps * self.plant.dt)
        self._course.follow(reference, steps)
        self._look_ahead(steps)
        self._integral = np.zeros(len(self.joints))
        self._asked = self._targets[0][0] - self.plant.dt * first.dq[0]
        self._previous = None, None
        delay = self.sensors.torque_delay
        self._past = RecentPast(self.plant.sensing, self.plant.dt, self.joints, delay)
        self._command()

    def _look_ahead(self, first: int) -> None:
        """Evaluate the course from a step on, for some time."""
        self._first = first
        self._targets = self.control.targets(self._course.desired(first, _BLOCK))

    def _command(self) -> None:
        """Let the loop act on where the motors are now, and keep what the sensors see."""
        plant, state = self.plant, self._state
        if state.steps >= self._first + _BLOCK:
            self._look_ahead(state.steps)
        positions, torques = self._targets
        row = state.steps - self._first
        q, dq = plant.motor(state)
        self._velocity = (positions[row] - self._asked) / plant.dt
        self._asked = positions[row]
        error = self._velocity - dq
        self._integral = self._integral + plant.dt * error
        asked = self.control.loop.torque(error, self._integral) + torques[row]
        limit = plant.rigid.torque_limit
        self._torque = np.minimum(np.maximum(asked, -limit), limit)
        now = np.stack([q, dq, plant.motor_acceleration(state), plant.given(self._torque), asked])
        self._past.append(now[np.newaxis], state.steps)


def record(
    arm: ElasticArm,
    reference: Reference,
    *,
    rate: float = 1000.0,
    progress: Callable[[float], None] | None = None,
) -> ElasticRun:
    """
    Let an arm follow a reference from its first point, and record both sides.

    Parameters
    ----------
    arm : ElasticArm
        The arm.
    reference : Reference
        What it should do.
    rate : float
        Recorded samples per second [Hz]; a whole number of steps apart.
    progress : callable, optional
        Is given the share that is done, from 0 to 1.

    Raises
    ------
    TrajectoryError
        If the reference does not fit the robot, or passes a limit.
    ModelError
        If the rate does not fit the step.

    """
    stride = whole_steps(1.0 / rate, arm.plant.dt, f'a rate of {rate:g} Hz')
    arm.start_on(reference)
    count = int(np.floor(reference.duration / (stride * arm.plant.dt) + 1e-9))
    samples = [arm.read(stride)]
    for number in range(count):
        samples.append(arm.advance(stride))
        if progress is not None and number % 100 == 0:
            progress(number / count)
    t, q, dq, tau, link_q, link_dq, link_ddq, asked = (
        np.array([getattr(sample, name) for sample in samples])
        for name in ('t', 'q', 'dq', 'tau', 'link_q', 'link_dq', 'link_ddq', 'asked_q')
    )
    period = stride * arm.plant.dt
    before = asked[0] - period * samples[0].asked_dq
    velocity = np.diff(asked, axis=0, prepend=before[np.newaxis]) / period
    return ElasticRun(
        Motion(arm.joints, t, q, dq, np.zeros_like(q), tau),
        Motion(arm.joints, t, link_q, link_dq, link_ddq),
        velocity,
        felt=np.stack([sample.acceleration for sample in samples], axis=1),
    )
