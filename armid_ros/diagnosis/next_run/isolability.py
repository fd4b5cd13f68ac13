# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Isolability: the effects that a planned motion makes detectable, and distinguishable.

The model of the arm is assumed to be exact. Columns of effects are divided by the noise; two
effects are distinguishable if the angle between their columns is large (Basseville and Nikiforov
1993).

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.next_run.separation import basis_of, informative_weight
from armid_ros.diagnosis.search.candidates import candidate_effects
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.diagnosis.verdict.document import Detectable, DETECTABLE_Z, is_possible
from armid_ros.effects import Effect
from armid_ros.motion import FloatArray, Motion
import numpy as np
import numpy.typing as npt

#: Two effects are distinguishable if at least this share of the torque of one cannot be reproduced
#: by the other. The difference is then detectable at ten times the detectable size.
DISTINCT = 0.1


@dataclass(frozen=True)
class Isolability:
    """
    Detectable sizes of E effects in a planned motion, and how well the motion separates them.

    Attributes
    ----------
    effects : tuple of Detectable
        Each effect of the catalogue, on each joint, pair or the whole arm.
    apart : ndarray, shape (E, E)
        Share of the rms torque of the first effect that the second cannot reproduce, 0 to 1.

    """

    effects: tuple[Detectable, ...]
    apart: FloatArray

    @property
    def seen(self) -> npt.NDArray[np.bool_]:
        """Whether the motion makes each effect detectable at a physically possible size, (E,)."""
        return np.array([np.isfinite(one.size) for one in self.effects])

    def rivals(self, k: int) -> list[Detectable]:
        """Return detectable effects that are not distinguishable from effect k, closest first."""
        order = np.argsort(self.apart[k])
        near = [j for j in order if j != k and self.seen[j] and self.apart[k, j] < DISTINCT]
        return [self.effects[j] for j in near]

    def __str__(self) -> str:
        """Return a sentence with the numbers of detectable and of distinguishable effects."""
        kinds, apart = self.of_kinds()
        alone = int(np.sum(np.all(apart + np.eye(len(kinds)) >= DISTINCT, axis=1)))
        total = len({one.name for one in self.effects})
        return (
            f'{len(kinds)} of {total} effects are detectable, {alone} of them distinguishable '
            'from all other effects on any joint'
        )

    def document(self) -> list[dict[str, Any]]:
        """Return the entry of each effect in excitation.json."""
        return [
            {
                'name': one.name,
                'joints': list(one.joints),
                'parameter': one.parameter and one.parameter.name,
                'min_detectable': one.size if self.seen[k] else None,
                'unit': one.parameter and one.parameter.unit,
                'not_distinguishable_from': [
                    {'name': rival.name, 'joints': list(rival.joints)} for rival in self.rivals(k)
                ],
            }
            for k, one in enumerate(self.effects)
        ]

    def of_kinds(self) -> tuple[tuple[str, ...], FloatArray]:
        """Return the K detectable effects, and each pair's smallest separation over joints."""
        names = [one.name for one in self.effects]
        kinds = tuple(dict.fromkeys(np.array(names)[self.seen].tolist()))
        places = [np.flatnonzero(self.seen & (np.array(names) == kind)) for kind in kinds]
        other = self.apart + np.eye(len(names))
        least = [[float(other[np.ix_(a, b)].min()) for b in places] for a in places]
        return kinds, np.array(least)


def isolability(arm: ArmModel, motion: Motion, noise: FloatArray, samples: float) -> Isolability:
    """
    Predict which effects of the catalogue a recording of a motion would show.

    Parameters
    ----------
    arm : ArmModel
        The arm with its known effects.
    motion : Motion
        The planned motion.
    noise : ndarray, shape (n,)
        Standard deviation of the torque noise [N m or N].
    samples : float
        Number of samples that are recorded.

    """
    weight = informative_weight(motion, samples / len(motion), noise)[:, :, np.newaxis]
    found, bases = list[Detectable](), list[FloatArray]()
    for _, members in candidate_effects(arm.robot, DiagnosisSettings().kinds):
        for effect in members:
            columns = (weight * arm.columns_of(effect, motion)).reshape(weight.size, -1)
            basis = basis_of(columns)
            bases.append(basis if basis.size else np.zeros((len(columns), 1)))
            found.append(_detectable(effect, columns, arm))
    sizes = [basis.shape[1] for basis in bases]
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    whole = np.concatenate(bases, axis=1)
    products = whole.T @ whole
    squares = np.add.reduceat(np.add.reduceat(products**2, first, axis=0), first, axis=1)
    shared = squares / np.array(sizes)[:, np.newaxis]
    return Isolability(tuple(found), np.sqrt(np.clip(1.0 - shared, 0.0, 1.0)))


def _detectable(effect: Effect, columns: FloatArray, arm: ArmModel) -> Detectable:
    """Return the first detectable parameter of an effect, and its smallest detectable size."""
    for k, parameter in enumerate(effect.parameters(arm.robot)):
        others = basis_of(np.delete(columns, k, axis=1))
        own = columns[:, k] - others @ (others.T @ columns[:, k])
        size = DETECTABLE_Z / max(float(np.linalg.norm(own)), 1e-300)
        if is_possible(effect, k, size, arm.robot):
            return Detectable(effect.name, effect.joints, parameter, size, 1.0)
    return Detectable(effect.name, effect.joints, None, float('inf'), 0.0)
