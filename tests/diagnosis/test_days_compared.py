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


@pytest.mark.long
@pytest.mark.parametrize(
    ('before', 'named'),
    [((0.0, 0.8, 0.1), False), ((0.0, 0.05, 0.1), True)],
    ids=['one recording from before had it', 'none had it'],
)
def test_an_offset_that_differs_from_recording_to_recording(bench, before, named):
    rng = np.random.default_rng(0)
    old = with_offsets(bench, 1, before)
    arm = bench.arm.with_effect(make_effect('torque_offset', bench.robot))
    arm = identify(arm, old, rng=rng).arm
    after = 0.45, 0.55, 0.5
    new, unseen = with_offsets(bench, 2, after), with_offsets(bench, 3, after)[:1]
    found = diagnose(arm, new, validate=unseen, baseline=old, rng=rng)
    assert [one.name for one in found.findings] == ['torque_offset'] * named, found.summary
