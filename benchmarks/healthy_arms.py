# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
False alarms among a thousand healthy arms with realistic differences between days.

Summaries of bags are drawn, not bags. Differences between days are not white noise of known size.
Friction depends on a temperature common to all arms, with seasons, and on a temperature of each
arm. Both are correlated over days, and arms differ in their sensitivity. Stated standard
deviations are too small or too large, errors have heavy tails, and bags are missing. Some arms
change, by steps or wear.

    python -m benchmarks.healthy_arms [--arms N] [--bags M] [--fleets F] [--seed S]

"""

import argparse

from armid_ros.changes.histories import judge, ParameterHistory, significant, spreads, without_days
import numpy as np

JOINTS = ('waist', 'shoulder', 'elbow')
#: Name, size, stated standard deviation, and share of friction that depends on temperature.
PARAMETERS = (
    ('viscous_coefficient', 0.6, 0.004, 1.0),
    ('coulomb_torque', 0.5, 0.004, 0.3),
    ('offset', 0.1, 0.002, 0.0),
    ('mx', 1.0, 0.01, 0.0),
    ('ixx', 0.2, 0.005, 0.0),
    ('residual', -3.0, 0.0, 0.0),
)
#: Relative change of friction by season, by the common and by the individual temperature.
SEASON, SHARED, OWN = 0.02, 0.01, 0.01
#: Correlation of the temperatures of successive days.
LASTING = 0.7
#: Share of bags that are missing.
MISSING = 0.1


def lasting(rng, days, size):
    """Draw a first-order autoregressive series over days, with unit standard deviation."""
    values = np.empty(size)
    values[..., 0] = rng.normal(size=size[:-1])
    for day in range(1, days):
        step = np.sqrt(1.0 - LASTING**2) * rng.normal(size=size[:-1])
        values[..., day] = LASTING * values[..., day - 1] + step
    return values


def heavy(rng, size):
    """Draw errors of Student's t distribution with five degrees of freedom, scaled to unit std."""
    return rng.standard_t(5.0, size) * np.sqrt(3.0 / 5.0)


def draw(arms, bags, sick, rng):
    """Return parameter series of a fleet whose first arms change suddenly or by wear."""
    days = np.arange(bags, dtype=float) + 20_000.0
    shared = SEASON * np.sin(2 * np.pi * days / 365.25 + rng.uniform(0, 6.3))
    shared = shared + SHARED * lasting(rng, bags, (bags,))
    found = []
    for arm in range(arms):
        there = rng.random(bags) >= MISSING
        temperature = shared * rng.lognormal(0.0, 0.3) + OWN * lasting(rng, bags, (bags,))
        change = change_of(arm, bags, rng) if arm < sick else None
        for name, level, stated, by_heat in PARAMETERS:
            for joint in JOINTS:
                std = stated * rng.lognormal(0.0, 0.3, bags)
                size = np.maximum(std, 0.04 if name == 'residual' else 0.0)
                noise = size * rng.lognormal(0.0, 0.3) * heavy(rng, bags)
                mean = level * rng.uniform(0.8, 1.25)
                values = mean * (1.0 + by_heat * temperature) + noise
                if change is not None and (name, joint) == change[0]:
                    values = values + change[1] * abs(mean)
                found.append(
                    ParameterHistory(
                        f'arm_{arm}',
                        name,
                        joint,
                        '',
                        *(part[there] for part in (days, values, std)),
                    )
                )
    return found


def change_of(arm, bags, rng):
    """Return the changed parameter of an arm, and its relative change on each day."""
    joint = JOINTS[int(rng.integers(3))]
    start = int(rng.integers(bags // 3, 2 * bags // 3))
    if arm % 2:
        return ('viscous_coefficient', joint), 0.02 * np.maximum(0, np.arange(bags) - start)
    return ('coulomb_torque', joint), np.where(np.arange(bags) >= start, 0.15, 0.0)


def tally(arms, bags, sick, rng, alpha=0.05):
    """Return how many changed arms and how many healthy arms of a fleet are reported."""
    series = draw(arms, bags, sick, rng)
    compared = without_days(series)
    judged = judge([(compared, spreads(compared))])
    found = {one.arm for one in judged if significant(one, alpha)}
    ill = {f'arm_{arm}' for arm in range(sick)}
    return len(found & ill), len(found - ill)


def main():
    """Print how many arms are reported in fleets with and without changes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--arms', type=int, default=1000)
    parser.add_argument('--bags', type=int, nargs='+', default=[10, 30, 90])
    parser.add_argument('--fleets', type=int, default=3)
    parser.add_argument('--seed', type=int, default=0)
    asked = parser.parse_args()
    for bags in asked.bags:
        for sick in (0, asked.arms // 20):
            true = false = quiet = 0
            for fleet in range(asked.fleets):
                rng = np.random.default_rng([asked.seed, bags, sick, fleet])
                one = tally(asked.arms + sick, bags, sick, rng)
                true, false, quiet = true + one[0], false + one[1], quiet + (one[1] == 0)
            share = 100.0 * false / max(1, true + false)
            print(
                f'{asked.fleets} fleets of {asked.arms} healthy arms and {sick} others, {bags} '
                f'days: {true} of {sick * asked.fleets} named, {false} healthy ones ({share:.1f} '
                f'% of those named), none in {quiet} fleets',
                flush=True,
            )


if __name__ == '__main__':
    main()
