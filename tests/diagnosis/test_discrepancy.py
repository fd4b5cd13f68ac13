# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a model lacks in every motion is no change, wherever the other day has moved."""

from armid_ros.diagnosis import diagnose
from armid_ros.diagnosis.data.discrepancy import discrepancy_columns
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.identification import identify
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest


@pytest.fixture
def data(bench):
    return trajectories(bench.recordings(), Conditioning(200.0, 10.0, 11))


def test_columns_are_a_unit_at_each_knot_and_of_one_joint(bench, data):
    """Hats of position and of velocity add up to one each; friction has a size of one."""
    found = np.concatenate(discrepancy_columns(data, bench.arm))
    each = found.shape[2] // 2
    assert not found[:, 0, each:].any() and not found[:, 1, :each].any()
    own = found[:, 1, each:]
    np.testing.assert_allclose(own[:, :4].sum(axis=1), 1.0)
    np.testing.assert_allclose(own[:, 4:10].sum(axis=1), 1.0)
    np.testing.assert_allclose(np.sqrt(np.mean(own[:, 10:] ** 2, axis=0)), 1.0)


def slow_at_low_speed(bench, motion):
    return [1.0, 0.6] * np.sign(motion.dq) * np.exp(-2.0 * np.abs(motion.dq))


def by_load(bench, motion):
    """Slow motion carries weight, and fast motion the accelerations of the links as well."""
    return 0.1 * np.abs(inverse_dynamics(bench.robot, motion)) * np.sign(motion.dq)


@pytest.mark.slow
@pytest.mark.parametrize(
    ('curve', 'before', 'today'),
    [
        (slow_at_low_speed, 0, 2),
        pytest.param(by_load, 2, 0, marks=pytest.mark.long),
    ],
)
def test_what_the_model_lacks_on_both_days_is_no_change(bench, curve, before, today):
    """Two recordings a day, of other speeds: one curve makes another misfit at each speed."""
    days = [
        bench.recordings(lambda motion, tau: curve(bench, motion), seed=seed)
        for seed in (1, 2, 3, 4)
    ]
    first, second = [day[before] for day in days[:2]], [day[today] for day in days[2:]]
    rng = np.random.default_rng(0)
    arm = identify(bench.arm, first, rng=rng).arm
    found = diagnose(arm, second, baseline=first, rng=rng)
    assert not found.findings, found.summary
