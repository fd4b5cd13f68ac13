# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Step 3a: physical parameters of a decoupled joint from its identified frequency response.

A first guess comes from the antiresonance and the resonance of the motor's velocity and from its
slope below them: wa^2 = kg / J, wr^2 = kg (1 / J + 1 / Jm), v_m / tau -> 1 / ((Jm + J) s). Least
squares on the logarithms of the responses to both inputs follow. The interaction torque has a free
gain: a common error of its scale is no error of the joint.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.errors import IdentificationError
from armid_ros.motion import FloatArray
from armid_ros.papers.elastic.identification.interaction import DecoupledJoint
from armid_ros.robots.two_link import TwoLinkParameters
import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

ComplexArray = npt.NDArray[np.complex128]
#: Where the responses are compared [Hz], and by how many frequencies, equally apart in logarithm.
BAND = (1.0, 60.0)
_POINTS = 120


@dataclass(frozen=True, eq=False)
class DecoupledFit:
    """
    Physical parameters of a decoupled joint, all at the joint.

    Attributes
    ----------
    rotor, inertia : float
        Motor and link [kg m^2].
    stiffness : float
        [N m/rad].
    spring_damping, motor_damping, link_damping : float
        [N m s/rad].
    interaction_gain : float
        Of the interaction torque; 1 when beta and gamma were right.
    antiresonance, resonance : float
        Of the motor's velocity, undamped [Hz].

    """

    rotor: float
    inertia: float
    stiffness: float
    spring_damping: float
    motor_damping: float
    link_damping: float
    interaction_gain: float
    antiresonance: float
    resonance: float


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
    return response(np.asarray(2j * np.pi * np.asarray(frequency, dtype=float)), values)


def fit_joint(joint: DecoupledJoint) -> DecoupledFit:
    """
    Fit a motor and a link on a spring to an identified response.

    Raises
    ------
    IdentificationError
        If the response has no antiresonance and resonance in the band.

    """
    frequency = np.geomspace(*BAND, _POINTS)
    found = joint.system.response(frequency)
    s = np.asarray(2j * np.pi * frequency, dtype=np.complex128)
    start = np.log(_first_guess(joint, frequency, found))

    def residual(logarithms: FloatArray) -> FloatArray:
        ratio = (response(s, np.exp(logarithms)) / found - 1.0).ravel()
        return np.concatenate([ratio.real, ratio.imag])

    fit = least_squares(residual, start, x_scale='jac')
    rotor, inertia, stiffness, between, motor, link, gain = np.exp(fit.x).tolist()
    return DecoupledFit(
        rotor,
        inertia,
        stiffness,
        between,
        motor,
        link,
        gain,
        float(np.sqrt(stiffness / inertia) / (2.0 * np.pi)),
        float(np.sqrt(stiffness * (1.0 / inertia + 1.0 / rotor)) / (2.0 * np.pi)),
    )


def response(s: ComplexArray, values: FloatArray) -> ComplexArray:
    """
    Return the response of motor and link on a spring.

    Parameters
    ----------
    s : ndarray of complex, shape (K,)
        i times angular frequency [rad/s].
    values : ndarray, shape (7,)
        Rotor, link, stiffness, damping of spring, motor and link, gain of the interaction torque.

    Returns
    -------
    ndarray of complex, shape (K, 2, 2)

    """
    rotor, inertia, stiffness, between, motor, link, gain = values
    spring = stiffness / s + between
    a, b = rotor * s + motor + spring, inertia * s + link + spring
    inverse = np.array([[b, spring], [spring, a]]) / (a * b - spring**2)
    inverse = np.moveaxis(inverse, 2, 0)
    return np.asarray(inverse * np.array([1.0, -gain]))


def _first_guess(joint: DecoupledJoint, frequency: FloatArray, found: ComplexArray) -> FloatArray:
    size = np.abs(found[:, 0, 0])
    lowest = int(np.argmin(size[frequency > 4.0 * frequency[0]]))
    lowest += int(np.count_nonzero(frequency <= 4.0 * frequency[0]))
    highest = lowest + int(np.argmax(size[lowest:]))
    if highest in (lowest, len(size) - 1):
        raise IdentificationError(
            f"joint '{joint.joint}': no antiresonance with a resonance above it between "
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
