# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Simulation of a whole run: an arm follows a reference and is recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import ModelError
from armid_ros.motion import ElasticRun, FloatArray, freeze, Motion, Temperatures
from armid_ros.robots.reference import Reference
from armid_ros.simulation.controller import Controller
from armid_ros.simulation.plant import Plant
from armid_ros.simulation.sensors import readings, Sensors
from armid_ros.simulation.simulated_arm import SimulatedArm
import numpy as np

#: Velocity from which a simulated joint is unstable [rad/s or m/s].
_MAX_SPEED = 1e6


@dataclass(frozen=True, eq=False)
class SimulatedRun:
    """
    Recording of a simulated run, with the true motion of the arm and its reference.

    Attributes
    ----------
    joints : tuple of str
        Joint names in column order.
    t : ndarray, shape (N,)
        Time [s].
    q, dq, tau : ndarray, shape (N, n)
        Position, velocity and torque as the sensors read them.
    truth : Motion
        Position, velocity, acceleration and torque of the arm at the same times. Torque and
        acceleration are constant over a step and jump between two steps; each sample is the mean
        of the steps before and after it.
    reference : Motion
        The reference that the arm follows.
    sides : ElasticRun or None
        Recordings of both sides of the springs; None if all joints are rigid. The other readings
        are readings of the motors.

    """

    joints: tuple[str, ...]
    t: FloatArray
    q: FloatArray
    dq: FloatArray
    tau: FloatArray
    truth: Motion
    reference: Motion
    sides: ElasticRun | None = None

    def __post_init__(self) -> None:
        """Freeze the arrays of the recording."""
        freeze(self, 't', 'q', 'dq', 'tau')

    @property
    def temperature(self) -> Temperatures | None:
        """Return the temperatures of the joints; None if the simulation has no temperatures."""
        return self.truth.temperature


def simulate(
    arm: ArmModel | Plant,
    reference: Reference | Motion,
    *,
    rng: np.random.Generator,
    controller: Controller | None = None,
    sensors: Sensors | None = None,
    rate: float = 1000.0,
    duration: float | None = None,
) -> SimulatedRun:
    """
    Record a simulated arm that follows a reference from its first point.

    Parameters
    ----------
    arm : ArmModel or Plant
        The arm; an ArmModel is integrated at 1 kHz with hard stops and rigid joints.
    reference : Reference or Motion
        The reference. The arm starts at its first point, with its velocity.
    rng : numpy.random.Generator
        Source of the sensors' noise.
    controller : Controller, optional
        Computed torque with the true arm by default; velocity loops if joints are elastic.
    sensors : Sensors, optional
        Perfect by default.
    rate : float
        Recorded samples per second [Hz]; the sample time is a whole number of steps.
    duration : float, optional
        Recorded time [s]; by default the duration of the reference. After its end, the arm holds
        the last point.

    Raises
    ------
    TrajectoryError
        If the joints of the reference do not fit the robot, or a limit is exceeded.
    ModelError
        If the rate does not fit the step.

    """
    simulated = SimulatedArm(arm, rng=rng, controller=controller, sensors=sensors)
    return record(simulated, reference, rate=rate, duration=duration)


def record(
    arm: SimulatedArm,
    reference: Reference | Motion,
    *,
    rate: float = 1000.0,
    duration: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> SimulatedRun:
    """
    Record a given simulated arm that follows a reference from its first point; see `simulate`.

    Parameters
    ----------
    arm : SimulatedArm
        The arm with its controller, its sensors and the source of their noise.
    reference, rate, duration
        As for `simulate`.
    progress : callable, optional
        Called with the share done, 0 to 1, several times a second.

    Raises
    ------
    TrajectoryError
        If the joints of the reference do not fit the robot, or a limit is exceeded.
    ModelError
        If the rate does not fit the step.

    """
    plant, sensors = arm.plant, arm.sensors
    if not rate > 0.0:
        raise ModelError(f'the rate is {rate:g} Hz, but has to be positive')
    stride = whole_steps(1.0 / rate, plant.dt, f'a rate of {rate:g} Hz')
    curve = arm.start_on(
        reference if isinstance(reference, Reference) else Reference.of(reference)
    )
    duration = curve.duration if duration is None else duration
    last = stride * int(np.floor(duration / (stride * plant.dt) + 1e-9))
    motors, links, tau = _simulated_motion(arm, last + 1, progress)
    q, dq, ddq = motors
    given = tau if plant.action.drive is None else plant.action.drive(tau)
    commanded, rows = tau, slice(None, None, stride)
    if plant.springs is None:
        ddq, given, commanded = (
            np.concatenate([x[:1], (x[1:] + x[:-1]) / 2]) for x in (ddq, given, tau)
        )
    truth = Motion(plant.robot.joints, plant.times(0, last + 1), q, dq, ddq, given)
    q, dq, commanded = readings(plant.sensing, truth, commanded)
    late = commanded[np.maximum(np.arange(0, last + 1, stride) - sensors.torque_delay, 0)]
    measured = sensors.measure(q[rows], dq[rows], late, arm.rng)
    truth = truth.select(rows)
    desired = curve.sample(truth.t)
    run = SimulatedRun(truth.joints, truth.t, *measured, truth, desired)
    if plant.springs is None:
        return run
    moved = Motion(truth.joints, truth.t, *links[:, rows])
    q, dq, felt = arm.read_links(moved)
    period = run.t[1] - run.t[0] if len(run.t) > 1 else plant.dt
    loops = arm.controller.targets(desired)
    before = loops.q[:1] - period * desired.dq[:1]
    sides = ElasticRun(
        Motion(run.joints, run.t, run.q, run.dq, np.zeros_like(run.q), run.tau),
        Motion(run.joints, run.t, q, dq, moved.ddq),
        np.diff(loops.q, axis=0, prepend=before) / period,
        felt=felt,
    )
    return replace(run, sides=sides)


def _simulated_motion(
    arm: SimulatedArm, steps: int, progress: Callable[[float], None] | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Simulate a number of steps; return the motion of motors and links, and the torques."""
    plant, pieces, done = arm.plant, [], 0
    with np.errstate(over='ignore', invalid='ignore'):  # overflow is checked below
        for trace in arm.traces(steps):
            q, dq, ddq = trace.motors
            lost = ~(np.abs(dq[:-1]) < _MAX_SPEED)
            if np.any(lost):
                step, joint = np.argwhere(lost)[0]
                raise ModelError(
                    f'{plant.robot.name}: the simulation is unstable; '
                    f'{plant.robot.joints[joint]} is faster than {_MAX_SPEED:g} rad/s (or m/s) '
                    f'after {plant.dt * (done + step):.3g} s'
                )
            motors = np.stack([q[:-1], dq[:-1], ddq[:-1] if plant.springs else ddq[1:]])
            pieces.append((motors, trace.links[:, :-1], trace.tau[np.newaxis, :-1]))
            done = trace.state.steps
            if progress is not None:
                progress(done / steps)
    motors, links, tau = (np.concatenate(parts, axis=1) for parts in zip(*pieces, strict=True))
    return motors, links, tau[0]


def whole_steps(time: float, dt: float, setting: str) -> int:
    """
    Convert a time [s] to a whole number of simulation steps.

    Raises
    ------
    ModelError
        If the time is not a whole number of steps; the message begins with `setting`.

    """
    steps = round(time / dt) if np.isfinite(time) else 0
    if steps < 1 or abs(steps * dt - time) > 1e-9 * time:
        raise ModelError(
            f'{setting} does not fit the step of {dt:g} s: use {1.0 / dt:g} Hz divided by a '
            'whole number'
        )
    return steps
