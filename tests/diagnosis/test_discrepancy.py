# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a model lacks in every motion is no change, wherever the other day has moved."""

from armid_ros.diagnosis import diagnose
from armid_ros.diagnosis.data.baseline import described_precision
from armid_ros.diagnosis.data.discrepancy import Discrepancy
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.identification import identify
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.model import BaseParameters, inverse_dynamics
import numpy as np
import pytest


@pytest.fixture
def data(bench):
    return trajectories(bench.recordings(), Conditioning(200.0, 10.0, 11))


@pytest.fixture
def discrepancy(bench, data):
    return Discrepancy.over(data, np.array([0.3, 0.2]), bench.arm)


def test_torque_is_columns_times_values(bench, data, discrepancy):
    values = np.random.default_rng(0).normal(size=len(discrepancy.parameters(bench.robot)))
    arm = bench.arm.with_effect(discrepancy, values)
    motion = data[0].motion
    np.testing.assert_allclose(
        arm.torque(motion) - bench.arm.torque(motion),
        arm.columns_of(discrepancy, motion) @ values,
        atol=1e-12,
    )


def test_between_knots_it_is_linear_and_beyond_them_constant(bench, data, discrepancy):
    law = discrepancy.action(np.arange(22.0) ** 2, bench.arm).link_torque
    first, second = discrepancy.position[1][1:3]
    q, still = np.zeros((3, 2)), np.zeros((3, 2))
    q[:, 1] = first, (first + second) / 2.0, second
    torque = law(np.zeros(3), q, still)[:, 1]
    assert torque[1] == pytest.approx((torque[0] + torque[2]) / 2.0)
    q[:, 1] = discrepancy.position[1][-1], 10.0, 100.0
    assert np.ptp(law(np.zeros(3), q, still)[:, 1]) == 0.0


def test_all_functions_together_are_as_large_as_is_said(bench, discrepancy):
    arm = bench.arm.with_effect(discrepancy)
    count, size = len(arm.parameters), len(discrepancy.parameters(bench.robot))
    own = np.arange(count - size, count)
    base = BaseParameters(
        arm.parameters,
        tuple(arm.parameters[k] for k in own),
        own,
        np.eye(count)[own],
    )
    expected = 3.0 * np.repeat([0.3, 0.2], size // 2) ** -2.0
    np.testing.assert_allclose(described_precision(base, arm), np.diag(expected), atol=1e-9)


def slow_at_low_speed(bench, motion):
    return [1.0, 0.6] * np.sign(motion.dq) * np.exp(-2.0 * np.abs(motion.dq))


def saturating(bench, motion):
    return [1.0, 0.6] * np.tanh(motion.dq)


def of_position(bench, motion):
    return [0.8, 0.48] * np.sin(2.5 * motion.q)


def by_load(bench, motion):
    """Slow motion carries weight, and fast motion the accelerations of the links as well."""
    return 0.1 * np.abs(inverse_dynamics(bench.robot, motion)) * np.sign(motion.dq)


@pytest.mark.slow
@pytest.mark.parametrize(
    ('curve', 'before', 'today'),
    [
        (slow_at_low_speed, 0, 2),
        (saturating, 0, 1),
        (of_position, 1, 2),
        (by_load, 2, 0),
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


def test_a_patched_model_has_none(bench):
    def drag(motion, tau):
        return np.array([0.0, 1.2]) * np.sign(motion.dq)

    rng = np.random.default_rng(0)
    before = bench.recordings(seed=1)
    found = diagnose(bench.arm, bench.recordings(drag, seed=2), baseline=before, rng=rng)
    assert [finding.name for finding in found.findings] == ['coulomb_friction']
    assert [effect.name for effect in found.arm.effects] == [
        'viscous_friction',
        'coulomb_friction',
    ]


def test_what_lasts_does_not_excuse_itself(data):
    """Where the unit is a misfit, the limit of a gap does not depend on how slow the gap is."""
    noise, misfit = np.array([0.03, 0.03]), np.array([0.3, 0.2])
    units = (misfit,) * len(data), (noise,) * len(data)
    evidence, settings = Evidence(tuple(data), *units), DiagnosisSettings()
    white = [np.random.default_rng(0).normal(size=part.torque.shape) for part in data]
    slow = [np.sin(0.5 * part.t)[:, np.newaxis] * np.ones(2) for part in data]
    np.testing.assert_allclose(
        evidence.limits(white, settings), evidence.limits(slow, settings), rtol=1e-12
    )
