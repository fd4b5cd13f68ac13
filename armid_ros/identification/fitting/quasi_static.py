# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Fit of slow motions: weight is fitted, and inertia is taken from the description.

Even in slow motion, inertia is a part of the torque. It varies with position as the weight does,
and biases the fit. The described torque of inertia is subtracted, and the expected error of the
description is added to the covariance of the weight.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.identification.fitting.excited import near_deviation
from armid_ros.identification.fitting.nonlinear import FittedValues
from armid_ros.identification.rows.regression import regressions, weighted_rows
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.recording import Recording
import numpy as np

#: Negligible deviation due to inertia, over the standard deviation of the fit.
_NEGLIGIBLE = 0.1
#: Slowest motion that the note recommends, as a share of the speed.
_SLOWEST = 0.02


def with_uncertain_inertia(
    description: ArmModel,
    fit: FittedValues,
    recordings: Sequence[Recording],
    used: Conditioning,
) -> tuple[FittedValues, tuple[str, ...]]:
    """
    Add the uncertainty of the described inertia to the covariance.

    Parameters
    ----------
    description : ArmModel
        The arm as described, inertia included.
    fit : FittedValues
        Weight and effects, fitted with that inertia.
    recordings : sequence of Recording
        Training data.
    used : Conditioning
        Filters.

    Returns
    -------
    fit : FittedValues
        Fit with the larger covariance.
    notes : tuple of str
        Speed at which inertia would be negligible, if it is not.

    """
    rigid = len(description.robot.rigid_parameters)
    everything = regressions(fit.arm, np.arange(rigid), recordings, used)
    # base parameters that the weighted fit gives for each column of the body
    rows, body = (
        weighted_rows(part, fit.solution.weights)[0] for part in (fit.problem, everything)
    )
    scale = np.linalg.norm(rows, axis=0)
    made = np.linalg.lstsq(rows / scale, body, rcond=None)[0] / scale[:, np.newaxis]
    pull = made - fit.base.grouping[:, :rigid]
    spread = near_deviation(description.robot)
    added = (pull * spread) @ (pull * spread).T
    plain = fit.solution.covariance
    solution = replace(fit.solution, covariance=plain + added)
    ratio = np.sqrt(np.diag(added) / np.maximum(np.diag(plain), 1e-300)).max()
    notes: tuple[str, ...] = ()
    if ratio > _NEGLIGIBLE:
        # the torque of inertia grows with the square of the speed
        speed = float(np.sqrt(_NEGLIGIBLE / ratio))
        slower = (
            'no speed is slow enough for torques as free of noise as these'
            if speed < _SLOWEST
            else f'at {speed:.2g} times the speed it would not matter'
        )
        notes = (
            'too fast for quasi-static: the described inertia is subtracted, and its possible '
            f'error widens the intervals; {slower}',
        )
    return replace(fit, solution=solution), notes
