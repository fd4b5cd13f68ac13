# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm that stands there, takes trajectories, and is read while time goes on."""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray
from armid_ros.simulation.closed_loop import command, run, Targets, Trace
from armid_ros.simulation.controller import ComputedTorque, Controller
from armid_ros.simulation.course import Course
from armid_ros.simulation.plant import middle_position, Plant, State
from armid_ros.simulation.readings import RecentPast
from armid_ros.simulation.reference import Reference
from armid_ros.simulation.sensors import Sensors
import numpy as np
import numpy.typing as npt

#: Steps of the reference that are evaluated in one go.
_BLOCK = 1000


@dataclass(frozen=True, eq=False)
class Sample:
    """
    One reading of the sensors.

    Attributes
    ----------
    steps : int
        Time in steps of the plant.
    t : float
        Time [s].
    q, dq, tau : ndarray, shape (n,)
        Position [rad or m], velocity and torque [N m or N] as measured.

    """

    steps: int
    t: float
    q: FloatArray
    dq: FloatArray
    tau: FloatArray


class SimulatedArm:
    """
    A simulated arm with its controller, drives and sensors.

    It holds its pose until it is given a trajectory, and the last point of that when it ends.

    Parameters
    ----------
    arm : ArmModel or Plant
        The arm; an ArmModel is integrated at 1 kHz with hard stops.
    rng : numpy.random.Generator
        Source of the sensors' noise.
    controller : Controller, optional
        Computed torque of the true arm by default.
    sensors : Sensors, optional
        Perfect by default.
    start : array_like, shape (n,), optional
        Where it stands [rad or m]: the middle of the range of motion by default.

    Raises
    ------
    TrajectoryError
        If it cannot stand there.

    """

    def __init__(
        self,
        arm: ArmModel | Plant,
        *,
        rng: np.random.Generator,
        controller: Controller | None = None,
        sensors: Sensors | None = None,
        start: npt.ArrayLike | None = None,
    ) -> None:
        self.plant = arm if isinstance(arm, Plant) else Plant(arm)
        self.controller = controller or ComputedTorque(self.plant.arm)
        self.sensors = sensors or Sensors()
        self._rng = rng
        start = middle_position(self.plant.robot) if start is None else start
        self._home = start
        self._course = Course(self.plant.robot, self.plant.dt)
        self.reset()

    @property
    def joints(self) -> tuple[str, ...]:
        """Joint names in column order."""
        return self.plant.robot.joints

    @property
    def state(self) -> State:
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
        self._state = self.plant.state(self._home, steps=steps)
        self._previous: FloatArray | None = None
        self._course.hold(self._state.q, steps)
        self._set_off()
        delay = self.sensors.torque_delay
        self._past = RecentPast.of(self.plant, self._state, self._torque, delay)

    def become(self, arm: ArmModel) -> None:
        """
        Go on as another arm from where this one is: it picks up a load, its friction rises.

        The controller stays what it was, and so knows nothing of it.

        Parameters
        ----------
        arm : ArmModel
            The same robot with other effects or other values of them.

        Raises
        ------
        ModelError
            If it is another robot.

        """
        now = self._state
        self.plant = self.successor(arm)
        self._state = self.plant.state(now.q, now.dq, now.ddq, now.steps)
        self._past = RecentPast.of(
            self.plant, self._state, self._torque, self.sensors.torque_delay
        )

    def successor(self, arm: ArmModel) -> Plant:
        """
        Return the plant that this arm would have as another one.

        Raises
        ------
        ModelError
            If it is another robot, or no body.

        """
        if arm.robot.joints != self.joints:
            raise ModelError(
                f'{arm.robot.name}: an arm with the joints {", ".join(self.joints)} cannot become '
                f'one with {", ".join(arm.robot.joints)}'
            )
        return replace(self.plant, arm=arm)

    def set_trajectory(self, reference: Reference) -> None:
        """
        Begin a trajectory now, in place of the one that may be under way; see `Course.begin`.

        Raises
        ------
        TrajectoryError
            If the arm cannot follow it. It goes on with what it was doing.

        """
        self._course.begin(reference, self._state.steps)
        self._set_off()

    def advance(self, steps: int = 1) -> Sample:
        """
        Let time go on, and read the sensors.

        Parameters
        ----------
        steps : int
            Steps of the plant, 1 or more.

        """
        if steps < 1:
            raise ValueError(f'an arm advances by 1 step or more, not {steps}')
        left = steps
        while left:
            row = self._state.steps + 1 - self._first
            if row >= len(self._targets):
                self._look_ahead()
                row = 1
            taken = min(left, len(self._targets) - row)
            targets = self._targets[row : row + taken]
            self._record(run(self.plant, self.controller, self._state, self._torque, targets))
            left -= taken
        return self._read(steps * self.plant.dt)

    def _set_off(self) -> None:
        """Do what the course says from now on."""
        self._look_ahead()
        self._torque = command(self.plant, self.controller, self._state, self._targets, 0)

    def _look_ahead(self) -> None:
        """Evaluate the reference from now on, for some time."""
        self._first = self._state.steps
        self._targets = Targets.of(self._course.desired(self._first, _BLOCK + 1), self.controller)

    def _record(self, trace: Trace) -> None:
        """Keep where the arm is, and what the sensors have yet to read."""
        self._state, self._torque = trace.state, trace.torque
        self._past.extend(trace)

    def _read(self, dt: float) -> Sample:
        state = self._state
        q, dq, tau = (row[np.newaxis] for row in self._past.latest())
        q, dq, tau = self.sensors.measure(q, dq, tau, dt, self._rng, self._previous)
        self._previous = q[0]
        return Sample(state.steps, state.t, q[0], dq[0], tau[0])
