# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The gap between model and measurement, and joints whose equal periods differ."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.diagnosis.data.evidence import Evidence, NoiseFloor
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.settings import Thresholds
from armid_ros.diagnosis.verdict.finding import Gap, Overlay
from armid_ros.motion import FloatArray
import numpy as np


def measure_gap(explanation: Explanation, unseen: Evidence | None) -> Gap:
    """
    Measure the gap on held-out data, or on the fitted data if there are none.

    Parameters
    ----------
    explanation : Explanation
        The fitted causes.
    unseen : Evidence or None
        Held-out data, in the unit of the gap.

    """
    before, after = explanation.reference.arm, explanation.fitted.arm
    evidence = explanation.evidence if unseen is None else unseen
    residuals = [evidence.residuals(arm) for arm in (before, after)]
    overlays = []
    for part, sigma, given, patched in zip(evidence.data, evidence.sigma, *residuals, strict=True):
        torque = part.torque
        overlays.append(
            Overlay(part.source, part, torque, torque - given, torque - patched, sigma)
        )
    power = [evidence.power(rows) for rows in residuals]
    floor = evidence.power([np.broadcast_to(o.sigma, o.measured.shape) for o in overlays])
    excess = [np.maximum(own - floor, 0.0) / np.maximum(floor, 1e-24) for own in power]
    gap = excess[0] > 0.2  # in other joints, squares beyond the floor are random
    closed = 1.0 - excess[1][gap].sum() / excess[0][gap].sum() if gap.any() else 0.0
    return Gap(
        np.sqrt(power[0]),
        np.sqrt(power[1]),
        np.sqrt(floor),
        evidence.chi2_per_row(residuals[0]),
        float(np.clip(closed, 0.0, 1.0)),
        unseen is not None,
        tuple(overlays),
    )


def not_repeating(
    floors: Sequence[NoiseFloor], thresholds: Thresholds, least: FloatArray
) -> list[int]:
    """
    Return the joints whose equal periods differ slowly and by a material amount.

    Parameters
    ----------
    floors : sequence of NoiseFloor
        Noise of the recordings.
    thresholds : Thresholds
        Power ratios (low over high frequency) above which periods do not repeat.
    least : ndarray, shape (n,)
        Smallest material torque of each joint [N m].

    """
    known = [
        np.where(floor.slow > least, floor.structure, 1.0)
        for floor in floors
        if floor.period is not None
    ]
    if not known:
        return []
    often = np.sum(np.array(known) >= thresholds.one_period, axis=0) >= max(1, len(known) / 2)
    if len(known) >= 3:
        mean = np.exp(np.mean(np.log(known), axis=0))
        often |= mean > thresholds.one_period_on_average
    return np.flatnonzero(often).tolist()
