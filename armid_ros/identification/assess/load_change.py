# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The load that explains how the inertial parameters of an arm changed.

A body that is fixed to link k adds its ten parameters to those of the link, and base parameters
change by G_k p, with the factors G_k that group the parameters of link k in them. Ten numbers p
that explain dozens of changes, to their uncertainty, are a load; its mass is the first of them.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
import re
from typing import Any

from armid_ros.motion import FloatArray
import numpy as np
import scipy.linalg
from scipy.stats import chi2

#: Parameters of a link as base parameters name them, without its number.
_SYMBOLS = ('m', 'mx', 'my', 'mz', 'Ixx', 'Ixy', 'Iyy', 'Ixz', 'Iyz', 'Izz')
#: Probability with which the changes of a load are taken for something else.
_REFUSED = 0.01
#: Below this share of the largest a direction of a load is not seen at all.
_UNSEEN = 1e-9
#: A mass differs from zero if it is this many standard deviations away.
_TOLD = 1.96


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
    p_value = float(chi2.sf(rest, freedom)) if freedom > 0 else 0.0
    if p_value < _REFUSED or np.linalg.norm(right[:, 0]) < 1.0 - 1e-6:
        return None
    values = (right.T @ (along / sizes)) / scale
    mass, std = float(values[0]), float(np.linalg.norm(right[:, 0] / sizes) / scale[0])
    if abs(mass) < _TOLD * std:
        return None
    whole = np.all(np.linalg.norm(right[:, 1:4], axis=0) > 1.0 - 1e-6)
    return LoadChange(link, mass, std, values[1:4] / mass if whole else None, p_value)
