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
from armid_ros.identification.fitting.excited import near_deviation
from armid_ros.identification.fitting.nonlinear import FittedValues
from armid_ros.identification.rows.regression import regressions, weighted_rows
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.recording import Recording
import numpy as np

#: Inertia that adds less than this share to a standard deviation does not matter.
_NEGLIGIBLE = 0.1
#: Below this share of the speed no motion is slow enough.
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
        How slow the motion would have to be, where it matters.

    """
    rigid = len(description.robot.rigid_parameters)
    everything = regressions(fit.arm, np.arange(rigid), recordings, used)
    # what the weighted fit makes of the columns of the body
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
        # what inertia takes goes with the square of the speed
        speed = float(np.sqrt(_NEGLIGIBLE / ratio))
        slower = (
            'no speed is slow enough for torques as free of noise as these'
            if speed < _SLOWEST
            else f'at {speed:.2g} times the speed it would not matter'
        )
        notes = (
            'too fast for quasi-static: the inertia of the description is taken off, and what it '
            f'may be wrong by is in the intervals; {slower}',
        )
    return replace(fit, solution=solution), notes
