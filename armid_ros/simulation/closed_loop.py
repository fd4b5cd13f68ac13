# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Closed loop of controller, drives and plant, with one controller update per step.

The kernel, `kernel.c`, computes steps without a change of friction modes and without joint
stops, about fifty times as fast as `integrator.step`. `integrator.step` computes all
other steps, and every step if the package was installed without a compiler.

"""

from __future__ import annotations

from collections.abc import Callable
import ctypes
from typing import Any, NamedTuple

from armid_ros.model.compiled import (
    ADDRESS,
    BodyOfKernel,
    COUNT,
    kernel,
    kernel_body,
    REAL,
    Structure,
)
from armid_ros.motion import FloatArray, Motion
from armid_ros.simulation.contacts import SPEED_TOLERANCE
from armid_ros.simulation.controller import Controller, LinearFeedback
from armid_ros.simulation.integrator import step
from armid_ros.simulation.plant import Plant, State
import numpy as np
import numpy.typing as npt

_TORQUE_LAW = ctypes.CFUNCTYPE(ctypes.c_int)


class _Controller(Structure):
    _fields_ = (
        ('arm', BodyOfKernel),
        ('bandwidth', REAL),
        ('follows', REAL),
        ('stiffness', ADDRESS),
        ('damping', ADDRESS),
    )


class _Plant(Structure):
    _fields_ = (
        ('arm', BodyOfKernel),
        ('dt', REAL),
        ('speed_tolerance', REAL),
        ('damping', ADDRESS),
        ('constant', ADDRESS),
        ('lower', ADDRESS),
        ('upper', ADDRESS),
        ('lowest_torque', ADDRESS),
        ('highest_torque', ADDRESS),
        ('n_elements', COUNT),
        ('element_joint', ADDRESS),
        ('element_lower', ADDRESS),
        ('element_upper', ADDRESS),
        ('law_input', ADDRESS),
        ('law_torque', ADDRESS),
        ('torque_law', _TORQUE_LAW),
    )


class CompiledLoop:
    """
    Plant and controller as data structures of the compiled kernel, which simulates steps fast.

    Parameters
    ----------
    plant : Plant
        Plant of rigid joints without drives, hysteresis, load-dependent or coupled dry friction.
    feedback : LinearFeedback
        The feedback control law of its controller.
    body, nominal : BodyOfKernel
        Rigid bodies of the plant and of the feedback law.

    """

    def __init__(
        self, plant: Plant, feedback: LinearFeedback, body: BodyOfKernel, nominal: BodyOfKernel
    ) -> None:
        robot, dry, n = plant.robot, plant.contacts, plant.robot.n_joints
        far = np.full(n, np.inf)
        lower, upper = (robot.lower, robot.upper) if plant.hard_stops else (-far, far)
        self._law_input, self._law_torque = np.empty(1 + 2 * n), np.empty(n)
        self._torque, self.failure = plant.torque, list[BaseException]()
        arrays: list[npt.NDArray[Any]] = [
            plant.damping,
            np.zeros(n) if plant.constant is None else plant.constant,
            *(lower, upper, -robot.torque_limit, robot.torque_limit),
            np.array(dry.axes, dtype=np.int64),
            *(dry.lower, dry.upper),
        ]
        arrays = [np.ascontiguousarray(array) for array in arrays]
        addresses = [array.ctypes.data for array in arrays]
        self._plant = _Plant(
            body,
            plant.dt,
            SPEED_TOLERANCE,
            *addresses[:6],
            len(dry.axes),
            *addresses[6:],
            self._law_input.ctypes.data,
            self._law_torque.ctypes.data,
            _TORQUE_LAW() if plant.torque is None else _TORQUE_LAW(self._smooth_effects),
        )
        gains = [np.array(np.broadcast_to(x, n)) for x in (feedback.stiffness, feedback.damping)]
        self._controller = _Controller(
            nominal,
            feedback.bandwidth,
            feedback.follows,
            *(gain.ctypes.data for gain in gains),
        )
        # the structure contains a copy of the rigid body
        self._plant.arrays = *body.arrays, *arrays
        self._controller.arrays = *nominal.arrays, *gains
        self.addresses = self._plant.address, self._controller.address

    @classmethod
    def of(cls, plant: Plant, controller: Controller) -> CompiledLoop | None:
        """Return the compiled loop; None if the kernel is missing or cannot simulate the plant."""
        action, dry = plant.action, plant.contacts
        usual = plant.springs is None and action.drive is None and action.hysteresis is None
        usual = usual and plant.robot.mechanism is None
        of_joints = dry.friction is None and dry.of_single_joints
        feedback = controller.feedback
        if not (usual and of_joints) or feedback is None:
            return None
        body = kernel_body(plant.robot, plant.added_inertia)
        nominal = kernel_body(feedback.robot, feedback.added_inertia, feedback.weighs)
        return None if body is None or nominal is None else cls(plant, feedback, body, nominal)

    def step_function(
        self, targets: Motion, rows: range, moved: FloatArray, tau: FloatArray
    ) -> Callable[[State, int], int]:
        """
        Return a function that computes steps until a friction mode changes or a joint hits a stop.

        Parameters
        ----------
        targets : Motion
            Desired motion and feedforward torque.
        rows : range
            Rows of the targets at the end of each of N steps.
        moved : ndarray, shape (3, N + 1, n)
            Position, velocity and acceleration at the steps; written by the function.
        tau : ndarray, shape (N + 1, n)
            Torque at the steps; written by the function.

        Returns
        -------
        callable (state, row) -> int
            From a state and its row to the next row.

        """
        library, last = kernel(), len(rows)
        assert library is not None and targets.tau is not None
        desired = (targets.q, targets.dq, targets.ddq, targets.tau)
        arrays = (*moved, tau, *(values[rows.start : rows.stop] for values in desired))
        addresses = [array.ctypes.data for array in arrays]

        # the default argument keeps the arrays whose addresses the kernel has
        def advance(state: State, row: int, arrays: object = arrays) -> int:
            modes = np.array(state.modes, dtype=np.int64)
            reached: int = library.advance(
                *self.addresses, modes.ctypes.data, state.t, row, last, *addresses
            )
            if self.failure:
                raise self.failure.pop()
            return reached

        return advance

    def _smooth_effects(self) -> int:
        """Compute the torque of smooth effects for the kernel; return 1 after an exception."""
        n = len(self._law_torque)
        t, q, dq = self._law_input[0], self._law_input[1 : n + 1], self._law_input[n + 1 :]
        assert self._torque is not None
        try:
            self._law_torque[:] = self._torque(t, q, dq)
        except BaseException as error:  # exceptions, Ctrl-C included, do not pass through C
            self.failure.append(error)
            return 1
        return 0


class Trace(NamedTuple):
    """
    Simulated states and torques at N successive steps.

    Attributes
    ----------
    motors, links : ndarray, shape (3, N + 1, n)
        Positions, velocities and accelerations from the beginning of the first step to the end of
        the last; the same array if all joints are rigid.
    tau : ndarray, shape (N + 1, n)
        Commanded torque of each step, and of the step after the last, within the limits of the
        drives [N m].
    state : State
        The state after the last step.

    """

    motors: FloatArray
    links: FloatArray
    tau: FloatArray
    state: State


def command(
    plant: Plant, controller: Controller, state: State, targets: Motion, row: int
) -> FloatArray:
    """Return the controller's torque at one row of the targets, clipped to limits, (n,) [N m]."""
    assert targets.tau is not None
    desired = targets.q[row], targets.dq[row], targets.ddq[row]
    q, dq = (state.q, state.dq) if state.rotors is None else plant.motors(state)[:2]
    limit = plant.robot.torque_limit
    torque = controller.torque(q, dq, desired, targets.tau[row])
    return np.minimum(np.maximum(torque, -limit), limit)


def run(
    plant: Plant,
    controller: Controller,
    state: State,
    torque: FloatArray,
    targets: Motion,
    rows: range,
    compiled: CompiledLoop | None = None,
    fine: Plant | None = None,
) -> Trace:
    """
    Simulate the closed loop of plant and controller along a desired motion.

    Parameters
    ----------
    plant : Plant
        The arm.
    controller : Controller
        The controller.
    state : State
        The initial state.
    torque : ndarray, shape (n,)
        Torque of the first step, from `command`.
    targets : Motion
        Desired motion and feedforward torque, from the controller.
    rows : range
        Rows of the targets at the end of each step.
    compiled : CompiledLoop, optional
        The same plant and controller in compiled form, used for the steps that it supports.
    fine : Plant, optional
        The same arm without drives, whose step is a whole part of the step of the plant. It
        integrates the other steps, in which friction begins to stick or to slip.

    """
    drive, last = plant.action.drive, len(rows)
    tau = np.empty((last + 1, len(torque)))
    links = np.empty((3, *tau.shape))
    motors = links if plant.springs is None else np.empty_like(links)
    q, dq, ddq = links
    fast = None if compiled is None else compiled.step_function(targets, rows, links, tau)
    k = 0
    while k < last:
        q[k], dq[k], ddq[k], tau[k] = state.q, state.dq, state.ddq, torque
        if motors is not links:
            motors[:, k] = plant.motors(state)
        reached = k if fast is None else fast(state, k)
        if reached > k:
            steps = state.steps + reached - k
            at, speed, pull = links[:, reached].copy()
            modes, memory = state.modes, state.memory
            state = State(steps, steps * plant.dt, at, speed, pull, modes, memory)
            k, torque = reached, tau[reached]
            continue
        if fine is None:
            state = step(plant, state, torque if drive is None else drive(torque))
        else:
            steps = state.steps + 1
            for _ in range(round(plant.dt / fine.dt)):
                state = step(fine, state, torque)
            state = State(steps, steps * plant.dt, *state[2:])
        torque = command(plant, controller, state, targets, rows[k])
        k += 1
    q[last], dq[last], ddq[last], tau[last] = state.q, state.dq, state.ddq, torque
    if motors is not links:
        motors[:, last] = plant.motors(state)
    return Trace(motors, links, tau, state)
