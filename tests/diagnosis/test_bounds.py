# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An effect that is named has a size, and closes what is said of it."""

from armid_ros.diagnosis import diagnose
import numpy as np
import pytest


@pytest.fixture(scope='module')
def lead(bench):
    """Return the diagnosis of an elbow whose torque is read 2 ms too early."""

    def early(motion, tau):
        return 0.002 * np.gradient(tau, motion.t, axis=0) * [0.0, 1.0]

    return diagnose(bench.arm, bench.recordings(early), rng=np.random.default_rng(0))


def test_an_effect_is_not_named_with_a_value_of_zero(lead):
    assert lead.findings
    for finding in lead.findings:
        assert any(abs(v) > 3.0 * s for v, s in zip(finding.values, finding.std, strict=True))


def test_nothing_is_closed_while_a_joint_is_far_above_its_noise(lead):
    elbow = float(lead.explanation.chi2_per_row[1])
    before = float(lead.gap.chi2_before[1])
    assert lead.gap.closed < 1.2 * (1.0 - (elbow - 1.0) / (before - 1.0)) + 0.02
