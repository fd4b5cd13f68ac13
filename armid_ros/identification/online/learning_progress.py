# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that a motion does not identify, and the additional motion that they need."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence

from armid_ros.arm import ArmModel
from armid_ros.estimate import Estimate, name_in_words, ParameterName
from armid_ros.model import BaseParameters, inverse_dynamics, random_motion
from armid_ros.motion import FloatArray
import numpy as np

#: Unit of a kind of rigid parameter, its name, and the motion that identifies it.
_OF_BODY = {
    'kg m^2': ('inertia', 'accelerate it harder'),
    'kg m': ('balance', 'move it through more of its range'),
    'kg': ('mass', 'move it through more of its range'),
}


class LearningProgress:
    """
    Detector of parameters whose estimates the motion does not improve.

    Parameters
    ----------
    arm : ArmModel
        The arm to identify.
    base : BaseParameters
        Base parameters of the arm.
    rng : numpy.random.Generator
        Generator of random states.

    """

    def __init__(self, arm: ArmModel, base: BaseParameters, rng: np.random.Generator) -> None:
        motion = random_motion(arm.robot, rng, 100)  # states
        columns = arm.columns(motion)[:, :, base.independent]
        self._rigid = np.sqrt(np.mean(inverse_dynamics(arm.robot, motion) ** 2, axis=0))
        self._size = np.sqrt(np.mean(columns**2, axis=0))
        self._of_effects = np.asarray(base.independent) >= len(arm.robot.rigid_parameters)
        self._past: deque[tuple[float, FloatArray]] = deque()

    def reset(self) -> None:
        """Clear all earlier estimates."""
        self._past.clear()

    def unidentified(self, t: float, estimate: Estimate) -> Mapping[str, list[ParameterName]]:
        """
        Return parameters whose standard deviations have hardly fallen in ten seconds, by joint.

        The joint is empty for parameters of the entire arm. The most uncertain parameters are
        first.

        Parameters
        ----------
        t : float
            Time of the last sample in the estimate [s].
        estimate : Estimate
            Estimate of the base parameters.

        """
        # time in which a standard deviation has to fall [s]
        wait = 10.0
        if self._past and t < self._past[-1][0]:
            self._past.clear()
        self._past.append((t, estimate.std))
        while len(self._past) > 1 and self._past[1][0] <= t - wait:
            self._past.popleft()
        if self._past[0][0] > t - wait:
            return {}
        # the usual torque of a joint is that of the described links and of the effects (mainly
        # friction) whose estimates exceed two standard deviations
        known = np.maximum(np.abs(estimate.values) - 2.0 * estimate.std, 0.0)
        effects = self._size * np.where(self._of_effects, known, 0.0)
        usual = np.sqrt(self._rigid**2 + np.sum(effects**2, axis=1))
        share = self._size / np.maximum(usual, 1e-3 * usual.max())[:, np.newaxis]
        unknown = share.max(axis=0) * estimate.std
        # A parameter is identified if it makes the torque uncertain by less than a tenth of the
        # usual torque. It makes progress if its standard deviation falls to 0.9 of its value.
        # Above 100 times the usual torque, the deviation depends on noise alone and has to fall
        # to 0.5.
        progress = np.where(unknown > 100.0, 0.5, 0.9)
        stuck = (unknown > 0.1) & (estimate.std > progress * self._past[0][1])
        by_joint: dict[str, list[ParameterName]] = {}
        for k in sorted(np.flatnonzero(stuck).tolist(), key=lambda k: -float(unknown[k])):
            name = estimate.parameters[k]
            by_joint.setdefault(name.joint, []).append(name)
        return by_joint


def too_little_motion(unidentified: Mapping[str, Sequence[ParameterName]]) -> str:
    """Return a message on parameters that the motion does not identify; empty if none."""
    # largest number of joints in the message
    most = 3
    friction = {'viscous_coefficient': 'viscous friction', 'coulomb_torque': 'Coulomb friction'}
    texts = []
    for joint, parameters in list(unidentified.items())[:most]:
        found = []
        for one in parameters:
            rigid = _OF_BODY.get(one.unit) if one.name[:1] in 'Im' else None
            word = friction.get(one.name, name_in_words(one.name))
            found.append(rigid or (word, 'move it both ways at several speeds'))
        words, advice = (list(dict.fromkeys(part)) for part in zip(*found, strict=True))
        texts.append(f'{joint or "the arm"} ({", ".join(words)}): {" and ".join(advice)}')
    if not texts:
        return ''
    rest = len(unidentified) - most
    more = f'; and {rest} more joint{"s" if rest > 1 else ""}' if rest > 0 else ''
    return f'too little motion to learn from: {"; ".join(texts)}{more}'
