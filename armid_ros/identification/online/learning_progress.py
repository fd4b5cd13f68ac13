# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a motion does not teach: parameters that stay unknown, and how to move to learn them."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.estimate import Estimate, name_in_words, ParameterName
from armid_ros.model import BaseParameters, inverse_dynamics, random_motion
from armid_ros.motion import FloatArray
import numpy as np

#: States of the work space over which torques are predicted.
_STATES = 100
#: A parameter is known when it leaves the torque less uncertain than this share of the usual.
_KNOWN = 0.1
#: Time over which something has to be learned [s], and by how much deviations have to fall.
_WAIT = 10.0
_LEARNED = 0.9
#: Where nothing has been learned, and so many times the usual torque is uncertain, deviations are
#: as the noise is, and have to fall by more.
_NOTHING = 100.0
_BEGUN = 0.5
#: Standard deviations by which a torque is larger than nothing to be sure.
_CERTAIN = 2.0
#: Joints that are named at most.
_NAMED = 3
_WORDS = {'kg m^2': 'inertia', 'kg m': 'balance', 'kg': 'mass'}
#: How to move to show it.
_ADVICE = {
    'inertia': 'accelerate it harder',
    'balance': 'move it through more of its range',
    'mass': 'move it through more of its range',
}
_OTHER_ADVICE = 'move it both ways at several speeds'


@dataclass(frozen=True)
class Unlearned:
    """
    Quantities of a joint that the motion does not identify.

    Attributes
    ----------
    joint : str
        The joint; empty for the whole arm.
    parameters : tuple of ParameterName
        What is unknown, the least known first.
    uncertainty : float
        How uncertain the worst one leaves a torque, as a share of what that joint usually takes.

    """

    joint: str
    parameters: tuple[ParameterName, ...]
    uncertainty: float

    def __str__(self) -> str:
        """Describe what is unknown, and the motion that identifies it."""
        words = list(dict.fromkeys(_word(p) for p in self.parameters))
        advice = list(dict.fromkeys(_ADVICE.get(word, _OTHER_ADVICE) for word in words))
        return f'{self.joint or "the arm"} ({", ".join(words)}): {" and ".join(advice)}'


class LearningProgress:
    """
    Compares estimates over time to find what the motion does not identify.

    Parameters
    ----------
    arm : ArmModel
        What is identified.
    base : BaseParameters
        Its base parameters.
    rng : numpy.random.Generator
        Draws states of the work space.

    """

    def __init__(self, arm: ArmModel, base: BaseParameters, rng: np.random.Generator) -> None:
        motion = random_motion(arm.robot, rng, _STATES)
        columns = arm.columns(motion)[:, :, base.independent]
        self._rigid = np.sqrt(np.mean(inverse_dynamics(arm.robot, motion) ** 2, axis=0))
        self._size = np.sqrt(np.mean(columns**2, axis=0))
        self._of_effects = np.asarray(base.independent) >= len(arm.robot.rigid_parameters)
        self._past: deque[tuple[float, FloatArray]] = deque()

    def reset(self) -> None:
        """Clear all estimates."""
        self._past.clear()

    def look(self, t: float, estimate: Estimate) -> tuple[Unlearned, ...]:
        """
        Return the unidentified quantities without progress for ten seconds, per joint.

        Parameters
        ----------
        t : float
            Time of the last sample in the estimate [s].
        estimate : Estimate
            Of the base parameters.

        """
        if self._past and t < self._past[-1][0]:
            self._past.clear()
        self._past.append((t, estimate.std))
        while len(self._past) > 1 and self._past[1][0] <= t - _WAIT:
            self._past.popleft()
        if self._past[0][0] > t - _WAIT:
            return ()
        # the torque that a joint usually takes is what moves the links of the description and what
        # effects, friction above all, take: by how much they are larger than they are uncertain
        known = np.maximum(np.abs(estimate.values) - _CERTAIN * estimate.std, 0.0)
        effects = self._size * np.where(self._of_effects, known, 0.0)
        usual = np.sqrt(self._rigid**2 + np.sum(effects**2, axis=1))
        share = self._size / np.maximum(usual, 1e-3 * usual.max())[:, np.newaxis]
        unknown = share.max(axis=0) * estimate.std
        learned = np.where(unknown > _NOTHING, _BEGUN, _LEARNED)
        stuck = (unknown > _KNOWN) & (estimate.std > learned * self._past[0][1])
        by_joint: dict[str, list[int]] = {}
        for k in sorted(np.flatnonzero(stuck).tolist(), key=lambda k: -float(unknown[k])):
            by_joint.setdefault(estimate.parameters[k].joint, []).append(k)
        return tuple(
            Unlearned(joint, tuple(estimate.parameters[k] for k in some), float(unknown[some[0]]))
            for joint, some in by_joint.items()
        )


def too_little_motion(unlearned: Sequence[Unlearned]) -> str:
    """Return a line on what the motion does not identify; empty if nothing."""
    if not unlearned:
        return ''
    rest = len(unlearned) - _NAMED
    more = f'; and {rest} more joint{"s" if rest > 1 else ""}' if rest > 0 else ''
    return f'too little motion to learn from: {"; ".join(map(str, unlearned[:_NAMED]))}{more}'


def _word(parameter: ParameterName) -> str:
    words = {'viscous_coefficient': 'viscous friction', 'coulomb_torque': 'Coulomb friction'}
    rigid = _WORDS.get(parameter.unit) if parameter.name[:1] in 'Im' else None
    return rigid or words.get(parameter.name, name_in_words(parameter.name))
