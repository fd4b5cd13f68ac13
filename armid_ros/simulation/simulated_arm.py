# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A simulated arm that accepts trajectories and returns sensor readings as time advances."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import ModelError, TrajectoryError
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots.reference import Reference
from armid_ros.simulation.closed_loop import command, CompiledLoop, run, Trace
from armid_ros.simulation.controller import ComputedTorque, Controller, MotorControl
from armid_ros.simulation.plant import Plant, State
from armid_ros.simulation.sensors import accelerometer_readings, RecentPast, Sensors
import numpy as np
import numpy.typing as npt

#: Largest velocity of a trajectory at its beginning and end [rad/s or m/s].
_REST_SPEED = 1e-3
#: Steps that are simulated at once if they are compiled. Samples are cheaper than with single
#: steps, and a block takes less time than a period at 1 kHz.
_BLOCK = 50


@dataclass(frozen=True, eq=False)
class LinkSample:
    """
    Readings on the link side of an arm with elastic joints.

    Attributes
    ----------
    q, dq : ndarray, shape (n,)
        Readings of the encoders at the links [rad or m].
    acceleration : ndarray, shape (n, 3)
        Readings of the accelerometers on the links [m/s^2].
    asked_q, asked_dq : ndarray, shape (n,)
        Motor positions commanded to the loop, and their mean velocity over the last step.

    """

    q: FloatArray
    dq: FloatArray
    acceleration: FloatArray
    asked_q: FloatArray
    asked_dq: FloatArray


@dataclass(frozen=True, eq=False)
class Sample:
    """
    Sensor readings of a simulated arm at one time.

    Attributes
    ----------
    steps : int
        Time as a number of steps of the plant.
    t : float
        Time [s].
    q, dq, tau : ndarray, shape (n,)
        Position [rad or m], velocity and torque [N m or N] as measured. With elastic joints, these
        are readings of the motors, and the torque is that of the next step.
    link : LinkSample, or None
        Readings on the link side of the springs; None if all joints are rigid.

    """

    steps: int
    t: float
    q: FloatArray
    dq: FloatArray
    tau: FloatArray
    link: LinkSample | None = None


class SimulatedArm:
    """
    A simulated arm with its controller, drives and sensors.

    The arm holds its pose until it receives a trajectory, and then holds the last point of the
    trajectory.

    Parameters
    ----------
    arm : ArmModel or Plant
        The arm; an ArmModel is integrated at 1 kHz with rigid joints and hard stops.
    rng : numpy.random.Generator
        Source of the sensors' noise.
    controller : Controller, optional
        Computed torque with the true arm by default; with elastic joints, velocity loops designed
        for the plant.
    sensors : Sensors, optional
        Sensors of motors and links; without errors by default.
    accelerometers : ndarray, shape (n, 3), optional
        Places of accelerometers on links with springs, in the frames of their joints [m]; by
        default the centroids of the links.
    start : array_like, shape (n,), optional
        Initial pose [rad or m]; the middle of the range of motion by default.

    Raises
    ------
    TrajectoryError
        If the initial pose is beyond a stop.

    """

    def __init__(
        self,
        arm: ArmModel | Plant,
        *,
        rng: np.random.Generator,
        controller: Controller | None = None,
        sensors: Sensors | None = None,
        accelerometers: FloatArray | None = None,
        start: npt.ArrayLike | None = None,
    ) -> None:
        self.plant = arm if isinstance(arm, Plant) else Plant(arm)
        if controller is None:
            rigid = self.plant.springs is None
            controller = ComputedTorque(self.plant.arm) if rigid else MotorControl.of(self.plant)
        self.controller = controller
        self.sensors = sensors or Sensors()
        if accelerometers is None:
            inertias = list(self.plant.robot.model.inertias)[1:]
            accelerometers = np.array([inertia.lever for inertia in inertias])
        self.accelerometers = accelerometers
        self.rng = rng
        start = self.plant.robot.middle_pose if start is None else start
        self._compiled = CompiledLoop.of(self.plant, self.controller)
        self._home = self.plant.state(start).q
        self._state: State  # at the end of the block
        self._ahead: int  # number of steps from the present to the end of the block
        self._block_start: tuple[State, FloatArray]  # with the torque of the first step
        self._reference: Reference
        self._acting: Controller
        self._targets: Motion
        self._torque: FloatArray
        self.reset()

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in the order of array columns."""
        return self.plant.robot.joints

    @property
    def state(self) -> State:
        """Return the true state of the arm."""
        self._end_block()
        return self._state

    @property
    def steps(self) -> int:
        """Time since the start, as a number of simulation steps."""
        return self._state.steps - self._ahead

    @property
    def t(self) -> float:
        """Time since the start [s]."""
        return self.steps * self.plant.dt

    @property
    def ends_at(self) -> float:
        """End time of the present trajectory, which may be in the past [s]."""
        return self._begun * self.plant.dt + self._reference.duration

    def reset(self, steps: int = 0) -> None:
        """
        Return the arm to its initial pose, at rest and without a trajectory.

        Parameters
        ----------
        steps : int
            Time after the reset, in steps of the plant.

        """
        self._begin(Reference(self.joints, np.zeros(1), self._home[np.newaxis]), steps)

    def start_on(self, reference: Reference) -> Reference:
        """
        Set the arm to the first point of a reference, with its velocity.

        The result is the reference with its joints in the order of the robot.

        Raises
        ------
        TrajectoryError
            If the joints of the reference do not fit the robot, or a limit is exceeded.

        """
        curve = reference.for_robot(self.plant.robot)
        curve.require_limits(self.plant.robot, self.plant.dt)
        self._begin(curve, 0)
        return curve

    def become(self, arm: ArmModel) -> None:
        """
        Replace the arm model in the present state, as when the arm picks up a load.

        The controller keeps its model.

        Parameters
        ----------
        arm : ArmModel
            The same robot with other effects or other values of them.

        Raises
        ------
        ModelError
            If the robot is another one, or joints are elastic.

        """
        now = self.state
        self.plant = self.successor(arm)
        self._state = self.plant.state(now.q, now.dq, now.ddq, now.steps)
        self._compiled = CompiledLoop.of(self.plant, self.controller)
        delay = self.sensors.torque_delay
        self._past = RecentPast(self.plant, self._state, self._torque, delay)

    def successor(self, arm: ArmModel) -> Plant:
        """
        Return the plant of a new arm model; raise an error if it cannot replace the present model.

        Raises
        ------
        ModelError
            If the robot is another one, its links are not physically possible, or joints are
            elastic.

        """
        if self.plant.springs is not None:
            raise ModelError(
                'the effects of an arm with elastic joints cannot change; start a new arm'
            )
        if arm.robot.joints != self.joints:
            raise ModelError(
                f'{arm.robot.name}: the new model has joints {", ".join(arm.robot.joints)}, '
                f'but the arm has {", ".join(self.joints)}'
            )
        return Plant(arm, self.plant.dt, self.plant.hard_stops)

    def set_trajectory(self, reference: Reference) -> None:
        """
        Start a trajectory now, in place of the present trajectory.

        If the time of the first point is later than zero, the arm moves to this point within that
        time.

        Raises
        ------
        TrajectoryError
            If a joint is unknown or missing, a position or velocity limit is exceeded, the arm has
            no time to reach the first point, or the last point is not at rest. The present
            trajectory then continues.

        """
        self._end_block()
        curve, now = reference.for_robot(self.plant.robot), self._desired(1)
        if curve.dq is not None:
            self._require_small('velocity at the end', curve.dq[-1], _REST_SPEED, '/s', 'stop it')
        if curve.t[0] > 0.0:
            curve = curve.after(now.q[0], now.dq[0], now.ddq[0])
        else:
            # largest distance of an immediate first point from the desired position [rad or m]
            advice = 'give its first point a later time, to get there'
            self._require_small('step to the first point', curve.q[0] - now.q[0], 0.01, '', advice)
            if curve.dq is not None:
                jump = curve.dq[0] - now.dq[0]
                self._require_small('velocity step at the start', jump, _REST_SPEED, '/s', advice)
        curve.require_limits(self.plant.robot, self.plant.dt)
        self._reference, self._begun = curve, self._state.steps
        self._look_ahead(self._targets.q[self._row])
        if not self.controller.acts_once:
            self._torque = command(self.plant, self._acting, self._state, self._targets, 0)

    def advance(self, steps: int = 1) -> Sample:
        """
        Simulate a number of steps, and return the sensor readings at the end.

        Parameters
        ----------
        steps : int
            Steps of the plant, 1 or more.

        """
        if steps < 1:
            raise ValueError(f'an arm has to advance by 1 step or more, not {steps}')
        self._ahead -= steps
        while self._ahead < 0:
            before = self._state, self._torque
            missing = -self._ahead
            trace = self._simulate(missing if self._compiled is None else max(missing, _BLOCK))
            self._block_start = before
            self._ahead += len(trace.tau) - 1
        return self.read()

    def traces(self, steps: int) -> Iterator[Trace]:
        """Simulate a number of steps; yield the results in traces of at most 1000 steps."""
        self._end_block()
        while steps:
            trace = self._simulate(steps)
            steps -= len(trace.tau) - 1
            yield trace

    def _simulate(self, steps: int) -> Trace:
        """Simulate steps, at most up to the last computed target; return their trace."""
        row = self._row + 1
        if row >= len(self._targets):
            self._look_ahead(self._targets.q[-1])
            row = 1
        rows = range(row, min(row + steps, len(self._targets)))
        arm = self.plant, self._acting
        trace = run(*arm, self._state, self._torque, self._targets, rows, self._compiled)
        self._state, self._torque = trace.state, trace.tau[-1]
        self._past.extend(trace)
        return trace

    def _end_block(self) -> None:
        """Discard the steps simulated ahead of time; compute the state at the present time."""
        if self._ahead <= 0:
            return
        (state, torque), present = self._block_start, self.steps
        rows = range(state.steps - self._first + 1, present - self._first + 1)
        arm = self.plant, self._acting
        trace = run(*arm, state, torque, self._targets, rows, self._compiled)
        self._past.drop(self._ahead)
        self._state, self._torque, self._ahead = trace.state, trace.tau[-1], 0

    def read(self) -> Sample:
        """Return the sensor readings at the present time."""
        q, dq, tau = self._past.latest(self._ahead)
        q, dq, tau = self.sensors.measure(q[np.newaxis], dq[np.newaxis], tau[np.newaxis], self.rng)
        link = None
        if self.plant.springs is not None:
            state = self._state
            links = Motion.of_states(self.joints, state.q, state.dq, state.ddq)
            at, speed, acceleration = self.read_links(links)
            commanded = self._targets.q[self._row], self._targets.dq[self._row]
            link = LinkSample(at[0], speed[0], acceleration[:, 0], *commanded)
        return Sample(self.steps, self.t, q[0], dq[0], tau[0], link)

    def read_links(self, links: Motion) -> tuple[FloatArray, FloatArray, FloatArray]:
        """
        Return the readings on the link side of the springs.

        Parameters
        ----------
        links : Motion
            True motion of the links, N samples.

        Returns
        -------
        q, dq : ndarray, shape (N, n)
            Readings of the encoders [rad or m].
        acceleration : ndarray, shape (n, N, 3)
            Readings of the accelerometers [m/s^2].

        """
        still = np.zeros_like(links.q)
        q, dq, _ = self.sensors.measure(links.q, links.dq, still, self.rng)
        acceleration = accelerometer_readings(self.plant.robot, links, self.accelerometers)
        noise = self.sensors.acceleration_noise
        if noise:
            acceleration = acceleration + noise * self.rng.standard_normal(acceleration.shape)
        return q, dq, acceleration

    def _begin(self, reference: Reference, steps: int) -> None:
        """Set the arm to the first point of a reference, with an empty sensor history."""
        first = reference.sample(np.zeros(1))
        self._state = self.plant.state(first.q[0], first.dq[0], first.ddq[0], steps)
        self._ahead = 0
        self._reference, self._begun = reference, steps
        self._acting = self.controller.in_initial_state()
        self._look_ahead(steps=1)
        self._torque = command(self.plant, self._acting, self._state, self._targets, 0)
        delay = self.sensors.torque_delay
        self._past = RecentPast(self.plant, self._state, self._torque, delay)

    @property
    def _row(self) -> int:
        """Row of the present step in the controller's targets."""
        return self._state.steps - self._first

    def _look_ahead(self, commanded: FloatArray | None = None, steps: int = 1000) -> None:
        """Compute the controller's targets of the next steps from the last commanded position."""
        self._first = self._state.steps
        self._targets = self.controller.targets(self._desired(steps + 1), commanded)

    def _desired(self, count: int) -> Motion:
        """Return the desired motion at `count` time steps, from the present step on."""
        first, times = self._state.steps, self.plant.times
        motion = self._reference.sample(times(first - self._begun, count))
        return replace(motion, t=times(first, count))

    def _require_small(
        self, quantity: str, values: FloatArray, tolerance: float, per: str, advice: str
    ) -> None:
        """Raise a TrajectoryError if a joint quantity exceeds a tolerance in absolute value."""
        worst = int(np.argmax(np.abs(values)))
        if abs(values[worst]) > tolerance:
            joint, unit = self.joints[worst], self.plant.robot.position_units[worst] + per
            raise TrajectoryError(
                f"trajectory: the {quantity} of joint '{joint}' is {values[worst]:.4g} {unit}, "
                f'more than {tolerance:g} {unit}; {advice}'
            )
