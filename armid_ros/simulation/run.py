# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A whole run: an arm follows a reference and is recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.simulation.closed_loop import command, run
from armid_ros.simulation.controller import ComputedTorque, Controller, Targets
from armid_ros.simulation.plant import Plant
from armid_ros.simulation.readings import readings
from armid_ros.simulation.reference import Reference
from armid_ros.simulation.sensors import Sensors
import numpy as np

#: Steps between two calls of the progress callback, about 50 ms.
_BLOCK = 1000
#: A simulated joint that is faster has left all bounds [rad/s or m/s].
_LOST = 1e6


@dataclass(frozen=True, eq=False)
class SimulatedRun:
    """
    What a run recorded, and what really happened.

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
        acceleration are constant over a step and jump between two; these are the means of the
        step before and the step after.
    reference : Motion
        What the arm should have done.
    saturated : ndarray, shape (n,)
        Share of the time during which the drive of a joint gave all the torque it has.

    """

    joints: tuple[str, ...]
    t: FloatArray
    q: FloatArray
    dq: FloatArray
    tau: FloatArray
    truth: Motion
    reference: Motion
    saturated: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ('t', 'q', 'dq', 'tau', 'saturated'):
            object.__setattr__(self, name, read_only(getattr(self, name)))


def simulate(
    arm: ArmModel | Plant,
    reference: Reference | Motion,
    *,
    rng: np.random.Generator,
    controller: Controller | None = None,
    sensors: Sensors | None = None,
    rate: float = 1000.0,
    duration: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> SimulatedRun:
    """
    Let an arm follow a reference from its first point and record it.

    Parameters
    ----------
    arm : ArmModel or Plant
        The arm; an ArmModel is integrated at 1 kHz with hard stops.
    reference : Reference or Motion
        What it should do. The arm starts on it, at its velocity.
    rng : numpy.random.Generator
        Source of the sensors' noise.
    controller : Controller, optional
        Computed torque of the true arm by default.
    sensors : Sensors, optional
        Perfect by default.
    rate : float
        Recorded samples per second [Hz]; a whole number of steps apart.
    duration : float, optional
        Recorded time [s]; that of the reference by default. What is longer holds its last point.
    progress : callable, optional
        Is given the share that is done, from 0 to 1, several times a second.

    Raises
    ------
    TrajectoryError
        If the reference does not fit the robot or passes a limit; the message names both.
    ModelError
        If the rate does not fit the step, or the plant has springs.

    """
    plant = arm if isinstance(arm, Plant) else Plant(arm)
    if plant.springs is not None:
        raise ModelError(
            f'{plant.robot.name}: joints that give way are read on both sides, which a run of '
            'rigid joints has not; use SimulatedArm, or a plant without elasticity'
        )
    controller = controller or ComputedTorque(plant.arm)
    sensors = sensors or Sensors()
    if not rate > 0.0:
        raise ModelError(f'a rate of {rate:g} Hz: samples per second have to be positive')
    stride = whole_steps(1.0 / rate, plant.dt, f'a rate of {rate:g} Hz')
    curve = reference if isinstance(reference, Reference) else Reference.of(reference)
    curve = curve.for_robot(plant.robot)
    curve.require_limits(plant.robot, plant.dt)
    duration = curve.duration if duration is None else duration
    last = stride * int(np.floor(duration / (stride * plant.dt) + 1e-9))

    def targets(first: int, count: int) -> Targets:
        return controller.targets(curve.sample(plant.times(first, count)))

    start = curve.sample(np.zeros(1))
    state = plant.state(start.q[0], start.dq[0], start.ddq[0])
    torque = command(plant, controller, state, next(iter(targets(0, 1))))
    pieces = []
    while state.steps <= last:
        count = min(_BLOCK, last + 1 - state.steps)
        with np.errstate(over='ignore', invalid='ignore'):  # looked for below
            trace = run(plant, controller, state, torque, targets(state.steps + 1, count))
        q, dq, ddq = trace.motors
        _require_motion(plant, dq[:-1], state.steps)
        pieces.append((q[:-1], dq[:-1], ddq[1:], trace.tau[:-1]))
        state, torque = trace.state, trace.tau[-1]
        if progress is not None:
            progress(state.steps / (last + 1))

    q, dq, ddq, tau = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    saturated = np.mean(np.abs(tau) >= plant.torque_range[1], axis=0)
    given = tau if plant.action.drive is None else plant.action.drive(tau)
    ddq, given, asked = (np.concatenate([x[:1], (x[1:] + x[:-1]) / 2]) for x in (ddq, given, tau))
    truth = Motion(plant.robot.joints, plant.times(0, last + 1), q, dq, ddq, given)
    q, dq, asked = readings(plant.sensing, truth, asked)
    rows = slice(None, None, stride)
    late = asked[np.maximum(np.arange(0, last + 1, stride) - sensors.torque_delay, 0)]
    measured = sensors.measure(q[rows], dq[rows], late, stride * plant.dt, rng)
    truth = truth.select(rows)
    desired = curve.sample(truth.t)
    return SimulatedRun(truth.joints, truth.t, *measured, truth, desired, saturated)


def _require_motion(plant: Plant, dq: FloatArray, first: int) -> None:
    """Raise a ModelError if an arm has left all bounds in some steps from the first on."""
    lost = ~(np.abs(dq) < _LOST)
    if np.any(lost):
        step, joint = np.argwhere(lost)[0]
        raise ModelError(
            f'{plant.robot.name}: the simulated arm does not follow; {plant.robot.joints[joint]} '
            f'is faster than {_LOST:g} rad/s (or m/s) after {plant.dt * (first + step):.3g} s'
        )


def whole_steps(time: float, dt: float, what: str) -> int:
    """
    Return how many steps a time takes.

    Raises
    ------
    ModelError
        If it is not a whole number of them; the message begins with `what`.

    """
    steps = round(time / dt) if np.isfinite(time) else 0
    if steps < 1 or abs(steps * dt - time) > 1e-9 * time:
        raise ModelError(
            f'{what} does not fit the step of {dt:g} s: take {1.0 / dt:g} Hz divided by a whole '
            'number'
        )
    return steps
