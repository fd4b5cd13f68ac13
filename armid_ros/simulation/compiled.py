# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Interface to the compiled steps of `kernel.c` for a plant and its controller.

The kernel computes the steps in which no friction element changes its mode and no joint reaches a
stop, some fifty times as fast as `integrator.step`. `integrator.step` computes all other steps,
and every step if the package was installed without a compiler.

"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import Any

from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
from armid_ros.simulation.contacts import SPEED_TOLERANCE
from armid_ros.simulation.controller import Controller, LinearFeedback, Targets
from armid_ros.simulation.plant import Plant, State
import numpy as np
import numpy.typing as npt

_JOINT = np.dtype(
    [
        ('parent', np.int64),
        ('slide', float, 3),
        ('turn', float, 3),
        ('origin', float, 3),
        ('sliding', float, 3),
        ('turning', float, (9, 3)),
        ('mass', float),
        ('first_moment', float, 3),
        ('inertia', float, 9),
    ]
)
_TORQUE_LAW = ctypes.CFUNCTYPE(ctypes.c_int)
_ADDRESS, _REAL, _COUNT = ctypes.c_void_p, ctypes.c_double, ctypes.c_int64


class _Arm(ctypes.Structure):
    _fields_ = (
        ('n', _COUNT),
        ('gravity', _REAL * 3),
        ('joints', _ADDRESS),
        ('added_inertia', _ADDRESS),
    )


class _Controller(ctypes.Structure):
    _fields_ = (
        ('arm', _Arm),
        ('bandwidth', _REAL),
        ('follows', _REAL),
        ('stiffness', _ADDRESS),
        ('damping', _ADDRESS),
    )


class _Plant(ctypes.Structure):
    _fields_ = (
        ('arm', _Arm),
        ('dt', _REAL),
        ('speed_tolerance', _REAL),
        ('damping', _ADDRESS),
        ('constant', _ADDRESS),
        ('lower', _ADDRESS),
        ('upper', _ADDRESS),
        ('lowest_torque', _ADDRESS),
        ('highest_torque', _ADDRESS),
        ('n_elements', _COUNT),
        ('element_joint', _ADDRESS),
        ('element_lower', _ADDRESS),
        ('element_upper', _ADDRESS),
        ('law_input', _ADDRESS),
        ('law_torque', _ADDRESS),
        ('torque_law', _TORQUE_LAW),
    )


@cache
def kernel() -> ctypes.CDLL | None:
    """Return the compiled kernel; None if it was not compiled."""
    found = find_spec('armid_ros.simulation._kernel')
    if found is None or found.origin is None:
        return None
    library = ctypes.CDLL(found.origin)
    library.advance.restype = _COUNT
    library.advance.argtypes = [*3 * [_ADDRESS], _REAL, _COUNT, _COUNT, *8 * [_ADDRESS]]
    library.dynamics.argtypes = 6 * [_ADDRESS]
    return library


def _array(values: npt.ArrayLike, kind: npt.DTypeLike = float) -> npt.NDArray[Any]:
    return np.ascontiguousarray(values, dtype=kind)


@dataclass(frozen=True, eq=False)
class _Structure:
    """A C structure of the kernel, and the arrays to which it points."""

    values: Any
    arrays: tuple[npt.NDArray[Any], ...]

    @property
    def address(self) -> int:
        return ctypes.addressof(self.values)


def rigid_body(robot: Robot, added_inertia: FloatArray, weighs: bool = True) -> _Structure:
    """
    Return a rigid-body model in the format of the kernel.

    Parameters
    ----------
    robot : Robot
        Robot of n joints.
    added_inertia : ndarray, shape (n, n)
        Inertia added to the inertia matrix of the robot [kg m^2].
    weighs : bool
        Whether gravity acts on the robot.

    """
    joints = np.zeros(robot.n_joints, _JOINT)
    for row, geometry, body in zip(joints, robot.geometry, robot.model.inertias[1:], strict=True):
        for name in ('parent', 'slide', 'turn', 'origin', 'sliding'):
            row[name] = getattr(geometry, name)
        row['turning'] = geometry.turning.reshape(9, 3)
        row['mass'], row['first_moment'] = body.mass, body.mass * body.lever
        row['inertia'] = body.matrix()[3:, 3:].ravel()
    added = _array(added_inertia)
    gravity = (_REAL * 3)(*(weighs * robot.gravity))
    values = _Arm(len(joints), gravity, joints.ctypes.data, added.ctypes.data)
    return _Structure(values, (joints, added))


class CompiledLoop:
    """
    A plant and its controller in the format of the kernel.

    Parameters
    ----------
    plant : Plant
        Plant of rigid joints without drives, hysteresis, load-dependent or coupled dry friction.
    feedback : LinearFeedback
        The feedback law of its controller.

    """

    def __init__(self, plant: Plant, feedback: LinearFeedback) -> None:
        n, dry = plant.robot.n_joints, plant.contacts
        added = np.diag(plant.model.armature)
        added = added if plant.coupling is None else added + plant.coupling
        body = rigid_body(plant.robot, added)
        far = np.full(n, np.inf)
        lower, upper = (plant.robot.lower, plant.robot.upper) if plant.hard_stops else (-far, far)
        self._law_input, self._law_torque = np.empty(1 + 2 * n), np.empty(n)
        self._torque, self.failure = plant.torque, list[BaseException]()
        arrays = (
            _array(plant.damping),
            np.zeros(n) if plant.constant is None else _array(plant.constant),
            *map(_array, (lower, upper, *plant.torque_range)),
            _array(dry.axes, np.int64),
            *map(_array, (dry.law.lower, dry.law.upper)),
        )
        addresses = [array.ctypes.data for array in arrays]
        self._plant = _Structure(
            _Plant(
                body.values,
                plant.dt,
                SPEED_TOLERANCE,
                *addresses[:6],
                len(dry.axes),
                *addresses[6:],
                self._law_input.ctypes.data,
                self._law_torque.ctypes.data,
                _TORQUE_LAW() if plant.torque is None else _TORQUE_LAW(self._smooth_effects),
            ),
            (*body.arrays, *arrays),
        )
        nominal = rigid_body(feedback.robot, feedback.added_inertia, feedback.weighs)
        gains = [np.array(np.broadcast_to(x, n)) for x in (feedback.stiffness, feedback.damping)]
        self._controller = _Structure(
            _Controller(
                nominal.values,
                feedback.bandwidth,
                feedback.follows,
                *(gain.ctypes.data for gain in gains),
            ),
            (*nominal.arrays, *gains),
        )
        self.addresses = self._plant.address, self._controller.address

    @classmethod
    def of(cls, plant: Plant, controller: Controller) -> CompiledLoop | None:
        """Return the loop; None if the kernel does not support the plant or is not compiled."""
        action, dry = plant.action, plant.contacts
        usual = plant.springs is None and action.drive is None and action.hysteresis is None
        of_joints = dry.friction is None and -1 not in dry.axes
        of_joints = of_joints and len(set(dry.axes)) == len(dry.axes)
        feedback, library = controller.feedback, kernel()
        if not (usual and of_joints) or feedback is None or library is None:
            return None
        most = _COUNT.in_dll(library, 'most_joints').value
        return cls(plant, feedback) if plant.robot.n_joints <= most else None

    def _smooth_effects(self) -> int:
        """Compute the smooth effects of the plant for the kernel; return 1 after an exception."""
        n = len(self._law_torque)
        t, q, dq = self._law_input[0], self._law_input[1 : n + 1], self._law_input[n + 1 :]
        assert self._torque is not None
        try:
            self._law_torque[:] = self._torque(t, q, dq)
        except BaseException as error:  # Ctrl-C too: exceptions do not pass through C
            self.failure.append(error)
            return 1
        return 0


class CompiledRun:
    """
    A run of the kernel.

    Parameters
    ----------
    loop : CompiledLoop
        The plant and its controller.
    targets : Targets
        The targets at the end of each of N steps.
    moved : ndarray, shape (3, N + 1, n)
        Position, velocity and acceleration at the steps; written by the run.
    tau : ndarray, shape (N + 1, n)
        Torque at the steps; written by the run.

    """

    def __init__(
        self, loop: CompiledLoop, targets: Targets, moved: FloatArray, tau: FloatArray
    ) -> None:
        asked = map(_array, (targets.q, targets.dq, targets.ddq, targets.feedforward))
        self._rows = (*moved, tau, *asked)
        self._addresses = [row.ctypes.data for row in self._rows]
        self._loop, self._last = loop, len(targets)

    def advance(self, state: State, row: int) -> int:
        """Compute steps until a mode changes or a stop is reached; return the next row."""
        library = kernel()
        assert library is not None
        modes = np.array(state.modes, dtype=np.int64)
        reached: int = library.advance(
            *self._loop.addresses,
            modes.ctypes.data,
            state.t,
            row,
            self._last,
            *self._addresses,
        )
        if self._loop.failure:
            raise self._loop.failure.pop()
        return reached
