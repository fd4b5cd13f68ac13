# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A cause has changed between two days if recordings of one day do not differ by as much."""

from armid_ros.diagnosis import diagnose
from armid_ros.effects import make_effect
from armid_ros.identification import identify
import numpy as np
import pytest


def with_offsets(bench, seed, offsets):
    """Return recordings of an elbow that has another offset in each [N m]."""

    def on_elbow(offset):
        return lambda motion, tau: np.column_stack([0.0 * motion.t, 0.0 * motion.t + offset])

    return [bench.recordings(on_elbow(x), seed=seed)[k] for k, x in enumerate(offsets)]


@pytest.mark.parametrize(
    'before, after, named',
    [
        pytest.param((0.0, 0.8, 0.1), (0.45, 0.55, 0.5), False, marks=pytest.mark.long),
        ((0.0, 0.05, 0.1), (0.45, 0.55, 0.5), True),
    ],
    ids=['one recording from before had it', 'none had it'],
)
def test_an_offset_that_differs_from_recording_to_recording(bench, before, after, named):
    rng = np.random.default_rng(0)
    old = with_offsets(bench, 1, before)
    arm = bench.arm.with_effect(make_effect('torque_offset', bench.robot))
    arm = identify(arm, old, rng=rng).arm
    new, unseen = with_offsets(bench, 2, after), with_offsets(bench, 3, after)[:1]
    found = diagnose(arm, new, validate=unseen, baseline=old, rng=rng)
    assert [one.name for one in found.findings] == ['torque_offset'] * named, found.summary


def worn(bench, seeds, coulomb):
    """Return recordings of arms that no model describes, with another dry friction each [N m]."""

    def hidden(motion, tau):
        bumps = 0.5 * np.sin(9.0 * motion.q[:, ::-1] + motion.q)
        return bumps + np.column_stack([0.0 * motion.t, coulomb * np.sign(motion.dq[:, 1])])

    return [bench.recordings(hidden, seed=seed)[seed % 3] for seed in seeds]


@pytest.mark.long
def test_many_recordings_tell_a_change_that_is_smaller_than_the_misfit(bench):
    rng = np.random.default_rng(0)
    old, new = worn(bench, range(1, 7), 0.0), worn(bench, range(11, 17), 0.4)
    arm = identify(bench.arm, old, rng=rng).arm
    found = diagnose(arm, new, baseline=old, rng=rng)
    named = [(one.name, one.joints) for one in found.findings]
    assert named == [('coulomb_friction', ('elbow',))], found.summary
