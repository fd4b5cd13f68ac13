# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From which size on the data would show an effect: what silence about it is worth."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.trial import Trial
from armid_ros.effects import CATALOGUE
from armid_ros.estimate import ParameterName
from armid_ros.robots import Robot

#: Standard deviations of a value from which on it shows. On a two-link arm, effects of one to four
#: times the size that follows were named, of half of it none.
_SHOWS = 5.0
#: Resolution of a value that the data determine: it is a half or less in a pair that they do not.
_IDENTIFIABLE = 0.9


@dataclass(frozen=True)
class Detectable:
    """
    How large an effect has to be.

    Attributes
    ----------
    name : str
        Effect.
    joints : tuple of str
        Where; none for the whole arm.
    parameter : ParameterName or None
        What is meant by its size; None where no size shows.
    size : float
        Smallest size that shows, the others of its parameters being fitted too; inf if none does.
    visible : float
        Share of its torque that the free parameters cannot make.

    """

    name: str
    joints: tuple[str, ...]
    parameter: ParameterName | None
    size: float
    visible: float


def smallest_size(trial: Trial) -> tuple[int, float]:
    """Return the first parameter of a candidate that is identifiable, and from which size on."""
    rows = zip(trial.candidate.kept, trial.std, trial.resolution, strict=True)
    for index, std, resolution in rows:
        if resolution > _IDENTIFIABLE:
            return index, _SHOWS * float(std)
    return trial.candidate.kept[0], float('inf')


def detectable(explanation: Explanation | None, robot: Robot) -> tuple[Detectable, ...]:
    """Return the sizes of all effects on all joints, in the order of the catalogue."""
    survey = None if explanation is None else explanation.survey
    if survey is None:
        return ()
    rows = []
    for trial in (*survey.ranking, *survey.nuisance):
        effect = trial.candidate.effect
        index, size = smallest_size(trial)
        parameter = effect.parameters(robot)[index]
        rows.append(Detectable(effect.said_as, effect.joints, parameter, size, trial.visible))
    rows += [Detectable(name, joints, None, float('inf'), 0.0) for name, joints in survey.unseen]
    order = {name: position for position, name in enumerate(CATALOGUE)}
    return tuple(sorted(rows, key=lambda row: order.get(row.name, len(order))))
