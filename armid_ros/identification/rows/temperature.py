# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Mean temperatures of recordings, and change of friction per kelvin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate, name_in_words
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
import numpy as np
from scipy.stats import t as student_t

#: Slopes of friction with temperature, and the friction coefficients that they change.
_SIZES = {'viscous_slope': 'viscous_coefficient', 'coulomb_slope': 'coulomb_torque'}


def mean_temperatures(parts: Sequence[Motion | Recording]) -> dict[str, float] | None:
    """Return each joint's mean temperature [degC]; None if a recording has no temperatures."""
    found = [part.temperature.at(part.t) for part in parts if part.temperature is not None]
    if not found or len(found) < len(parts):
        return None
    means = np.concatenate(found).mean(axis=0)
    known = zip(parts[0].joints, np.round(means, 1).tolist(), strict=True)
    return {joint: mean for joint, mean in known if np.isfinite(mean)}


def at_mean_temperature(arm: ArmModel, recordings: Sequence[Recording]) -> ArmModel:
    """
    Return the arm whose unfitted friction effects have the mean temperature as reference.

    Raises
    ------
    IdentificationError
        If an effect needs temperatures, and a recording has none.

    """
    needing = [effect.name for effect in arm.effects if effect.lasting]
    if not needing:
        return arm
    lacking = [one.source or 'a recording' for one in recordings if one.temperature is None]
    means = mean_temperatures(recordings)
    if means is None:
        raise IdentificationError(
            f'{lacking[0]}: {needing[0]} needs the temperature of each joint: record it as '
            'sensor_msgs/Temperature with the joint as frame_id, or name the columns of a table '
            'with --temperature'
        )
    pairs = zip(arm.effects, arm.values, strict=True)
    effects = [one if values.any() else one.referred_to(means) for one, values in pairs]
    return replace(arm, effects=tuple(effects))


def friction_per_kelvin(arm: ArmModel, estimate: Estimate, scatter: FloatArray) -> tuple[str, ...]:
    """
    Return for each joint a note on the relative change of friction per kelvin.

    The intervals are those of noise, or those of the differences between recordings if wider:
    `scatter`, (K, r), has the jackknife changes of the estimated values without each recording.

    """
    rows = {(name.name, name.joint): k for k, name in enumerate(estimate.parameters)}
    texts = []
    for effect in arm.effects:
        for joint, t0 in effect.reference_temperatures.items():
            parts = []
            for slope, size in _SIZES.items():
                pair = [rows[name, joint] for name in (slope, size) if (name, joint) in rows]
                if len(pair) < 2 or estimate.values[pair[1]] <= HALF_WIDTH * estimate.std[pair[1]]:
                    continue
                change, known = estimate.values[pair]
                ratio = change / known
                by = np.array([1.0, -ratio]) / known
                wide = HALF_WIDTH * float(
                    np.sqrt(by @ estimate.covariance[np.ix_(pair, pair)] @ by)
                )
                if len(scatter) > 1:
                    factor = student_t.ppf(0.975, len(scatter) - 1)
                    wide = max(wide, factor * float(np.linalg.norm(scatter[:, pair] @ by)))
                name = name_in_words(slope).partition(' ')[0]
                parts.append(f'{name} {100 * ratio:+.2f} ± {100 * wide:.2f} %/K')
            if parts:
                texts.append(f'Friction of {joint} at {t0:g} degC: {", ".join(parts)}')
    return tuple(texts)
