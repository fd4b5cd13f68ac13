# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that data do not identify; reports contain the reason instead of a value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from armid_ros.estimate import Estimate, ParameterName
from armid_ros.model import BaseParameters
import numpy as np
import numpy.typing as npt

#: Reason for a parameter without a value that more motion of the joint would give.
NOT_SHOWN: Literal['this motion does not show it'] = 'this motion does not show it'

#: Half width of a 95 % interval in standard deviations.
HALF_WIDTH = 1.96

Reason = Literal[
    'no motion of this arm shows it',
    'this motion does not show it',
    'this motion shows it only together with others',
    'not distinguishable from zero',
]


@dataclass(frozen=True)
class Unidentified:
    """
    A parameter that the data do not identify.

    Attributes
    ----------
    parameter : ParameterName
        A standard parameter, or a base parameter.
    reason : str
        Reason, one of `Reason`.

    """

    parameter: ParameterName
    reason: Reason


def excludes_zero(values: npt.ArrayLike, std: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Return whether the 95 % interval of each estimate excludes zero."""
    return np.asarray(np.abs(values) > HALF_WIDTH * np.asarray(std, dtype=float))


def unidentified(
    theory: BaseParameters, base: BaseParameters, estimate: Estimate
) -> tuple[Unidentified, ...]:
    """
    List the parameters that data do not identify.

    Parameters
    ----------
    theory : BaseParameters
        Base parameters that are identifiable in some motion.
    base : BaseParameters
        Base parameters that the data identify.
    estimate : Estimate
        Estimate of the base parameters.

    """
    seen = np.any(base.grouping, axis=0)
    found = [
        Unidentified(name, 'no motion of this arm shows it')
        for name, shown in zip(theory.standard, np.any(theory.grouping, axis=0), strict=True)
        if not shown
    ]
    kept = set(base.independent.tolist())
    for name, column in zip(theory.parameters, theory.independent, strict=True):
        if column not in kept:
            together = bool(seen[column])
            found.append(
                Unidentified(
                    name,
                    'this motion shows it only together with others' if together else NOT_SHOWN,
                )
            )
    clear = excludes_zero(estimate.values, estimate.std)
    found += [
        Unidentified(name, 'not distinguishable from zero')
        for name, sure in zip(estimate.parameters, clear, strict=True)
        if not sure
    ]
    return tuple(found)
