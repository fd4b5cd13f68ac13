# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The gap between model and measurement, before and after, beside the noise, on held-out data.

No patch makes a model worse: in no joint, on the data it was found in or on others, may the
patched model leave more than the given one beyond what blocks of the data differ by, unless what
is left is no gap.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Evidence, Trajectory
from armid_ros.diagnosis.data.rows import block_squares
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: A joint has a gap where the squares beyond the floor are this many times the floor.
_A_GAP = 0.2
#: Deviations beyond which a joint is surely worse, and share of its squares that nobody would
#: call worse.
_SURELY, _SLIGHTLY = 3.0, 0.05


@dataclass(frozen=True)
class Excess:
    """
    What is left in the joints beyond what is no gap.

    Attributes
    ----------
    ratio : ndarray, shape (n,)
        Loss over the loss up to which it is no gap; above one there is something.
    where : str
        The data that show it, for a sentence.

    """

    ratio: FloatArray
    where: str


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
    chi2_before : ndarray, shape (n,)
        Mean square over noise without what was named.
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
    closed: float
    predicted: bool
    overlays: tuple[Overlay, ...]

    @property
    def data(self) -> str:
        """Return what it was measured on, for a reader."""
        return 'held-out' if self.predicted else 'the data it was found in'


def measure_gap(explanation: Explanation, unseen: Evidence | None) -> Gap:
    """
    Measure the gap on data that are only predicted, else on the data themselves.

    Parameters
    ----------
    explanation : Explanation
        What was found.
    unseen : Evidence or None
        Data that nothing was fitted to; their unit is what a perfect model would leave.

    """
    before, after = explanation.reference.arm, explanation.fitted.arm
    evidence = explanation.evidence if unseen is None else unseen
    overlays = [
        _overlay(part, sigma, before, after)
        for part, sigma in zip(evidence.data, evidence.sigma, strict=True)
    ]
    left = [[o.measured - o.before for o in overlays], [o.measured - o.after for o in overlays]]
    power = [evidence.power(rows) for rows in left]
    floor = evidence.power([np.broadcast_to(o.sigma, o.measured.shape) for o in overlays])
    beyond = [np.maximum(own - floor, 0.0) / np.maximum(floor, 1e-24) for own in power]
    gap = beyond[0] > _A_GAP
    closed = 1.0 - beyond[1][gap].sum() / beyond[0][gap].sum() if gap.any() else 0.0
    return Gap(
        np.sqrt(power[0]),
        np.sqrt(power[1]),
        np.sqrt(floor),
        evidence.chi2_per_row(left[0]),
        float(np.clip(closed, 0.0, 1.0)),
        unseen is not None,
        tuple(overlays),
    )


def _overlay(part: Trajectory, sigma: FloatArray, before: ArmModel, after: ArmModel) -> Overlay:
    measured = part.torque
    without, patched = part.residual(before), part.residual(after)
    return Overlay(part.source, part, measured, measured - without, measured - patched, sigma)


def harmed(
    explanation: Explanation, unseen: Evidence | None, settings: DiagnosisSettings
) -> tuple[str, ...]:
    """Return the joints in which the patched model is worse than the given one."""
    if not explanation.steps:
        return ()
    before, after = explanation.given, explanation.fitted.arm
    sets = [explanation.evidence, *([] if unseen is None else [unseen])]
    worse = np.any([_worse(before, after, evidence, settings) for evidence in sets], axis=0)
    return tuple(j for j, bad in zip(before.robot.joints, worse, strict=True) if bad)


def _worse(
    before: ArmModel, after: ArmModel, evidence: Evidence, settings: DiagnosisSettings
) -> npt.NDArray[np.bool_]:
    left = [[part.residual(arm) for part in evidence.data] for arm in (before, after)]
    had, has = (block_squares(rows, evidence) for rows in left)
    more = has - had
    spread = more.std(axis=0, ddof=1) * np.sqrt(len(more))
    total = more.sum(axis=0)
    floor = np.maximum(had.sum(axis=0), evidence.count)
    gap = evidence.chi2_per_row(left[1]) > evidence.as_good(settings) + evidence.matters(settings)
    surely = (total > _SURELY * spread) & (total > _SLIGHTLY * floor)
    by_far = total > (settings.thresholds.same_fit - 1.0) * floor
    return np.asarray((surely | by_far) & gap)
