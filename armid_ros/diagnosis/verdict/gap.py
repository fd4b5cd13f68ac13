# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The gap between model and measurement, before and after, beside the noise, on held-out data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Evidence, Trajectory
from armid_ros.diagnosis.search.explain import Explanation
from armid_ros.motion import FloatArray
import numpy as np

#: A joint has a gap where the squares beyond the floor are this many times the floor.
_A_GAP = 0.2


@dataclass(frozen=True)
class Overlay:
    """
    Torques of one trajectory, filtered alike.

    Attributes
    ----------
    source : str
        The recording.
    trajectory : Trajectory
        Its motion.
    measured, before, after : ndarray, shape (M, n)
        Measured torque, and what both models predict [N m].
    sigma : ndarray, shape (n,)
        Noise [N m].

    """

    source: str
    trajectory: Trajectory
    measured: FloatArray
    before: FloatArray
    after: FloatArray
    sigma: FloatArray


@dataclass(frozen=True)
class Gap:
    """
    Errors in numbers.

    Attributes
    ----------
    before, after, floor : ndarray, shape (n,)
        Root mean square error of each joint without and with what was named, and the noise [N m].
    chi2_before, chi2_after : ndarray, shape (n,)
        Mean square over noise.
    closed : float
        Share of the excess over the noise that is gone, 0 to 1, in the joints that had a gap or
        have one.
    predicted : bool
        Whether it was measured on recordings that nothing was fitted to.
    overlays : tuple of Overlay
        The curves.

    """

    before: FloatArray
    after: FloatArray
    floor: FloatArray
    chi2_before: FloatArray
    chi2_after: FloatArray
    closed: float
    predicted: bool
    overlays: tuple[Overlay, ...]

    @property
    def data(self) -> str:
        """Return what it was measured on, for a reader."""
        return 'held-out' if self.predicted else 'the data it was found in'


def measure_gap(
    explanation: Explanation, unseen: Evidence | None, floor: Sequence[FloatArray]
) -> Gap:
    """
    Measure the gap on data that are only predicted, else on the data themselves.

    Parameters
    ----------
    explanation : Explanation
        What was found.
    unseen : Evidence or None
        Data that nothing was fitted to.
    floor : sequence of ndarray, each (n,)
        What a perfect model would leave of each trajectory [N m].

    """
    before, after = explanation.reference.arm, explanation.fitted.arm
    evidence = explanation.evidence if unseen is None else unseen
    parts = list(zip(evidence.data, evidence.sigma, floor, strict=True))
    overlays = [_overlay(part, sigma, before, after) for part, sigma, _ in parts]
    told = np.concatenate([part.informative for part, _, _ in parts])
    count = np.maximum(told.sum(axis=0), 1)

    def mean(rows: Sequence[FloatArray]) -> FloatArray:
        squares = np.concatenate(rows) ** 2
        return np.asarray(np.sum(squares, axis=0, where=told) / count)

    left = [[o.measured - o.before for o in overlays], [o.measured - o.after for o in overlays]]
    unit = [[row / o.sigma for row, o in zip(rows, overlays, strict=True)] for rows in left]
    losses = [mean(rows) for rows in unit]
    least = mean([np.broadcast_to(s, part.informative.shape) for part, _, s in parts])
    beyond = [np.maximum(mean(rows) - least, 0.0) / np.maximum(least, 1e-24) for rows in left]
    gap = beyond[0] > _A_GAP
    closed = 1.0 - beyond[1][gap].sum() / beyond[0][gap].sum() if gap.any() else 0.0
    return Gap(
        np.sqrt(mean(left[0])),
        np.sqrt(mean(left[1])),
        np.sqrt(least),
        losses[0],
        losses[1],
        float(np.clip(closed, 0.0, 1.0)),
        unseen is not None,
        tuple(overlays),
    )


def _overlay(part: Trajectory, sigma: FloatArray, before: ArmModel, after: ArmModel) -> Overlay:
    assert part.motion.tau is not None
    measured = part.reduce(part.motion.tau)
    without, patched = part.residual(before), part.residual(after)
    return Overlay(part.source, part, measured, measured - without, measured - patched, sigma)
