# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Remarks on data: unchecked joints, a cold start in degrees, and wear at equal temperature."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.trajectory import not_shown, Trajectory
from armid_ros.diagnosis.verdict.finding import Finding
from armid_ros.effects import CATALOGUE, Effect
from armid_ros.estimate import name_in_words
from armid_ros.identification.rows.temperature import mean_temperatures
import numpy as np

#: Smallest difference of two temperatures [K].
_MIN_DIFFERENCE = 2.0


def data_remarks(
    found: Sequence[Finding], arm: ArmModel, now: Sequence[Trajectory], then: Sequence[Trajectory]
) -> Iterator[str]:
    """
    Yield remarks on joints that did not move, and on the temperatures of the diagnosed day.

    Parameters
    ----------
    found : sequence of Finding
        The findings.
    arm : ArmModel
        The model with the named effects.
    now, then : sequence of Trajectory
        Data of the diagnosed day, and of the baseline; without a baseline, the reference
        temperatures of the model are compared.

    """
    still = ', '.join(not_shown(now, arm.robot.joints))
    if still:
        yield f'Not checked: {still} did not move, or turned round all the time.'
    laws = [own for own in arm.effects if own.lasting]
    today = mean_temperatures([part.motion for part in now])
    if today is None and laws:
        yield (
            f'The temperature was not recorded: {name_in_words(laws[0].name)} is taken at the '
            'reference temperature.'
        )
    before = mean_temperatures([part.motion for part in then])
    if before is None and laws:
        before = laws[0].reference_temperatures
    warmer = {
        joint: mean - before[joint]
        for joint, mean in (today or {}).items()
        if before is not None and joint in before
    }
    if not warmer:
        return
    changes: dict[str, list[str]] = {'colder': [], 'warmer': []}
    for joint, share in _changes(laws, arm, now, warmer).items():
        if abs(warmer[joint]) >= _MIN_DIFFERENCE and abs(share) >= 0.03:  # of friction
            changes['colder' if warmer[joint] < 0.0 else 'warmer'].append(
                f'{joint} by {abs(warmer[joint]):.0f} degC (friction {100.0 * share:+.0f} %)'
            )
    than = 'in the baseline' if then else 'at the reference temperature of the model'
    yield from (
        f'{word.capitalize()} than {than}: {", ".join(joints)}.'
        for word, joints in changes.items()
        if joints
    )
    within = max(_spread(now), _spread(then))
    named = any(CATALOGUE[one.name].lasting for one in found if one.name in CATALOGUE)
    # a fifth of the difference within a day separates a law of temperature from wear
    if named and within < 0.2 * max(map(abs, warmer.values())):
        yield (
            'The temperature differs between the days and hardly within them, so wear of the same '
            'size is not excluded: record a day over a range of temperatures.'
        )
    equal = {joint for joint, more in warmer.items() if abs(more) < _MIN_DIFFERENCE}
    yield from _worn(found, equal.union(*(law.joints for law in laws)))


def _worn(found: Sequence[Finding], equal: Collection[str]) -> Iterator[str]:
    """Yield a sentence on friction that changed at equal temperature, in the given joints."""
    names, where = dict[str, None](), dict[str, None]()
    for one in found:
        kinds = [CATALOGUE[name] for name in (one.name, *one.ambiguous_with) if name in CATALOGUE]
        joints = [joint for joint in one.joints if joint in equal]
        rubs = one.name in CATALOGUE and kinds[0].traits.friction
        if joints and rubs and not any(kind.lasting for kind in kinds):
            names[name_in_words(one.name)] = None
            where |= dict.fromkeys(joints)
    if names:
        text = f'{" and ".join(names)} of {", ".join(where)}'
        yield (
            f'{text[0].upper()}{text[1:]} changed at equal temperature: wear or another grease, '
            'not a cold start.'
        )


def _spread(data: Sequence[Trajectory]) -> float:
    """Return the largest standard deviation of the temperature of a joint on a day [K]."""
    found = [part.motion.temperature.at(part.t) for part in data if part.motion.temperature]
    return float(np.nanmax(np.concatenate(found).std(axis=0))) if found else 0.0


def _changes(
    laws: Sequence[Effect],
    arm: ArmModel,
    now: Sequence[Trajectory],
    warmer: dict[str, float],
) -> dict[str, float]:
    """Return the relative change of friction by temperature of each joint, at its mean speed."""
    action, joints = arm.action(), arm.robot.joints
    speed = np.concatenate([np.abs(part.at_rows.dq) for part in now]).mean(axis=0)
    size = np.zeros(len(joints))
    if action.damping is not None:
        size += np.diag(action.damping) * speed
    if action.dry_friction is not None:
        size += action.dry_friction.largest(np.zeros(len(joints)))
    shares = dict.fromkeys(warmer, 0.0)
    for law in laws:
        for joint, slopes in zip(law.joints, arm.values_of(law).reshape(-1, 2), strict=True):
            k = joints.index(joint)
            if joint in warmer and size[k] > 0.0:
                change = slopes[0] * speed[k] + slopes[1]
                shares[joint] += warmer[joint] * float(change) / float(size[k])
    return shares
