# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Simulation of an arm under position control, in windows of a recording.

tau = kp (u(t - delay) - q) + kd (du(t - delay) - dq), where u is the commanded position, and du
is the commanded velocity or zero. The loop is evaluated at the middle of each step of
the plant, with kd in the implicit damping. The error is thus of second order in the step for any
gain.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

from armid_ros import ArmModel, Robot
from armid_ros.errors import ModelError
from armid_ros.estimate import ParameterName
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.recording.recording import GAP_PERIODS
from armid_ros.simulation.closed_loop import CompiledLoop, run
from armid_ros.simulation.controller import Controller, LinearFeedback
from armid_ros.simulation.plant import Plant
import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline

#: Time for which the last command is held [s].
_COMMAND_HOLD = 0.5


@dataclass(frozen=True, eq=False)
class CommandedMotion:
    """
    Commanded positions and velocities; the drive applies each command until the next command.

    Attributes
    ----------
    t : ndarray, shape (K,)
        Times on the time base of the recording [s].
    q, dq : ndarray, shape (K, n)
        Commanded positions [rad or m] and velocities; velocities are zero if none are commanded.

    """

    t: FloatArray
    q: FloatArray
    dq: FloatArray

    @classmethod
    def of(cls, commanded: Recording, recording: Recording) -> CommandedMotion:
        """Convert recorded commands to a commanded motion in the time base of `recording`."""
        t = commanded.t + 1e-9 * (commanded.start_ns - recording.start_ns)
        dq = np.zeros_like(commanded.q) if commanded.dq is None else commanded.dq
        return cls(t, commanded.q, dq)

    def mean(self, edges: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return mean commanded position and velocity between K times `edges`, each (K - 1, n)."""
        ends = min(self.t[0], edges[0]) - 1.0, max(self.t[-1], edges[-1]) + 1.0
        t = np.concatenate([ends[:1], self.t, ends[1:]])
        values = np.hstack([self.q, self.dq])
        areas = np.vstack([values[:1], values]) * np.diff(t)[:, np.newaxis]
        integral = np.vstack([0.0 * areas[:1], np.cumsum(areas, axis=0)])
        there = np.column_stack([np.interp(edges, t, column) for column in integral.T])
        q, dq = np.hsplit(np.diff(there, axis=0) / np.diff(edges)[:, np.newaxis], 2)
        return q, dq


@dataclass(frozen=True, eq=False)
class Window:
    """
    Time window of a recording, with the measured state in which the simulation starts.

    Attributes
    ----------
    commands : CommandedMotion
        The commanded motion.
    start : float
        Time at which the simulation starts [s].
    state : ndarray, shape (3, n)
        Position, velocity and acceleration at that time.
    t : ndarray, shape (M,)
        Times of the samples that are compared [s].
    q : ndarray, shape (M, n)
        Their measured positions [rad or m].

    """

    commands: CommandedMotion
    start: float
    state: FloatArray
    t: FloatArray
    q: FloatArray


def windows_of(recording: Recording, commands: CommandedMotion) -> Iterator[Window]:
    """Yield windows of about 5 s in which positions and commands are recorded without gaps."""
    t = recording.t
    length, lead = 5.0, 0.5  # of a window, and of the time before it to forget the start state [s]
    around = 0.03  # half of the time over which a parabola gives the start state [s]
    known = (t >= commands.t[0]) & (t <= commands.t[-1] + _COMMAND_HOLD)
    breaks = np.diff(t) > GAP_PERIODS * recording.period
    breaks |= known[1:] != known[:-1]
    # samples at a rate above 250 Hz have no more information
    every = max(round(1.0 / (250.0 * max(recording.period, 1e-6))), 1)
    for stretch in np.split(np.arange(len(t)), np.flatnonzero(breaks) + 1):
        first = t[stretch[0]] + around
        count = round((t[stretch[-1]] - first - lead) / length + 0.3)
        if not known[stretch[0]] or count < 1:
            continue
        edges = np.linspace(first + lead, t[stretch[-1]], count + 1)
        for begin, end in pairwise(edges):
            start = begin - lead
            near = stretch[np.abs(t[stretch] - start) <= max(around, 2.5 * recording.period)]
            parabola = np.polynomial.polynomial.polyfit(t[near] - start, recording.q[near], 2)
            inside = stretch[(t[stretch] > begin) & (t[stretch] <= end)][::every]
            state = parabola * np.array([[1.0], [1.0], [2.0]])
            yield Window(commands, start, state, t[inside], recording.q[inside])


@dataclass(frozen=True, eq=False)
class LoopModel:
    """
    Model of a position-controlled robot with P parameters of its controller, drives and tool.

    Attributes
    ----------
    robot : Robot
        The described robot, of n joints.
    compensated : bool
        Whether the controller adds the gravity torque of the described robot.

    """

    robot: Robot
    compensated: bool = False

    @cached_property
    def bare(self) -> ArmModel:
        """Return the arm model of the robot description, with the fitted effects at zero."""
        names = 'rotor_inertia', 'viscous_friction', 'coulomb_friction', 'payload'
        return ArmModel.of(self.robot, effects=names)

    @cached_property
    def parameters(self) -> tuple[ParameterName, ...]:
        """Return names and units of the P parameters: delay, gains, effects, payload."""
        robot = self.robot
        units = list(zip(robot.torque_units, robot.position_units, strict=True))
        gains = [
            ParameterName(name, joint, f'{force}{time}/{position}')
            for name, time in (('position_gain', ''), ('velocity_gain', ' s'))
            for joint, (force, position) in zip(robot.joints, units, strict=True)
        ]
        own = self.bare.parameters[len(robot.rigid_parameters) :]
        return (
            ParameterName('command_delay', '', 's'),
            *gains,
            *own[: 3 * robot.n_joints + 1],
            *(ParameterName(f'payload_center_{axis}', own[-1].joint, 'm') for axis in 'xyz'),
            ParameterName('payload_gyration_radius', own[-1].joint, 'm'),
        )

    def arm(self, x: FloatArray) -> ArmModel:
        """Return the arm model for parameters x; the tool has three equal moments of inertia."""
        n, (mass, *center, radius) = self.robot.n_joints, x[-5:]
        tool = pin.Inertia(mass, np.array(center), mass * radius**2 * np.eye(3))
        values = (*np.split(x[2 * n + 1 : -5], 3), tool.toDynamicParameters())
        return replace(self.bare, values=values)

    def with_torque(
        self, x: FloatArray, recording: Recording, commands: CommandedMotion
    ) -> Recording:
        """
        Return a recording with the torques that the position controller computes.

        Parameters
        ----------
        x : ndarray, shape (P,)
            Values of the parameters; delay and gains are used.
        recording, commands : Recording, CommandedMotion
            Measured and commanded positions.

        """
        n = self.robot.n_joints
        arrived = recording.t - x[0]
        known = (arrived >= commands.t[0]) & (arrived <= commands.t[-1] + _COMMAND_HOLD)
        t, q = recording.t[known], recording.q[known]
        dq = CubicSpline(t, q)(t, 1)
        half = 0.5 * recording.period
        u, du = commands.mean(np.append(t - half, t[-1] + half) - x[0])
        tau = x[1 : n + 1] * (u - q) + x[n + 1 : 2 * n + 1] * (du - dq)
        if self.compensated:
            still = np.zeros_like(q)
            weight = ArmModel(self.robot).load(Motion(self.robot.joints, t, q, still, still))
            tau += weight
        return replace(recording, t=t, q=q, dq=None, tau=tau)

    def simulated(self, x: FloatArray, windows: Sequence[Window]) -> list[FloatArray]:
        """
        Simulate each window with parameters x, shape (P,); return the simulated positions.

        Returns
        -------
        list of ndarray, each (M, n)
            Positions at the times of the samples of each window [rad or m].

        """
        effects, n, dt = self.arm(x), self.robot.n_joints, 1e-3  # step of the plant [s]
        kp, kd = x[1 : n + 1], x[n + 1 : 2 * n + 1]
        rotor, viscous, *others = effects.values
        endless = replace(self.robot, torque_limit=np.full(n, np.inf))
        damped = replace(effects, robot=endless, values=(rotor, viscous + kd, *others))
        # a step in which a joint begins to stick or slip is divided into four, as a reversal at
        # the end of a step would delay the joint like viscous friction
        plant, fine = (Plant(damped, step, hard_stops=False) for step in (dt, dt / 4))
        # positions half a step ahead: kp (u - q - dq dt / 2)
        feedback = LinearFeedback(
            self.robot,
            np.zeros((n, n)),
            weighs=self.compensated,
            stiffness=kp,
            damping=0.5 * dt * kp,
        )
        control = Controller(feedback)
        compiled = CompiledLoop.of(plant, control)
        found, far = [], 3.0  # largest position error, that of an unstable loop [rad or m]
        for window in windows:
            # steps begin when commands arrive, as friction may hold against a mean of two commands
            sent = window.commands.t[np.searchsorted(window.commands.t, window.start - x[0]) - 1]
            late = (sent + x[0] - window.start) % dt
            start, (q, dq, ddq) = window.start + late, window.state
            steps = int(np.ceil((window.t[-1] - start) / dt)) + 1
            edges = start - x[0] + dt * np.arange(steps + 2)
            u, du = window.commands.mean(edges)
            still = np.zeros_like(u)
            targets = Motion(self.robot.joints, edges[:-1], u, still, still, kd * du)
            state, rows = plant.state(q + late * dq, dq + late * ddq, ddq), range(1, len(u))
            first = u[0], still[0], still[0]
            torque = control.torque(state.q, state.dq, first, kd * du[0])
            try:
                trace = run(plant, control, state, torque, targets, rows, compiled, fine)
            except (ModelError, FloatingPointError):  # the simulation is unstable
                found.append(np.full_like(window.q, far))
                continue
            q, dq, _ = trace.links
            place = (window.t - start) / dt
            k = np.minimum(place.astype(int), steps - 1)
            s = (place - k)[:, np.newaxis]
            here = q[k] + (q[k + 1] - q[k]) * s**2 * (3.0 - 2.0 * s)  # Hermite's spline
            here += dt * s * (1.0 - s) * (dq[k] * (1.0 - s) - dq[k + 1] * s)
            residual = np.nan_to_num(here - window.q, nan=far, posinf=far, neginf=-far)
            found.append(window.q + np.clip(residual, -far, far))
        return found
