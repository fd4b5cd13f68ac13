# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Export of the parameters of a model as ranges for domain randomisation."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.fitting.least_squares import scaled_inverse
from armid_ros.identification.parameters_file import ParameterFile
from armid_ros.motion import FloatArray
from armid_ros.robots import NO_MASS
from armid_ros.robots.robot import PER_LINK
import numpy as np
import yaml

_HEAD = """\
# Ranges of {robot} for domain randomisation, written by armid export, from {source}.
# low, high: 95 %. from: recordings, or description with {spread:g} of the described value as std.
# Errors are correlated: independent draws scatter the torque more than the recordings do.
# A parameter without std has no standard deviation in the model.
"""


def ranges_text(arm: ArmModel, known: ParameterFile, spread: float, source: str) -> str:
    """
    Return YAML text with the range of each parameter: mean, std, 95 % limits and origin.

    Rows are masses and centres of mass of links, in the frames of their joints, and the parameters
    of effects. The information comes from the recordings: combinations with a covariance, or
    single values. The prior standard deviation of a link's parameters is `spread`, a share of
    the described value. The source of the model is for the comment.

    """
    information = known.information(arm.parameters)
    if information is None:
        stds = [known.values.get(name, (0.0, 0.0))[1] for name in arm.parameters]
        information = np.diag([1.0 / std**2 if std > 0.0 else 0.0 for std in stds])
    rigid = np.maximum(0.5 * spread * arm.robot.described_spread.ravel(), NO_MASS)
    # only the recordings determine the parameters of effects
    others = 1e3 * np.maximum(np.abs(arm.theta[len(rigid) :]), 1.0)
    prior = np.concatenate([rigid, others])
    covariance = scaled_inverse(information + np.diag(prior**-2.0))
    names, values, slopes, lowest = _masses_and_centres(arm)
    estimate = Estimate(names, values, slopes @ covariance @ slopes.T)
    before = np.sqrt(slopes**2 @ prior**2)
    rows = []
    for k, name in enumerate(names):
        determined = bool(estimate.std[k] < 0.5 * before[k])  # by recordings more than by prior
        described = slopes[k, : len(rigid)].any()
        own = float(estimate.std[k]) if determined or described else None
        low, high = estimate.interval()[k].tolist()
        rows.append(
            {
                'name': name.name,
                'joint': name.joint,
                'unit': name.unit,
                'mean': float(values[k]),
                'std': own,
                'low': None if own is None else max(low, float(lowest[k])),
                'high': None if own is None else high,
                'from': None if own is None else 'recordings' if determined else 'description',
            }
        )
    head = _HEAD.format(robot=arm.robot.name, source=' '.join(source.split()), spread=spread)
    document = {'robot': arm.robot.name, 'spread': spread, 'parameters': rows}
    return head + yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=99)


def _masses_and_centres(
    arm: ArmModel,
) -> tuple[tuple[ParameterName, ...], FloatArray, FloatArray, FloatArray]:
    """Return names, values (D,), gradients (D, P) and lower bounds (D,) of exported values."""
    names, found = list(arm.parameters), arm.theta.copy()
    slopes, kept = np.eye(len(found)), np.ones(len(found), dtype=bool)
    rigid = np.tile(np.where(np.arange(PER_LINK) == 0, 0.0, -np.inf), len(arm.robot.links))
    lowest = np.concatenate([rigid, *(effect.bounds()[0] for effect in arm.effects)])
    for first in range(0, len(rigid), PER_LINK):
        joint, mass = names[first].joint, found[first]
        names[first] = ParameterName('mass', joint, 'kg')
        kept[first + 4 : first + PER_LINK] = (
            False  # inertia, which a simulator scales with the mass
        )
        for k, axis in enumerate('xyz', start=first + 1):
            kept[k] = mass > NO_MASS
            if kept[k]:
                names[k] = ParameterName(f'center_{axis}', joint, 'm')
                found[k] /= mass
                slopes[k, k], slopes[k, first] = 1.0 / mass, -found[k] / mass
    chosen = tuple(name for name, keep in zip(names, kept, strict=True) if keep)
    return chosen, found[kept], slopes[kept], lowest[kept]
