# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Steps 2 and 3a: frequency response and parameters of each joint, without the other joint.

The inertia of link 1 is alpha, that of link 2 is beta; all other terms of the link equations are
interaction torques ti. Then alpha v1' + dl1 v1 = tau_g1 - ti1 and beta v2' + dl2 v2 = tau_g2 -
ti2, which are two independent one-link systems with two inertias each.

Their physical parameters follow from the identified frequency responses. The initial value comes
from the antiresonance and the resonance of the motor's velocity and from its slope below them:
wa^2 = kg / J, wr^2 = kg (1 / J + 1 / Jm), v_m / tau -> 1 / ((Jm + J) s). Least squares on the
logarithms of the responses to both inputs follow. The interaction torque has a free gain, so an
error of its scale does not bias the joint's parameters.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.motion import ElasticRun, FloatArray, Motion
from armid_ros.papers.elastic.identification.subspace import Hold, Signals, StateSpace
from armid_ros.robots.two_link import TwoLinkParameters
import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from scipy.signal import csd

#: Number of states of motor, spring and link that the velocities determine.
ORDER = 3
#: Drives hold their torque between samples; links move smoothly.
HOLD: tuple[Hold, Hold] = ('zero', 'first')


def link_columns(q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
    """
    Return the derivative of link torques by the inertias alpha, beta, gamma, (N, 2, 3).

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
    Return the torque on each link due to the motion of the other link, shape (N, 2) [N m].

    Only beta and gamma of the parameters are used. The motion needs measured accelerations.

    """
    others = np.array([0.0, parameters.beta, parameters.gamma])
    felt = link_columns(link.q, link.dq, link.ddq) @ others
    felt[:, 1] -= parameters.beta * link.ddq[:, 1]
    return np.asarray(felt)


def direction(velocity: FloatArray) -> FloatArray:
    """
    Return the mean sign of velocity between neighbouring samples, (N, n), for dry friction.

    Velocities are interpolated linearly; the last row is the sign of the last sample.

    """
    size = np.abs(velocity)
    mean = (velocity[:-1] + velocity[1:]) / np.maximum(size[:-1] + size[1:], 1e-300)
    return np.vstack([mean, np.sign(velocity[-1:])])


def joint_signals(
    runs: Sequence[ElasticRun], parameters: TwoLinkParameters, joint: int, *, decoupled: bool
) -> list[Signals]:
    """
    Return inputs (torques) and outputs (velocities) of a joint for each experiment.

    Inputs are the torque of the motor less Coulomb friction, and the interaction torque. Outputs
    are the velocities of motor and link. All are at the joint.

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


def measured_response(
    experiments: Sequence[Signals], dt: float, *, window: float = 1.0
) -> tuple[FloatArray, npt.NDArray[np.complex128]]:
    """
    Estimate the frequency response of outputs to inputs by averaged spectra (H1 estimator).

    The estimate needs neither model nor order. The first input is held between samples; its
    response is the response to the continuous held signal.

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


def decibel_error(found: npt.NDArray[np.complex128], wanted: npt.NDArray[np.complex128]) -> float:
    """Return the rms ratio [dB] of the magnitudes of two frequency responses."""
    difference = 20.0 * np.log10(np.abs(found) / np.abs(wanted))
    return float(np.sqrt(np.mean(difference**2)))


ComplexArray = npt.NDArray[np.complex128]
#: Frequency range of the comparison of responses [Hz], and number of logarithmic points.
BAND = (1.0, 60.0)


def ideal_response(
    parameters: TwoLinkParameters, joint: int, frequency: npt.ArrayLike
) -> ComplexArray:
    """
    Return the frequency response of the model of a joint: motor, spring and link.

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
    own = (
        parameters.rotor,
        parameters.inertia,
        parameters.stiffness,
        parameters.spring_damping,
        parameters.joint_motor_damping,
        parameters.link_damping,
    )
    values = np.array([*(quantity[joint] for quantity in own), 1.0])
    return _response(np.asarray(2j * np.pi * np.asarray(frequency, dtype=float)), values)


def fit_joints(
    systems: Sequence[StateSpace], joints: Sequence[str], known: TwoLinkParameters
) -> tuple[TwoLinkParameters, FloatArray]:
    """
    Fit inertias, stiffness and damping of both joints to their frequency responses.

    Parameters
    ----------
    systems : sequence of StateSpace
        Both joints, identified from the inputs and outputs of ``joint_signals``, decoupled.
    joints : sequence of str
        Their names.
    known : TwoLinkParameters
        Gears, gamma and Coulomb friction, which are not changed.

    Returns
    -------
    fitted : TwoLinkParameters
        The arm.
    gain : ndarray, shape (2,)
        Gain of the interaction torques; 1 if beta and gamma are right.

    Raises
    ------
    IdentificationError
        If a response has no antiresonance and resonance in the band.

    """
    frequency = np.geomspace(*BAND, 120)
    s = np.asarray(2j * np.pi * frequency, dtype=np.complex128)
    values = []
    for joint, system in zip(joints, systems, strict=True):
        found = system.response(frequency)

        def residual(logarithms: FloatArray, found: ComplexArray = found) -> FloatArray:
            ratio = (_response(s, np.exp(logarithms)) / found - 1.0).ravel()
            return np.concatenate([ratio.real, ratio.imag])

        start = np.log(_first_guess(joint, frequency, found))
        values.append(np.exp(least_squares(residual, start, x_scale='jac').x))
    rotor, inertia, stiffness, between, motor, link, gain = np.array(values).T
    fitted = replace(
        known,
        alpha=float(inertia[0]),
        beta=float(inertia[1]),
        motor_inertia=rotor / known.gear**2,
        stiffness=stiffness,
        link_damping=link,
        motor_damping=motor / known.gear**2,
        spring_damping=between,
    )
    return fitted, gain


def frequencies(parameters: TwoLinkParameters) -> tuple[FloatArray, FloatArray]:
    """Return the undamped antiresonances and resonances of the joints, each (2,) [Hz]."""
    by_link, by_motor = (parameters.stiffness / x for x in (parameters.inertia, parameters.rotor))
    return np.sqrt(by_link) / (2.0 * np.pi), np.sqrt(by_link + by_motor) / (2.0 * np.pi)


def _response(s: ComplexArray, values: FloatArray) -> ComplexArray:
    """Return the response (K, 2, 2) of a joint at Laplace variables s, (K,) [rad/s]."""
    rotor, inertia, stiffness, between, motor, link, gain = values
    spring = stiffness / s + between
    a, b = rotor * s + motor + spring, inertia * s + link + spring
    inverse = np.array([[b, spring], [spring, a]]) / (a * b - spring**2)
    inverse = np.moveaxis(inverse, 2, 0)
    return np.asarray(inverse * np.array([1.0, -gain]))


def _first_guess(joint: str, frequency: FloatArray, found: ComplexArray) -> FloatArray:
    """Return initial values of the 7 joint parameters, from antiresonance and resonance."""
    size = np.abs(found[:, 0, 0])
    lowest = int(np.argmin(size[frequency > 4.0 * frequency[0]]))
    lowest += int(np.count_nonzero(frequency <= 4.0 * frequency[0]))
    highest = lowest + int(np.argmax(size[lowest:]))
    if highest in (lowest, len(size) - 1):
        raise IdentificationError(
            f"joint '{joint}': no antiresonance followed by a resonance between "
            f'{frequency[0]:g} and {frequency[-1]:g} Hz; excite the joint at these frequencies'
        )
    anti, resonance = 2.0 * np.pi * frequency[[lowest, highest]]
    total = float(1.0 / (2.0 * np.pi * frequency[0] * size[0]))
    inertia = total * (1.0 - (anti / resonance) ** 2)
    rotor = total - inertia
    stiffness = anti**2 * inertia
    damping = 0.02 * np.sqrt(stiffness * inertia)
    weak = 0.1 * total
    return np.array([rotor, inertia, stiffness, damping, weak, weak, 1.0])
