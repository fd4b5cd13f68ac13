# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Step 2: each joint on its own, with what the other link does to it as a second input.

Keep alpha for link 1 and beta for link 2 and call the rest of the link equations interaction
torques ti; then alpha v1' + dl1 v1 = tau_g1 - ti1 and beta v2' + dl2 v2 = tau_g2 - ti2, which are
two independent one-link systems with two inertias each.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.motion import ElasticRun, FloatArray, Motion
from armid_ros.papers.elastic.identification.subspace import (
    Hold,
    identify_subspace,
    Signals,
    StateSpace,
)
from armid_ros.robots.two_link import TwoLinkParameters
import numpy as np
import numpy.typing as npt

#: States of a motor and a link on a spring, seen by their velocities.
ORDER = 3
_HOLD: tuple[Hold, Hold] = ('zero', 'first')  # drives hold their torque, links move smoothly


def interaction_torques(link: Motion, parameters: TwoLinkParameters) -> FloatArray:
    """
    Return what each link feels of the motion of the other one, shape (N, 2) [N m].

    Only beta and gamma of the parameters count. The acceleration has to be measured.

    """
    cosine = parameters.gamma * np.cos(link.q[:, 1])
    sine = parameters.gamma * np.sin(link.q[:, 1])
    (v1, v2), (a1, a2) = link.dq.T, link.ddq.T
    coupling = parameters.beta + cosine
    first = (parameters.beta + 2.0 * cosine) * a1 + coupling * a2
    first -= sine * (2.0 * v1 * v2 + v2**2)
    return np.column_stack([first, coupling * a1 + sine * v1**2])


def direction(velocity: FloatArray) -> FloatArray:
    """
    Return the mean sign of velocities between samples, shape (N, n), as straight lines have it.

    The last row, after which nothing is known, is the sign itself.

    """
    size = np.abs(velocity)
    mean = (velocity[:-1] + velocity[1:]) / np.maximum(size[:-1] + size[1:], 1e-300)
    return np.vstack([mean, np.sign(velocity[-1:])])


@dataclass(frozen=True, eq=False)
class DecoupledJoint:
    """
    One joint as a system of its own.

    Attributes
    ----------
    joint : str
        Its name.
    system : StateSpace
        From the motor's torque less Coulomb friction, and from the interaction torque where it
        was an input, to the velocities of motor and link, all at the joint.

    """

    joint: str
    system: StateSpace


def joint_signals(
    runs: Sequence[ElasticRun], parameters: TwoLinkParameters, joint: int, *, decoupled: bool
) -> list[Signals]:
    """
    Return inputs and outputs of one joint in all experiments.

    Parameters
    ----------
    runs : sequence of ElasticRun
        Measured experiments.
    parameters : TwoLinkParameters
        Coulomb friction, and beta and gamma for the interaction torques.
    joint : int
        0 or 1.
    decoupled : bool
        Whether the interaction torque is an input.

    """
    level = parameters.joint_coulomb[joint]
    signals = []
    for run in runs:
        assert run.motor.tau is not None
        drive = run.motor.tau[:, joint] - level * direction(run.motor.dq)[:, joint]
        inputs = [drive]
        if decoupled:
            inputs.append(interaction_torques(run.link, parameters)[:, joint])
        outputs = np.column_stack([run.motor.dq[:, joint], run.link.dq[:, joint]])
        signals.append(Signals(np.column_stack(inputs), outputs))
    return signals


def decouple(
    runs: Sequence[ElasticRun],
    parameters: TwoLinkParameters,
    *,
    decoupled: bool = True,
    horizon: int = 24,
) -> tuple[DecoupledJoint, DecoupledJoint]:
    """
    Identify both joints by subspaces, each with or without its interaction torque as an input.

    Raises
    ------
    IdentificationError
        If the data cannot tell; see ``identify_subspace``.

    """
    t = runs[0].motor.t
    dt = float(t[-1] - t[0]) / (len(t) - 1)
    hold = _HOLD if decoupled else _HOLD[:1]
    first, second = (
        DecoupledJoint(
            name,
            identify_subspace(
                joint_signals(runs, parameters, joint, decoupled=decoupled),
                dt,
                ORDER,
                hold,
                horizon=horizon,
            ),
        )
        for joint, name in enumerate(runs[0].motor.joints)
    )
    return first, second


def ideal_response(
    parameters: TwoLinkParameters, joint: int, frequency: npt.ArrayLike
) -> npt.NDArray[np.complex128]:
    """
    Return the frequency response of one link and its motor on a spring.

    Parameters
    ----------
    parameters : TwoLinkParameters
        The arm.
    joint : int
        0 for inertia alpha, 1 for beta.
    frequency : array_like, shape (K,)
        [Hz].

    Returns
    -------
    ndarray of complex, shape (K, 2, 2)
        From (motor torque, interaction torque) [N m] to velocities of (motor, link) [rad/s], all
        at the joint.

    """
    s = 2j * np.pi * np.asarray(frequency, dtype=float)
    joint_of = slice(joint, joint + 1)
    spring = parameters.stiffness[joint_of] / s + parameters.spring_damping[joint_of]
    motor = parameters.rotor[joint] * s + parameters.joint_motor_damping[joint] + spring
    link = parameters.inertia[joint] * s + parameters.link_damping[joint] + spring
    determinant = motor * link - spring**2
    table = np.array([[link, -spring], [spring, -motor]]) / determinant
    return np.asarray(np.moveaxis(table, 2, 0))


def coupled_response(
    parameters: TwoLinkParameters, angles: npt.ArrayLike, frequency: npt.ArrayLike
) -> npt.NDArray[np.complex128]:
    """
    Return the frequency response of both joints together, each from its own motor alone.

    Parameters
    ----------
    parameters : TwoLinkParameters
        The arm.
    angles : array_like, shape (S,)
        Poses of joint 2 to take the mean over [rad]; the arm is at rest in each, and the other
        motor is free.
    frequency : array_like, shape (K,)
        [Hz].

    Returns
    -------
    ndarray of complex, shape (K, 2)
        From motor torque to motor velocity of each joint [rad/s / (N m)].

    """
    s = 2j * np.pi * np.asarray(frequency, dtype=float)[:, np.newaxis, np.newaxis]
    spring = np.diag(parameters.stiffness) / s + np.diag(parameters.spring_damping)
    motor = np.diag(parameters.rotor) * s + np.diag(parameters.joint_motor_damping) + spring
    mean = np.zeros((len(s), 2), complex)
    for angle in (poses := np.asarray(angles, dtype=float)):
        link = parameters.mass_matrix(angle) * s + np.diag(parameters.link_damping) + spring
        inverse = np.linalg.inv(motor - spring @ np.linalg.solve(link, spring))
        mean += np.diagonal(inverse, axis1=1, axis2=2) / len(poses)
    return mean


def decibel_error(found: npt.NDArray[np.complex128], wanted: npt.NDArray[np.complex128]) -> float:
    """Return the root mean square difference of two frequency responses in size [dB]."""
    difference = 20.0 * np.log10(np.abs(found) / np.abs(wanted))
    return float(np.sqrt(np.mean(difference**2)))
