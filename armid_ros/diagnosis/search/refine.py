# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Shapes refined by variable projection (Golub and Pereyra 1973): values are fitted at each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

from armid_ros.diagnosis.data.evidence import Workspace
from armid_ros.diagnosis.data.rows import Problem, Projection
from armid_ros.diagnosis.search.trial import Candidate
from armid_ros.effects import Shape
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray
import numpy as np
from scipy import optimize

#: How far from a peak of a spectrum its side lobes are looked at, and how sharp it is [1/rev].
_LOBES, _PEAK = 3.0, 0.2
#: Rounds of a refinement, and evaluations of each shape.
_ROUNDS, _EVALUATIONS = 2, 9


def refine(
    problem: Problem,
    projection: Projection,
    candidate: Candidate,
    left: FloatArray,
    work: Workspace,
) -> tuple[Candidate, FloatArray]:
    """
    Refine the shape of a candidate by variable projection; return it with its columns.

    What is left has nothing in it that the free columns could make.

    """
    effect, kept = candidate.effect, candidate.kept
    lower, upper = (bound[list(kept)] for bound in effect.bounds())
    cache: dict[tuple[float, ...], tuple[float, FloatArray]] = {}

    def gain(shape: FloatArray) -> float:
        key = tuple(shape.tolist())
        if key not in cache:
            try:
                columns = work.columns(effect.with_shape(shape), kept)
            except ModelError:
                return 0.0  # not possible: takes nothing
            weighted = (columns * problem.weight[:, :, np.newaxis]).reshape(-1, len(kept))
            own, aim = projection.products(weighted), weighted.T @ left.ravel()
            values = np.linalg.lstsq(own, aim, rcond=1e-9)[0]
            if len(kept) == 1:  # what is not possible is no gain
                values = np.clip(values, lower, upper)
            cache[key] = float(2.0 * values @ aim - values @ own @ values), columns
        return cache[key][0]

    shape = np.array(effect.shape)
    gain(shape)
    for _ in range(_ROUNDS if len(shape) > 1 else 1):
        for index, kind in enumerate(effect.shapes):
            shape = _line_search(gain, shape, index, kind)
    best = max(cache, key=lambda key: cache[key][0])
    return replace(candidate, effect=effect.with_shape(best)), cache[best][1]


def _line_search(
    gain: Callable[[FloatArray], float], shape: FloatArray, index: int, kind: Shape
) -> FloatArray:
    """Search one shape around where it is, over its logarithm if positive (Brent 1973)."""
    value = float(shape[index])
    positive = kind.lower > 0.0 and value > 0.0 and kind.near is None and kind.unit != '1/rev'

    def at(x: float) -> FloatArray:
        moved = shape.copy()
        moved[index] = np.exp(x) if positive else x
        return moved

    if kind.unit == '1/rev':  # side lobes beside the peak are almost as high
        scan = value + np.linspace(-_LOBES, _LOBES, 25)
        value = max(scan[scan > kind.lower].tolist(), key=lambda x: gain(at(x)))
        low, high = value - _PEAK, value + _PEAK
    elif positive:
        ratio = max([b / a for a, b in pairwise(sorted(kind.grid)) if a > 0.0] or [3.0])
        ratio = min(ratio, 3.5)
        low = np.log(max(kind.lower, value / ratio))
        high = np.log(min(kind.upper, value * ratio))
    else:
        apart = max([b - a for a, b in pairwise(sorted(kind.grid))] or [0.0])
        near = kind.near or max(0.15, apart / max(abs(value), 1e-300))
        reach = max(near * abs(value), 1e-3)
        low, high = max(kind.lower, value - reach), min(kind.upper, value + reach)
    found = optimize.minimize_scalar(
        lambda x: -gain(at(x)),
        bounds=(low, high),
        method='bounded',
        options={'maxiter': _EVALUATIONS},
    )
    return at(found.x) if -found.fun > gain(shape) else shape
