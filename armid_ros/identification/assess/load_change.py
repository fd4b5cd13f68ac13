# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The load that explains how inertial parameters changed, and changes of what a model leaves.

A body that is fixed to link k adds its ten parameters to those of the link, and base parameters
change by G_k p, with the factors G_k that group the parameters of link k in them. Ten numbers p
that explain dozens of changes, to their uncertainty, are a load; its mass is the first of them.

Whether a model leaves more of the torque than another one did is a change that no parameter has.
The mean squares of two residuals are held against each other (Fisher's F). What a model gets wrong
of an arm is slow, so a recording has few independent values of it, however many rows.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import isfinite
import re
from typing import Any

from armid_ros.changes.statistic import tail
from armid_ros.identification.assess.grade_limits import FREEDOM
from armid_ros.identification.known_fit import KnownFit
from armid_ros.motion import FloatArray
import numpy as np
import scipy.linalg

#: Parameters of a link as base parameters name them, without its number.
_SYMBOLS = ('m', 'mx', 'my', 'mz', 'Ixx', 'Ixy', 'Iyy', 'Ixz', 'Iyz', 'Izz')
#: Probability with which the changes of a load are taken for something else.
_REFUSED = 0.01
#: Below this share of the largest a direction of a load is not seen at all.
_UNSEEN = 1e-9
#: A mass differs from zero if it is this many standard deviations away.
_TOLD = 1.96
#: Share of its torque below which the residual of a joint is of filters, and not of an arm [%].
LEAST_ERROR = 0.1


@dataclass(frozen=True)
class LoadChange:
    """
    A load on one link.

    Attributes
    ----------
    link : int
        Number of the link, 1 next to the base.
    mass, mass_std : float
        Mass that was added, negative if taken away, and its standard deviation [kg].
    center : ndarray, shape (3,), or None
        Its centre of mass in the joint frame of the link [m]; None where it is not determined.
    p_value : float
        Probability of what it leaves unexplained, by chance.
    rivals : tuple of int
        Numbers of links on which a load would explain the changes as well.

    """

    link: int
    mass: float
    mass_std: float
    center: FloatArray | None
    p_value: float
    rivals: tuple[int, ...] = ()

    def document(self) -> dict[str, Any]:
        """Return the load for programs to read."""
        center = None if self.center is None else self.center.tolist()
        return {**asdict(self), 'center': center, 'rivals': list(self.rivals)}


def find_load(
    terms: Sequence[Mapping[str, float]], difference: FloatArray, covariance: FloatArray
) -> LoadChange | None:
    """
    Find the load on one link that explains changes of base parameters.

    Parameters
    ----------
    terms : sequence of (mapping of str to float)
        Factors of the standard parameters in each of r base parameters.
    difference : ndarray, shape (r,)
        What each changed by.
    covariance : ndarray, shape (r, r)
        Of the difference.

    Returns
    -------
    LoadChange or None
        That of the outermost link that will do, for that is where arms hold things; None if no
        load of any link explains all, or none has a mass that differs from zero.

    """
    std = np.sqrt(np.diag(covariance))
    if not len(std) or not np.all(std > 0.0):
        return None
    root = np.linalg.cholesky(covariance / np.outer(std, std) + 1e-12 * np.eye(len(std)))
    white = scipy.linalg.solve_triangular(root, difference / std, lower=True)
    numbers = {int(found[1]) for row in terms for key in row if (found := _NUMBERED.match(key))}
    loads = []
    for link in sorted(numbers):
        keys = [f'{symbol}{link}' for symbol in _SYMBOLS]
        factors = np.array([[row.get(key, 0.0) for key in keys] for row in terms])
        columns = scipy.linalg.solve_triangular(root, factors / std[:, np.newaxis], lower=True)
        load = _load(link, columns, white)
        if load is not None:
            loads.append(load)
    if not loads:
        return None
    return replace(loads[-1], rivals=tuple(load.link for load in loads[:-1]))


_NUMBERED = re.compile(r'(?:m[xyz]?|I[xyz]{2})(\d+)$')


def _load(link: int, columns: FloatArray, white: FloatArray) -> LoadChange | None:
    """Fit the load of one link to changes of unit covariance."""
    lengths = np.linalg.norm(columns, axis=0)
    scale = np.where(lengths > 0.0, lengths, 1.0)
    left, sizes, right = np.linalg.svd(columns / scale, full_matrices=False)
    seen = sizes > _UNSEEN * sizes[0]
    left, sizes, right = left[:, seen], sizes[seen], right[seen]
    along = left.T @ white
    rest = float(white @ white - along @ along)
    freedom = len(white) - len(sizes)
    p_value = float(tail(rest, freedom)) if freedom > 0 else 0.0
    if p_value < _REFUSED or np.linalg.norm(right[:, 0]) < 1.0 - 1e-6:
        return None
    values = (right.T @ (along / sizes)) / scale
    mass, std = float(values[0]), float(np.linalg.norm(right[:, 0] / sizes) / scale[0])
    if abs(mass) < _TOLD * std:
        return None
    whole = np.all(np.linalg.norm(right[:, 1:4], axis=0) > 1.0 - 1e-6)
    return LoadChange(link, mass, std, values[1:4] / mass if whole else None, p_value)


@dataclass(frozen=True)
class ResidualChange:
    """
    What two models leave of one joint.

    Attributes
    ----------
    joint : str
        Which.
    before, after : float
        Root mean square residual, as the file has it [N m].
    before_error, after_error : float or None
        The same over the torque of the joint [%].
    ratio : float
        Of the second to the first, divided by how much more torque there was.
    p_value : float
        Probability that motions alone make them differ as much.
    changed : bool
        Whether they differ by more than chance.

    """

    joint: str
    before: float
    after: float
    before_error: float | None
    after_error: float | None
    ratio: float
    p_value: float
    changed: bool = False

    def document(self) -> dict[str, Any]:
        """Return it for programs to read."""
        return asdict(self) | {'ratio': self.ratio if isfinite(self.ratio) else None}


def residual_changes(
    before: KnownFit | None, after: KnownFit | None
) -> tuple[ResidualChange, ...]:
    """
    Hold against each other what two models leave of each joint.

    Empty where it is not known alike: the misfit of model.yaml and the residual of
    identification.json are of other rows.

    """
    if before is None or after is None or before.as_diagnosed != after.as_diagnosed:
        return ()
    freedoms = FREEDOM * after.recordings, FREEDOM * before.recordings
    found = []
    for joint in (one for one in before.rms if one in after.rms):
        ratio = _ratio(before, after, joint)
        with np.errstate(over='ignore', divide='ignore'):
            square = np.square(ratio)
            more = tail(square * freedoms[0], *freedoms)
            less = tail(freedoms[1] / square, *freedoms[::-1])
        p_value = 2.0 * min(float(more), float(less))
        errors = before.errors.get(joint), after.errors.get(joint)
        left = before.rms[joint], after.rms[joint]
        found.append(ResidualChange(joint, *left, *errors, ratio, min(p_value, 1.0)))
    return tuple(found)


def _ratio(before: KnownFit, after: KnownFit, joint: str) -> float:
    """Return by how many times more is left than a model would leave of as much torque."""
    torques = before.torque(joint), after.torque(joint)
    first, second = (
        max(one.rms[joint], LEAST_ERROR / 100.0 * torque)
        for one, torque in zip((before, after), torques, strict=True)
    )
    if first == second:
        return 1.0
    ratio = second / first if first > 0.0 else float('inf')
    growth = torques[1] / torques[0] if min(torques) > 0.0 else 1.0
    if ratio > 1.0:
        return max(ratio / max(growth, 1.0), 1.0)
    return min(ratio / min(growth, 1.0), 1.0)
