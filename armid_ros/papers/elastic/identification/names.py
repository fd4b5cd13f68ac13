# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The thirteen parameters that are tuned, as a vector with names."""

from __future__ import annotations

from dataclasses import replace

from armid_ros.estimate import ParameterName
from armid_ros.motion import FloatArray
from armid_ros.robots.two_link import TwoLinkParameters
import numpy as np
import numpy.typing as npt

#: Quantities that every joint has, in the order of the vector, with name and unit.
PER_JOINT = (
    ('motor_inertia', 'mm', 'kg m^2'),
    ('stiffness', 'kg', 'N m/rad'),
    ('link_damping', 'dl', 'N m s/rad'),
    ('motor_damping', 'dm', 'N m s/rad'),
    ('spring_damping', 'dg', 'N m s/rad'),
)
SIZE = 3 + 2 * len(PER_JOINT)


def unpack(parameters: TwoLinkParameters) -> FloatArray:
    """Return alpha, beta, gamma, then mm, kg, dl, dm and dg of both joints, shape (13,)."""
    joints = [getattr(parameters, field) for field, _, _ in PER_JOINT]
    return np.concatenate([[parameters.alpha, parameters.beta, parameters.gamma], *joints])


def pack(values: npt.ArrayLike, like: TwoLinkParameters) -> TwoLinkParameters:
    """Return parameters with new values; friction and drives are copied from others."""
    vector = np.asarray(values, dtype=float)
    pairs = vector[3:].reshape(len(PER_JOINT), 2)
    fields = {field: pair for (field, _, _), pair in zip(PER_JOINT, pairs, strict=True)}
    alpha, beta, gamma = vector[:3].tolist()
    return replace(like, alpha=alpha, beta=beta, gamma=gamma, **fields)


def parameter_names(joints: tuple[str, ...]) -> tuple[ParameterName, ...]:
    """Return the names of the vector's elements for an arm with these two joints."""
    rigid = [ParameterName(name, '', 'kg m^2') for name in ('alpha', 'beta', 'gamma')]
    own = [ParameterName(name, joint, unit) for _, name, unit in PER_JOINT for joint in joints]
    return (*rigid, *own)
