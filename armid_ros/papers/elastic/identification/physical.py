# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Step 3a: physical parameters of a decoupled joint from its identified frequency response.

The initial value comes from the antiresonance and the resonance of the motor's velocity and from
its slope below them: wa^2 = kg / J, wr^2 = kg (1 / J + 1 / Jm), v_m / tau -> 1 / ((Jm + J) s).
Least squares on the logarithms of the responses to both inputs follow. The interaction torque has
a free gain, so that an error of its scale does not bias the parameters of the joint.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.motion import FloatArray
from armid_ros.papers.elastic.identification.subspace import StateSpace
from armid_ros.robots.two_link import TwoLinkParameters
import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

ComplexArray = npt.NDArray[np.complex128]
#: Frequency range of the comparison of responses [Hz], and number of logarithmic points.
BAND = (1.0, 60.0)


def ideal_response(
    parameters: TwoLinkParameters, joint: int, frequency: npt.ArrayLike
) -> ComplexArray:
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
    Fit a motor and a link on a spring to the identified responses of both joints.

    Parameters
    ----------
    systems : sequence of StateSpace
        Both joints, as of ``decouple``.
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
    """Return antiresonance and resonance of each motor's velocity, undamped, shape (2,) [Hz]."""
    by_link, by_motor = (parameters.stiffness / x for x in (parameters.inertia, parameters.rotor))
    return np.sqrt(by_link) / (2.0 * np.pi), np.sqrt(by_link + by_motor) / (2.0 * np.pi)


def _response(s: ComplexArray, values: FloatArray) -> ComplexArray:
    """Return the response of motor and link on a spring at s = i w, shape (K, 2, 2)."""
    rotor, inertia, stiffness, between, motor, link, gain = values
    spring = stiffness / s + between
    a, b = rotor * s + motor + spring, inertia * s + link + spring
    inverse = np.array([[b, spring], [spring, a]]) / (a * b - spring**2)
    inverse = np.moveaxis(inverse, 2, 0)
    return np.asarray(inverse * np.array([1.0, -gain]))


def _first_guess(joint: str, frequency: FloatArray, found: ComplexArray) -> FloatArray:
    size = np.abs(found[:, 0, 0])
    lowest = int(np.argmin(size[frequency > 4.0 * frequency[0]]))
    lowest += int(np.count_nonzero(frequency <= 4.0 * frequency[0]))
    highest = lowest + int(np.argmax(size[lowest:]))
    if highest in (lowest, len(size) - 1):
        raise IdentificationError(
            f"joint '{joint}': no antiresonance with a resonance above it between "
            f'{frequency[0]:g} and {frequency[-1]:g} Hz; excite it there, or widen the band'
        )
    anti, resonance = 2.0 * np.pi * frequency[[lowest, highest]]
    total = float(1.0 / (2.0 * np.pi * frequency[0] * size[0]))
    inertia = total * (1.0 - (anti / resonance) ** 2)
    rotor = total - inertia
    stiffness = anti**2 * inertia
    damping = 0.02 * np.sqrt(stiffness * inertia)
    weak = 0.1 * total
    return np.array([rotor, inertia, stiffness, damping, weak, weak, 1.0])
