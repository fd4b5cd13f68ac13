# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Limits, and where motions exceed them."""

from dataclasses import replace
from types import SimpleNamespace

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    check_limits,
    Design,
    DesignSettings,
    Excitation,
    FourierTrajectory,
    Limits,
)
from armid_ros.excitation.feasibility import trajectory_faults
import numpy as np
import pytest


@pytest.fixture
def swing(two_link):
    """Both joints, 1 rad to either side in 10 s."""
    w = 2 * np.pi / 10.0
    return FourierTrajectory(
        two_link.joints, 10.0, np.zeros(2), np.full((2, 1), w), np.zeros((2, 1))
    )


@pytest.fixture
def limits(two_link):
    return Limits.of(two_link)


@pytest.mark.parametrize(
    ('change', 'limit', 'value', 'time'),
    [
        ({'upper': [2.0, 0.9]}, 'upper position', 1.0, 2.5),
        ({'lower': [-2.0, -0.5]}, 'lower position', -1.0, 7.5),
        ({'velocity': [2.0, 0.5]}, 'velocity', 2 * np.pi / 10, 0.0),
        ({'acceleration': [9.0, 0.2]}, 'acceleration', -((2 * np.pi / 10) ** 2), 2.5),
    ],
)
def test_violation_names_joint_limit_time_and_value(limits, swing, change, limit, value, time):
    tighter = replace(limits, **{name: np.array(v) for name, v in change.items()})
    (violation,) = check_limits(tighter, swing.one_period(200))
    assert (violation.joint, violation.limit) == ('elbow', limit)
    assert violation.value == pytest.approx(value)
    assert violation.time == pytest.approx(time, abs=0.1)
    assert 'elbow' in str(violation) and limit in str(violation)


def test_a_position_uses_its_limits_by_the_distance_from_the_middle(limits, swing, two_link):
    """A short way beside one end of the range is near a limit; one without an end uses none."""
    motion = swing.one_period(200)  # the joints stay within 1 rad
    beside = replace(limits, lower=np.array([-9.0, -np.inf]), upper=np.array([1.0, np.inf]))
    design = SimpleNamespace(
        excitation=Excitation(swing), limits=beside, settings=DesignSettings()
    )
    shares = Design.limits_used(design, ArmModel(two_link))
    np.testing.assert_allclose(shares['position'], [1.0, 0.0], atol=1e-3)
    assert not any(fault.joint == 'shoulder' for fault in check_limits(beside, motion))


def test_torque_is_compared_with_its_limit(limits, swing, two_link):
    motion = swing.one_period(200)
    torque = ArmModel(two_link).torque(motion)
    assert check_limits(limits, motion, torque) == ()
    weak = replace(limits, torque=np.array([0.9, 2.0]) * np.abs(torque).max(axis=0))
    (violation,) = check_limits(weak, motion, torque)
    assert (violation.joint, violation.limit, violation.unit) == ('shoulder', 'torque', 'N m')


def test_peak_between_the_samples_is_found(limits, swing, two_link):
    between = swing.shifted(0.3 * 10.0 / 200)
    tight = replace(limits, upper=np.array([2.0, 1.0 - 1e-9]))
    assert not check_limits(tight, between.one_period(200))
    assert trajectory_faults(ArmModel(two_link), tight, between, None)


def test_joints_of_another_robot_are_refused(limits, swing):
    other = replace(swing.one_period(10), joints=('elbow', 'shoulder'))
    with pytest.raises(TrajectoryError, match='elbow, shoulder'):
        check_limits(limits, other)


def test_speed_classes_use_a_growing_share_of_the_rates(two_link):
    slow, medium, fast = (Limits.of(two_link, speed=s) for s in ('slow', 'medium', 'fast'))
    assert np.all(slow.velocity < medium.velocity)
    assert np.all(medium.velocity < fast.velocity)
    assert np.all(fast.velocity < two_link.velocity_limit)
    np.testing.assert_array_equal(slow.upper, fast.upper)
    np.testing.assert_allclose(Limits.of(two_link, speed=0.5).velocity, 1.0)


@pytest.mark.parametrize(
    ('speed', 'message'), [('warp', 'slow, medium, fast'), (1.5, r'\(0, 1\]')]
)
def test_unknown_speed_is_refused(two_link, speed, message):
    with pytest.raises(TrajectoryError, match=message):
        Limits.of(two_link, speed=speed)


def test_limits_without_room_are_refused_with_the_joint(limits):
    with pytest.raises(TrajectoryError, match=r'elbow.*room'):
        replace(limits, lower=np.array([-1.0, 1.0]), upper=np.array([1.0, 1.0]))
    with pytest.raises(TrajectoryError, match=r'shoulder.*velocity'):
        replace(limits, velocity=np.array([0.0, 1.0]))
