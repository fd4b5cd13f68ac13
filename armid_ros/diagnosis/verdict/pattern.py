# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What all fitted values have in common where the described ones are off.

Of the change of the base parameters, in units of what the data tell of them, the share that one
factor makes: of all torques, friction included, which is a gain of the drives; or of the rigid
body alone, which is a scale of the masses. Single causes of another kind (gravity, one link, a
payload, a tilt) are looked for as effects.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Trajectory
from armid_ros.diagnosis.data.rows import weighted_rows
from armid_ros.diagnosis.search.explain import Explanation
from armid_ros.motion import FloatArray
import numpy as np

#: A factor that makes this share of a change is what has changed; of several values that are off
#: on their own, it makes less.
_TELLING = 0.95
#: Two factors that make shares this near to each other cannot be told apart.
_ALIKE = 0.02


@dataclass(frozen=True)
class Pattern:
    """
    One factor behind the change of all values.

    Attributes
    ----------
    name : str
        'torque_gain' or 'mass_scale'; 'torque_gain or mass_scale' where the data cannot tell.
    factor : float
        Fitted values over described ones.
    share : float
        Share of the change that it makes, 0 to 1.

    """

    name: str
    factor: float
    share: float

    @property
    def sentence(self) -> str:
        """Say it for a person."""
        what = {
            'torque_gain': 'all torques, friction included: a gain of the drives',
            'mass_scale': 'the rigid body, and not of friction: a scale of the masses',
        }.get(self.name, 'all values: a gain of the drives, or a scale of the masses')
        return (
            f'what is off is a factor of {self.factor:.3f} on {what} ({100 * self.share:.0f} % of '
            'the change); the same motion with a known payload tests it'
        )


def find_pattern(
    explanation: Explanation,
    arm: ArmModel,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
) -> Pattern | None:
    """
    Return the factor that made the described values wrong, if there is one.

    Parameters
    ----------
    explanation : Explanation
        A fit of all values.
    arm : ArmModel
        The arm as described.
    data : sequence of Trajectory
        The data.
    sigma : sequence of ndarray, shape (n,)
        Noise of each trajectory [N m].

    """
    base, fitted = explanation.base, explanation.fitted
    if base is None:
        return None
    known = len(arm.parameters)
    change = base.values(fitted.arm.theta[:known]) - base.values(arm.theta)
    precision = np.zeros((base.rank, base.rank))
    free = [columns[:, :, : base.rank] for columns in fitted.columns]
    for columns in weighted_rows(free, data, sigma):
        flat = columns.reshape(-1, base.rank)
        precision += flat.T @ flat
    total = float(change @ precision @ change)
    rigid = arm.theta.copy()
    rigid[len(arm.robot.rigid_parameters) :] = 0.0
    found = []
    for name, described in (('torque_gain', arm.theta), ('mass_scale', rigid)):
        values = base.values(described)
        own, aim = values @ precision @ values, values @ precision @ change
        if own > 0.0 and total > 0.0:
            found.append(Pattern(name, 1.0 + float(aim / own), float(aim**2 / own / total)))
    found.sort(key=lambda pattern: -pattern.share)
    if not found or found[0].share < _TELLING:
        return None
    if found[0].share - found[-1].share < _ALIKE * found[0].share:
        return Pattern('torque_gain or mass_scale', found[0].factor, found[0].share)
    return found[0]
