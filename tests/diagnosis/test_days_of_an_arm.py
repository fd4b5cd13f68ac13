# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What happens to an arm from one day to the next: it starts cold, or is leaned on."""

from armid_ros.diagnosis import diagnose
from armid_ros.identification import identify
import numpy as np
import pytest


def since(bench, hidden, always=None):
    """Return the diagnosis of a day on which something is hidden, beside one without it."""

    def today(motion, tau):
        there = 0.0 if always is None else always(motion, tau)
        return there + hidden(motion, tau + there)

    rng = np.random.default_rng(0)
    before = bench.recordings(always, seed=1)
    arm = bench.arm if always is None else identify(bench.arm, before, rng=rng).arm
    return diagnose(arm, bench.recordings(today, seed=2), baseline=before, rng=rng)


@pytest.mark.long
def test_a_joint_that_starts_cold_is_one_cause_of_two_names(bench):
    def cold(motion, tau):
        extra = 0.8 * np.exp(-motion.t / 3.0)[:, np.newaxis] * motion.dq
        return extra * [0.0, 1.0]

    found = since(bench, cold)
    named = {one.name: one for one in found.findings}
    assert list(named) == ['thermal_friction', 'viscous_friction'], found.summary
    assert all(one.joints == ('elbow',) for one in found.findings)
    change, warm_up = named['thermal_friction'].values
    assert change == pytest.approx(-0.8, rel=0.1)
    assert warm_up == pytest.approx(3.0, rel=0.2)
    assert named['viscous_friction'].values[0] == pytest.approx(0.8, rel=0.1)
