# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Simulated velocity responses of the two-link arm, with exact parameter derivatives.

All runs are integrated together, as arrays. Derivatives are computed by the complex step, f(x +
ih) = f + ih f', through the whole integration with friction. The real part decides which joints
slip or stick. The integration is that of the plant: the Pade approximation (2, 2) of the
exponential for motors, springs and links, and the middle of the step for nonlinear torques. For
the complex step: Squire and Trapp 1998. The thirteen tuned parameters are a vector with names.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from armid_ros.estimate import ParameterName
from armid_ros.motion import ElasticRun, FloatArray
from armid_ros.robots.two_link import TwoLinkParameters
from armid_ros.simulation.controller import VelocityLoop
import numpy as np
import numpy.typing as npt

#: Quantities of each joint, in the order of the vector, with name and unit.
PER_JOINT = (
    ('motor_inertia', 'mm', 'kg m^2'),
    ('stiffness', 'kg', 'N m/rad'),
    ('link_damping', 'dl', 'N m s/rad'),
    ('motor_damping', 'dm', 'N m s/rad'),
    ('spring_damping', 'dg', 'N m s/rad'),
)
#: Number of tuned parameters: alpha, beta, gamma, and those of both joints.
SIZE = 3 + 2 * len(PER_JOINT)


def unpack(parameters: TwoLinkParameters) -> FloatArray:
    """Convert parameters to a vector, (13,): alpha, beta, gamma, then `PER_JOINT` in pairs."""
    joints = [getattr(parameters, field) for field, _, _ in PER_JOINT]
    return np.concatenate([[parameters.alpha, parameters.beta, parameters.gamma], *joints])


def pack(values: npt.ArrayLike, like: TwoLinkParameters) -> TwoLinkParameters:
    """Convert a vector of `unpack` to parameters, with the other parameters of `like`."""
    vector = np.asarray(values, dtype=float)
    pairs = vector[3:].reshape(len(PER_JOINT), 2)
    fields = {field: pair for (field, _, _), pair in zip(PER_JOINT, pairs, strict=True)}
    alpha, beta, gamma = vector[:3].tolist()
    return replace(like, alpha=alpha, beta=beta, gamma=gamma, **fields)


def parameter_names(joints: tuple[str, ...]) -> tuple[ParameterName, ...]:
    """Return names and units of the 13 elements of a vector of `unpack`."""
    rigid = [ParameterName(name, '', 'kg m^2') for name in ('alpha', 'beta', 'gamma')]
    own = [ParameterName(name, joint, unit) for _, name, unit in PER_JOINT for joint in joints]
    return (*rigid, *own)


#: Real values, or complex values whose imaginary part is an infinitesimal change.
DualArray = npt.NDArray[Any]
#: Imaginary step; its square is below the rounding error, so derivatives have no truncation error.
_COMPLEX_STEP = 1e-30


@dataclass(frozen=True, eq=False)
class Steps:
    """
    Initial poses, velocity references and controller of E step experiments of equal length.

    Attributes
    ----------
    q : ndarray, shape (E, 2)
        Initial positions of the links [rad].
    reference : ndarray, shape (N, E, 2)
        Reference velocities [rad/s].
    dt : float
        Time between samples, at which the loop acts [s].
    loop : VelocityLoop
        Gains of the velocity loop.
    integral : ndarray, shape (E, 2)
        Initial integral of the loop [rad].

    """

    q: FloatArray
    reference: FloatArray
    dt: float
    loop: VelocityLoop
    integral: FloatArray

    @classmethod
    def of(cls, runs: Sequence[ElasticRun], loop: VelocityLoop) -> Steps:
        """Convert recorded runs to step experiments with the length of the shortest run."""
        count = min(len(run.motor) for run in runs)
        t = runs[0].motor.t
        return cls(
            np.array([run.link.q[0] for run in runs]),
            np.stack([run.reference[:count] for run in runs], axis=1),
            float(t[-1] - t[0]) / (len(t) - 1),
            loop,
            np.array([np.zeros(2) if run.integral is None else run.integral for run in runs]),
        )


def velocities(steps: Steps, parameters: TwoLinkParameters) -> FloatArray:
    """Simulate E step experiments; return motor and link velocities, (N, E, 4) [rad/s]."""
    values = _point(parameters)[np.newaxis]
    return np.asarray(_simulate(steps, values, parameters.gear).real[:, :, 0])


def sensitivities(
    steps: Steps, parameters: TwoLinkParameters, directions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """
    Simulate velocities, and their derivatives along D directions in parameter space.

    Parameters
    ----------
    steps : Steps
        The experiments.
    parameters : TwoLinkParameters
        Parameters at which the derivatives are taken.
    directions : ndarray, shape (D, 15)
        Changes of the vector of ``unpack``, then of the motors' Coulomb torques;
        directions should have the magnitude of the parameters.

    Returns
    -------
    values : ndarray, shape (N, E, 4)
        Velocities of motors and links [rad/s].
    derivatives : ndarray, shape (N, E, 4, D)

    """
    values = _point(parameters) + 1j * _COMPLEX_STEP * directions
    found = _simulate(steps, values, parameters.gear)
    return found[:, :, 0].real, np.moveaxis(found.imag / _COMPLEX_STEP, 2, 3)


def _point(parameters: TwoLinkParameters) -> FloatArray:
    """Return a vector (15,): the 13 parameters of `unpack`, then two Coulomb torques."""
    return np.concatenate([unpack(parameters), parameters.coulomb])


def _simulate(steps: Steps, values: DualArray, gear: FloatArray) -> DualArray:
    """Simulate E experiments with each of D parameter vectors; return (N, E, D, 4) [rad/s]."""
    experiments, sets, substeps = len(steps.q), len(values), 2
    arm = _Arm(np.tile(values, (experiments, 1)), gear, steps.dt / substeps)
    size = experiments * sets
    dtype = values.dtype
    q2 = np.repeat(steps.q[:, 1], sets).astype(dtype)
    x = np.zeros((size, 6), dtype)
    dv = np.zeros((size, 4), dtype)
    modes = np.zeros((size, 2), int)
    integral = np.repeat(steps.integral, sets, axis=0).astype(dtype)
    references = np.repeat(steps.reference, sets, axis=1)
    out = np.empty((len(steps.reference), size, 4), np.complex128)
    for k, reference in enumerate(references):
        out[k] = x[:, 2:]
        error = reference - x[:, 2:4]
        integral = integral + steps.dt * error
        torque = steps.loop.proportional * error + steps.loop.integral * integral
        for _ in range(substeps):
            q2, x, dv, modes = arm.advance(q2, x, dv, modes, torque)
    return out.reshape(len(out), experiments, sets, 4)


class _Arm:
    """Equations of motion of the two-link arm for B parameter vectors, shape (B, 15)."""

    def __init__(self, values: DualArray, gear: FloatArray, dt: float):
        self.alpha, self.beta, self.gamma = values[:, 0], values[:, 1], values[:, 2]
        self.rotor = values[:, 3:5] * gear**2
        self.stiffness = values[:, 5:7]
        self.link_damping = values[:, 7:9]
        self.motor_damping = values[:, 9:11] * gear**2
        self.spring_damping = values[:, 11:13]
        self.coulomb = values[:, SIZE:] * gear
        self.dt = dt
        batch, dtype = len(values), values.dtype
        self.a = np.zeros((batch, 6, 6), dtype)
        joints = np.arange(2)
        self.a[:, joints, 2 + joints] = 1.0
        self.a[:, joints, 4 + joints] = -1.0
        self.a[:, 2 + joints, joints] = -self.stiffness / self.rotor
        self.a[:, 2 + joints, 2 + joints] = (
            -(self.motor_damping + self.spring_damping) / self.rotor
        )
        self.a[:, 2 + joints, 4 + joints] = self.spring_damping / self.rotor
        # Torques of springs, dampers and friction on the links.
        self.pull = np.zeros((batch, 2, 6), dtype)
        self.pull[:, joints, joints] = self.stiffness
        self.pull[:, joints, 2 + joints] = self.spring_damping
        self.pull[:, joints, 4 + joints] = -(self.link_damping + self.spring_damping)
        self.eye = np.eye(6)

    def advance(
        self,
        q2: DualArray,
        x: DualArray,
        dv: DualArray,
        modes: npt.NDArray[np.int_],
        torque: DualArray,
    ) -> tuple[DualArray, DualArray, DualArray, npt.NDArray[np.int_]]:
        """Integrate one time step; return angle of joint 2, state, accelerations, slip modes."""
        dt, a = self.dt, self.a
        middle = q2 + 0.5 * dt * (x[:, 5] + 0.25 * dt * dv[:, 3])
        v = x[:, 4:] + 0.5 * dt * dv[:, 2:]
        inverse, bias = self._links(middle, v)
        a[:, 4:] = inverse @ self.pull
        constant = np.zeros_like(x)
        constant[:, 2:4] = torque / self.rotor
        constant[:, 4:] = -np.einsum('bij,bj->bi', inverse, bias)
        z = dt * a
        even = self.eye + (z @ z) / 12.0
        right = np.zeros((*x.shape, 3), x.dtype)
        right[:, :, 0] = np.einsum('bij,bj->bi', even + 0.5 * z, x) + dt * constant
        right[:, 2, 1], right[:, 3, 2] = dt / self.rotor[:, 0], dt / self.rotor[:, 1]
        after = np.linalg.solve(even - 0.5 * z, right)
        response = after[:, :, 1:]
        rub, modes = _friction(response[:, 2:4], after[:, 2:4, 0], self.coulomb, modes)
        x_next = after[:, :, 0] - np.einsum('bij,bj->bi', response, rub)
        constant[:, 2:4] -= rub / self.rotor
        first = np.einsum('bij,bj->bi', a, x) + constant
        last = np.einsum('bij,bj->bi', a, x_next) + constant
        moved = 0.5 * dt * (x + x_next) + dt**2 / 12.0 * (first - last)
        held = modes == 0
        still = held & (x[:, 2:4] == 0.0)  # noqa: RUF069 - set below
        x_next[:, :2] = np.where(still, x[:, :2] - moved[:, 4:], x_next[:, :2])
        x_next[:, 2:4] = np.where(held, 0.0, x_next[:, 2:4])
        return q2 + moved[:, 5], x_next, last[:, 2:], modes

    def _links(self, q2: DualArray, v: DualArray) -> tuple[DualArray, DualArray]:
        """Return inverse inertia matrices, (B, 2, 2), and centrifugal torques, (B, 2)."""
        cosine, sine = self.gamma * np.cos(q2), self.gamma * np.sin(q2)
        coupling = self.beta + cosine
        first = self.alpha + self.beta + 2.0 * cosine
        determinant = first * self.beta - coupling**2
        inverse = np.empty((len(q2), 2, 2), q2.dtype)
        inverse[:, 0, 0], inverse[:, 1, 1] = self.beta, first
        inverse[:, 0, 1] = inverse[:, 1, 0] = -coupling
        inverse /= determinant[:, np.newaxis, np.newaxis]
        bias = np.empty_like(v)
        bias[:, 0] = -sine * (2.0 * v[:, 0] + v[:, 1]) * v[:, 1]
        bias[:, 1] = sine * v[:, 0] ** 2
        return inverse, bias


def _friction(
    response: DualArray, free: DualArray, level: DualArray, modes: npt.NDArray[np.int_]
) -> tuple[DualArray, npt.NDArray[np.int_]]:
    """Return friction torques (B, 2), and modes: a motor slips (1 or -1) or sticks (0)."""
    # response: change of the final velocity per torque; free: final velocity without friction;
    # modes: initial guess, 1 slips forwards, -1 slips backwards, 0 sticks
    modes = modes.copy()
    for _ in range(16):
        stuck = modes == 0
        system = np.where(stuck[:, :, np.newaxis], response, np.eye(2))
        right = np.where(stuck, free, level * modes)
        determinant = system[:, 0, 0] * system[:, 1, 1] - system[:, 0, 1] * system[:, 1, 0]
        torque = np.empty_like(free)
        torque[:, 0] = system[:, 1, 1] * right[:, 0] - system[:, 0, 1] * right[:, 1]
        torque[:, 1] = system[:, 0, 0] * right[:, 1] - system[:, 1, 0] * right[:, 0]
        torque /= determinant[:, np.newaxis]
        speed = (free - np.einsum('bij,bj->bi', response, torque)).real
        over = stuck & (np.abs(torque.real) > level.real * (1.0 + 1e-12))
        against = ~stuck & (speed * modes < -1e-13)
        if not np.any(over | against):
            break
        modes = np.where(over, np.sign(torque.real).astype(int), np.where(against, 0, modes))
    return torque, modes
