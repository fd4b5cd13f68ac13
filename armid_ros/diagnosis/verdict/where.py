# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Location of a residual: its joints, and the position, velocity or load with which it varies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import Trajectory
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray, read_only
import numpy as np


@dataclass(frozen=True)
class Axis:
    """
    Mean residual of a joint in bins of one quantity, such as its velocity.

    Attributes
    ----------
    name, unit : str
        Name and unit of the quantity.
    centres, means : ndarray, shape (B,)
        Mean of the quantity, and mean of the residual [N m or N], in each bin.
    share : float
        Mean square of `means` over the mean square residual (R squared).

    """

    name: str
    unit: str
    centres: FloatArray
    means: FloatArray
    share: float


@dataclass(frozen=True)
class Where:
    """
    Residual of one joint, and the quantities on which it depends.

    Attributes
    ----------
    joint : str
        Name of the joint.
    share_of_gap : float
        Share of the joint in the gap of all joints, 0 to 1.
    signature : str
        Description of the residual and of the quantity with which it varies.
    axes : tuple of Axis
        All quantities, the largest share first.
    unit : str
        Unit of the residual.
    mean : float
        Mean of the residual [N m or N].
    mean_share : float
        Square of `mean` over the mean square of the residual.

    """

    joint: str
    share_of_gap: float
    signature: str
    axes: tuple[Axis, ...]
    unit: str
    mean: float = 0.0
    mean_share: float = 0.0


@dataclass(frozen=True)
class Excess:
    """
    Squared residual of each joint, divided by the limit that noise and known errors explain.

    Attributes
    ----------
    ratio : ndarray, shape (n,)
        Mean square of the weighted residual over its limit; above one there is a gap.
    where : str
        Description of the data, for the middle of a sentence.

    """

    ratio: FloatArray
    where: str


def locate_explained(
    explanation: Explanation, evidence: Evidence, settings: DiagnosisSettings
) -> tuple[Where, ...]:
    """Describe the residual that the named causes explain, for each joint."""
    before, after = (
        evidence.residuals(one.arm) for one in (explanation.reference, explanation.fitted)
    )
    explained = evidence.chi2_per_row(before) - evidence.chi2_per_row(after)
    least = settings.thresholds.inexact * max(float(explained.sum()), 0.0)
    gap = np.where(explained > least, explained, 0.0)
    return locate(explanation.given, evidence, before, gap)


def locate_remaining_gap(
    explanation: Explanation,
    evidence: Evidence,
    settings: DiagnosisSettings,
    laws: Sequence[Excess],
) -> tuple[Where, ...]:
    """Describe the remaining residual of each joint over its limit, or with an unlisted law."""
    residual = evidence.residuals(explanation.fitted.arm)
    losses, limits = evidence.chi2_per_row(residual), evidence.limits(residual, settings)
    new = np.any([one.ratio > 1.0 for one in laws], axis=0)
    gap = np.where(new, losses, np.where(losses > limits, losses - 1.0, 0.0))
    return locate(explanation.given, evidence, residual, gap)


def locate(
    arm: ArmModel, evidence: Evidence, residual: Sequence[FloatArray], gap: FloatArray
) -> tuple[Where, ...]:
    """
    Describe on which quantity the residual of each joint depends.

    Parameters
    ----------
    arm : ArmModel
        Model that computes the loads.
    evidence : Evidence
        The recordings.
    residual : sequence of ndarray, shape (M, n)
        Residual of each trajectory [N m or N].
    gap : ndarray, shape (n,)
        Size of the gap of each joint, by which the joints are sorted; zero without a gap.

    """
    data = evidence.data
    total = max(float(gap.sum()), 1e-300)
    rows = [_quantities(arm, part) for part in data]
    informative = np.concatenate([part.informative for part in data])
    stacked = np.concatenate(residual)
    result = []
    for joint in np.argsort(-gap):
        if gap[joint] <= 0.0:
            break
        use = informative[:, joint]
        axes = []
        length, torque = arm.robot.position_units[joint], arm.robot.torque_units[joint]
        units = {
            'velocity': f'{length}/s',
            'position': length,
            'acceleration': f'{length}/s^2',
            'time': 's',
        }
        for name in rows[0]:
            values = np.concatenate([row[name][:, joint] for row in rows])
            axes.append(_axis(name, units.get(name, torque), values[use], stacked[use, joint]))
        axes.sort(key=lambda axis: -axis.share)
        name = arm.robot.joints[joint]
        share = float(gap[joint] / total)
        own = stacked[use, joint]
        mean = float(own.mean()) if len(own) else 0.0
        constant = mean**2 / max(float(np.mean(own**2)), 1e-300) if len(own) else 0.0
        words = _in_words(axes, torque, own)
        result.append(Where(name, share, words, tuple(axes), torque, mean, constant))
    return tuple(result)


def _quantities(arm: ArmModel, part: Trajectory) -> dict[str, FloatArray]:
    motion = part.at_rows
    load = arm.load(arm.link_motion(motion))
    time = np.repeat(motion.t[:, np.newaxis], motion.n_joints, axis=1)
    return {
        'velocity': motion.dq,
        'position': motion.q,
        'load': load,
        'load against motion': np.abs(load) * np.sign(motion.dq),
        'acceleration': motion.ddq,
        'time': time,
    }


def _axis(name: str, unit: str, x: FloatArray, residual: FloatArray) -> Axis:
    """Return the mean residual in bins of a quantity x with equally many rows."""
    bins = 16
    edges = np.quantile(x, np.linspace(0.0, 1.0, bins + 1))
    index = np.clip(np.searchsorted(edges, x, side='right') - 1, 0, bins - 1)
    counts = np.bincount(index, minlength=bins)
    filled = counts > 0
    centres, means = (
        np.bincount(index, values, bins)[filled] / counts[filled] for values in (x, residual)
    )
    power = float(np.sum(residual**2))
    share = float(np.sum(counts[filled] * means**2)) / power if power > 0.0 else 0.0
    return Axis(name, unit, read_only(centres), read_only(means), share)


def _in_words(axes: Sequence[Axis], unit: str, residual: FloatArray) -> str:
    """
    Describe a joint's residual by the quantity that explains most of it.

    If its bin means explain less than 15 % of the mean square residual, the residual depends on
    no single quantity.

    """
    best = axes[0]
    if best.share < 0.15:
        rms = float(np.sqrt(np.mean(residual**2)))
        return f'a torque of {rms:.2g} {unit} rms that depends on no single quantity of the joint'
    name = 'load times direction of motion' if ' ' in best.name else best.name
    largest = int(np.argmax(np.abs(best.means)))
    most = f'{abs(best.means[largest]):.2g} {unit}'
    size = 0.15 * float(np.sum(best.means**2))  # of deviations from a line
    slope = float(best.centres @ best.means) / max(float(best.centres @ best.centres), 1e-300)
    if np.sum((best.means - best.means.mean()) ** 2) < size:
        return f'constant torque of {best.means.mean():.2g} {unit}'
    if np.sum((best.means - slope * best.centres) ** 2) < size:
        return f'torque in proportion to {name}, up to {most}'
    peak = best.centres[largest]
    return f'torque that varies with {name}, up to {most} at {peak:.3g} {best.unit}'
