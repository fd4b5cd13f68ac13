# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What differs between two days: by motion, by recording, by time, and by several causes."""

from armid_ros.arm import Misfit
from armid_ros.diagnosis import DiagnosisSettings
from armid_ros.effects import make_effect
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest

from tests.diagnosis.conftest import Bench, changed_since, diagnosed, on_elbow, UPRIGHT_URDF
from tests.diagnosis.test_payload import held_by


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
    found = changed_since(bench.arm, first, second)
    assert not found.findings, found.summary


def with_offsets(bench, seed, offsets):
    """Return recordings of an elbow that has another offset in each [N m]."""
    return [
        bench.recordings(lambda motion, tau, x=x: on_elbow(x + 0.0 * motion.t), seed=seed)[k]
        for k, x in enumerate(offsets)
    ]


@pytest.mark.long
@pytest.mark.parametrize(
    ('before', 'named'),
    [((0.0, 0.8, 0.1), False), ((0.0, 0.05, 0.1), True)],
    ids=['one recording from before had it', 'none had it'],
)
def test_an_offset_that_differs_from_recording_to_recording(bench, before, named):
    old = with_offsets(bench, 1, before)
    arm = bench.arm.with_effect(make_effect('torque_offset', bench.robot))
    after = 0.45, 0.55, 0.5
    new, unseen = with_offsets(bench, 2, after), with_offsets(bench, 3, after)[:1]
    found = changed_since(arm, old, new, unseen)
    assert [one.name for one in found.findings] == ['torque_offset'] * named, found.summary


@pytest.mark.long
def test_a_joint_that_starts_cold_is_one_cause_of_two_names(bench):
    def cold(motion, tau):
        extra = 0.8 * np.exp(-motion.t / 3.0)[:, np.newaxis] * motion.dq
        return extra * [0.0, 1.0]

    before, after = bench.recordings(seed=1), bench.recordings(cold, seed=2)
    found = diagnosed(bench.arm, after, baseline=before)
    named = {one.name: one for one in found.findings}
    assert list(named) == ['thermal_friction', 'viscous_friction'], found.summary
    assert all(one.joints == ('elbow',) for one in found.findings)
    change, warm_up = named['thermal_friction'].values
    assert change == pytest.approx(-0.8, rel=0.1)
    assert warm_up == pytest.approx(3.0, rel=0.2)
    assert named['viscous_friction'].values[0] == pytest.approx(0.8, rel=0.1)


def drag_and_spring(size):
    """Return drag of the shoulder, and a spring at the elbow that is so much weaker."""
    return lambda m, tau: np.array([6.0, 0.0]) * m.dq * np.abs(m.dq) + np.array([0.0, size]) * m.q


def test_a_small_cause_is_named_beside_one_that_takes_everything(bench):
    size = 0.05
    settings = DiagnosisSettings(material=0.0)
    misfit = Misfit('held-out', {'shoulder': 0.01, 'elbow': 0.01}, 0.2)
    hidden = bench.recordings(drag_and_spring(size))
    found = diagnosed(bench.arm, hidden, misfit=misfit, settings=settings)
    large, spring = found.findings
    assert found.verdict == 'named'
    assert (large.name, large.joints) == (
        'quadratic_friction',
        ('shoulder',),
    ) and large.share > 0.99
    assert (spring.name, spring.joints) == ('joint_spring', ('elbow',)) and spring.share < 0.01
    assert spring.values[0] == pytest.approx(size, rel=0.2)


def test_a_cause_that_resembles_two_others_is_exchanged_for_them():
    """A person who pulls is accepted first, and then the spring."""
    bench = Bench(UPRIGHT_URDF, 3 * (0.3,), 3 * (0.5,))
    held = held_by(bench.robot, link=1)

    def both(motion, tau):
        return held(motion, tau) + np.array([0.0, 0.0, 2.0]) * motion.q

    before, after = bench.recordings(seed=1)[:2], bench.recordings(both, seed=2)[:2]
    found = changed_since(bench.arm, before, after)
    assert {one.name for one in found.findings} == {'payload', 'joint_spring'}
