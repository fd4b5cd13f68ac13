# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Slow motions: the weight of an arm is fitted, and its inertia is taken from the description.

However slowly an arm moves, inertia takes a share of its torque, which goes with position as the
weight does and pulls the fit. It is taken off as the description has it, and what a description
may be wrong by is added to the covariance of the weight.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects.load import described_spread
from armid_ros.identification.fitting.nonlinear import FittedValues, torques
from armid_ros.identification.rows.regression import Regression, regressions
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
import scipy.linalg

#: Inertia that adds less than this share to a standard deviation does not matter.
_NEGLIGIBLE = 0.1


def free_directions(arm: ArmModel, rng: np.random.Generator) -> FloatArray:
    """Return what of the rigid parameters no motion of an arm tells, shape (10 n, k)."""
    rigid = len(arm.robot.rigid_parameters)
    grouping = arm.base_parameters(rng).grouping[:, :rigid]
    return np.asarray(scipy.linalg.null_space(grouping))


def with_uncertain_inertia(
    description: ArmModel,
    fit: FittedValues,
    recordings: Sequence[Recording],
    used: Conditioning,
) -> tuple[FittedValues, tuple[str, ...]]:
    """
    Add to the covariance of the weight what the inertia of the description may be wrong by.

    Parameters
    ----------
    description : ArmModel
        The arm as described, inertia included.
    fit : FittedValues
        The weight and the effects, fitted with that inertia.
    recordings : sequence of Recording
        Training data.
    used : Conditioning
        Filters.

    Returns
    -------
    fit : FittedValues
        With the larger covariance.
    notes : tuple of str
        What inertia is of the torque, and how slow the motion would have to be, where it matters.

    """
    rigid = len(description.robot.rigid_parameters)
    everything = regressions(fit.arm, np.arange(rigid), recordings, used)
    pull = _fit_of(fit.problem, fit.solution.weights, everything) - fit.base.grouping[:, :rigid]
    spread = described_spread(description.robot).ravel() / np.sqrt(3.0)  # of a uniform density
    added = (pull * spread) @ (pull * spread).T
    plain = fit.solution.covariance
    solution = replace(fit.solution, covariance=plain + added)
    ratio = np.sqrt(np.diag(added) / np.maximum(np.diag(plain), 1e-300)).max()
    notes: tuple[str, ...] = ()
    if ratio > _NEGLIGIBLE:
        # the share of inertia in the torque of the description
        still = replace(description, quasi_static=True)
        whole, weight = (
            np.concatenate(torques(arm, recordings, used)) for arm in (description, still)
        )
        share = float(np.linalg.norm(whole - weight) / np.linalg.norm(whole))
        notes = (
            f'too fast for quasi-static: inertia takes {100.0 * share:.2g} % of the torque by the '
            'description, which is taken off, and what that may be wrong by is in the intervals; '
            + _slower(float(ratio)),
        )
    return replace(fit, solution=solution), notes


def _slower(ratio: float) -> str:
    """Say how slow would do: what inertia takes goes with the square of the speed."""
    share = np.sqrt(_NEGLIGIBLE / ratio)
    if share < 0.02:
        return 'no speed is slow enough for torques as free of noise as these'
    return f'at {share:.2g} times the speed it would not matter'


def _fit_of(
    problem: Sequence[Regression], weights: FloatArray, other: Sequence[Regression]
) -> FloatArray:
    """Return what a weighted fit makes of other columns, shape (r, k)."""
    w, d = (
        weights[:, :, np.newaxis] * np.concatenate([part.columns for part in parts])
        for parts in (problem, other)
    )
    w, d = (columns.reshape(-1, columns.shape[2]) for columns in (w, d))
    scale = np.linalg.norm(w, axis=0)
    solution = np.linalg.lstsq(w / scale, d, rcond=None)[0]
    return np.asarray(solution / scale[:, np.newaxis])
