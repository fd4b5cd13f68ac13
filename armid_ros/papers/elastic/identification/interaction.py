# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Step 2: each joint separately, with the interaction torque of the other link as input.

Keep alpha for link 1 and beta for link 2 and call the rest of the link equations interaction
torques ti; then alpha v1' + dl1 v1 = tau_g1 - ti1 and beta v2' + dl2 v2 = tau_g2 - ti2, which are
two independent one-link systems with two inertias each.

"""

from __future__ import annotations

from collections.abc import Sequence

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
from scipy.signal import csd

#: States of a motor and a link on a spring, seen by their velocities.
ORDER = 3
_HOLD: tuple[Hold, Hold] = ('zero', 'first')  # drives hold their torque, links move smoothly


def link_columns(q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
    """
    Return the derivatives of the link torques with respect to alpha, beta and gamma.

    Parameters
    ----------
    q, dq, ddq : ndarray, shape (N, 2)
        Motion of the links.

    Returns
    -------
    ndarray, shape (N, 2, 3)

    """
    cosine, sine = np.cos(q[:, 1]), np.sin(q[:, 1])
    (v1, v2), (a1, a2) = dq.T, ddq.T
    table = np.zeros((len(q), 2, 3))
    table[:, 0, 0] = a1
    table[:, :, 1] = (a1 + a2)[:, np.newaxis]
    table[:, 0, 2] = cosine * (2.0 * a1 + a2) - sine * (2.0 * v1 * v2 + v2**2)
    table[:, 1, 2] = cosine * a1 + sine * v1**2
    return table


def interaction_torques(link: Motion, parameters: TwoLinkParameters) -> FloatArray:
    """
    Return the torque on each link by the motion of the other link, shape (N, 2) [N m].

    Only beta and gamma of the parameters are used. The motion needs measured accelerations.

    """
    others = np.array([0.0, parameters.beta, parameters.gamma])
    felt = link_columns(link.q, link.dq, link.ddq) @ others
    felt[:, 1] -= parameters.beta * link.ddq[:, 1]
    return np.asarray(felt)


def direction(velocity: FloatArray) -> FloatArray:
    """
    Return the mean sign of linearly interpolated velocities between samples, shape (N, n).

    The last row is the sign of the last sample.

    """
    size = np.abs(velocity)
    mean = (velocity[:-1] + velocity[1:]) / np.maximum(size[:-1] + size[1:], 1e-300)
    return np.vstack([mean, np.sign(velocity[-1:])])


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
    runs: Sequence[ElasticRun], parameters: TwoLinkParameters
) -> tuple[StateSpace, StateSpace]:
    """
    Identify both joints by subspaces, each with its interaction torque as an input.

    Returns
    -------
    tuple of StateSpace
        Of each joint, from the motor's torque less Coulomb friction, and from the interaction
        torque, to the velocities of motor and link, all at the joint.

    Raises
    ------
    IdentificationError
        If the data do not determine a system; see ``identify_subspace``.

    """
    t = runs[0].motor.t
    dt = float(t[-1] - t[0]) / (len(t) - 1)
    first, second = (joint_signals(runs, parameters, joint, decoupled=True) for joint in range(2))
    return (
        identify_subspace(first, dt, ORDER, _HOLD),
        identify_subspace(second, dt, ORDER, _HOLD),
    )


def measured_response(
    experiments: Sequence[Signals], dt: float, *, window: float = 1.0
) -> tuple[FloatArray, npt.NDArray[np.complex128]]:
    """
    Estimate the frequency response from all inputs to all outputs by averaged spectra (H1).

    The estimate needs no model and no order. The first input is held between samples; its response
    is that to the continuous, held signal.

    Parameters
    ----------
    experiments : sequence of Signals
        With m inputs and p outputs.
    dt : float
        Time between samples [s].
    window : float
        Length of the averaged stretches [s], half overlapping, under a Hann window; no longer than
        the experiments.

    Returns
    -------
    frequency : ndarray, shape (K,)
        [Hz], zero left out.
    response : ndarray of complex, shape (K, p, m)

    """
    size = round(window / dt)
    cross: list[npt.NDArray[np.complex128]] = []
    power: list[npt.NDArray[np.complex128]] = []
    for e in experiments:
        stretches = 1 + (len(e.u) - size) // (size // 2)
        for found, of in ((cross, e.y), (power, e.u)):
            _, mean = csd(
                e.u[:, np.newaxis],
                of[:, :, np.newaxis],
                nperseg=size,
                noverlap=size - size // 2,
                axis=0,
            )
            found.append(stretches * mean[1:])
    frequency = np.fft.rfftfreq(size, dt)[1:]
    inverse = np.linalg.pinv(np.sum(power, axis=0), rcond=1e-12, hermitian=True)
    response = np.asarray(np.sum(cross, axis=0) @ inverse)
    s = 2j * np.pi * frequency * dt
    response[:, :, 0] /= ((1.0 - np.exp(-s)) / s)[:, np.newaxis]
    return np.asarray(frequency, dtype=np.float64), response


def coupled_response(
    parameters: TwoLinkParameters, angles: npt.ArrayLike, frequency: npt.ArrayLike
) -> npt.NDArray[np.complex128]:
    """
    Return the response of each motor velocity to its own motor torque, joints coupled.

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
    """Return the root mean square difference of the magnitudes of two responses [dB]."""
    difference = 20.0 * np.log10(np.abs(found) / np.abs(wanted))
    return float(np.sqrt(np.mean(difference**2)))
