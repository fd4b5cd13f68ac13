# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Convert parameter estimates to messages and values for /diagnostics."""

from __future__ import annotations

from armid_msgs.msg import ParameterEstimate
from armid_ros.estimate import Estimate


def estimate_message(
    estimate: Estimate, samples: int, condition_number: float = 0.0
) -> ParameterEstimate:
    """Convert an estimate to a ParameterEstimate message without a time stamp."""
    return ParameterEstimate(
        name=[p.name for p in estimate.parameters],
        joint=[p.joint for p in estimate.parameters],
        unit=[p.unit for p in estimate.parameters],
        value=estimate.values.tolist(),
        std_dev=estimate.std.tolist(),
        samples=samples,
        condition_number=condition_number,
    )


def estimate_values(estimate: Estimate) -> dict[str, float]:
    """Return parameters and the ends of their 95 % intervals by name, for /diagnostics."""
    found: dict[str, float] = {}
    for parameter, value, (lower, upper) in zip(
        estimate.parameters, estimate.values, estimate.interval(), strict=True
    ):
        name = ' '.join(filter(None, (parameter.joint, parameter.name)))
        key = f'{name} [{parameter.unit}]'
        found |= {key: value, f'{key} lower': lower, f'{key} upper': upper}
    return found
