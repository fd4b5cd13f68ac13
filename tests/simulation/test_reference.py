# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Waypoints, the curve through them, and what is refused."""

from armid_ros.errors import TrajectoryError
from armid_ros.simulation import Reference
import numpy as np
from numpy.polynomial import Polynomial
import pytest

T = np.array([0.0, 0.3, 1.0, 1.1])
FINE = np.linspace(0.0, 1.1, 200)


def along(polynomials: list[Polynomial], t: np.ndarray) -> np.ndarray:
    return np.stack([p(t) for p in polynomials], axis=1)


def curves(degree: int) -> list[Polynomial]:
    rng = np.random.default_rng(0)
    return [Polynomial(rng.normal(size=degree + 1)) for _ in range(2)]


@pytest.mark.parametrize('degree', [3, 5])
def test_a_cubic_has_the_velocities_of_waypoints_and_a_quintic_their_accelerations(degree) -> None:
    p = curves(degree)
    given = [[c.deriv(order) for c in p] for order in range(3)]
    waypoints = [along(curve, T) for curve in given[: (degree + 1) // 2]]
    motion = Reference(('a', 'b'), T, *waypoints).sample(FINE)
    for values, curve in zip((motion.q, motion.dq, motion.ddq), given, strict=True):
        np.testing.assert_allclose(values, along(curve, FINE), atol=1e-10)


def test_positions_alone_are_joined_by_lines() -> None:
    q = along(curves(3), T)
    motion = Reference(('a', 'b'), T, q).sample(FINE)
    expected = np.stack([np.interp(FINE, T, q[:, j]) for j in range(2)], axis=1)
    np.testing.assert_allclose(motion.q, expected, atol=1e-12)
    np.testing.assert_allclose(motion.dq[1], (q[1] - q[0]) / 0.3)


def test_outside_its_points_or_with_one_alone_a_reference_holds_still() -> None:
    reference = Reference(
        ('a',), np.array([1.0, 2.0]), np.array([[0.1], [0.7]]), np.ones((2, 1)), np.ones((2, 1))
    )
    motion = reference.sample(np.array([0.0, 0.999, 2.001, 100.0]))
    np.testing.assert_array_equal(motion.q[:, 0], [0.1, 0.1, 0.7, 0.7])
    np.testing.assert_array_equal(motion.dq, 0.0)
    np.testing.assert_array_equal(motion.ddq, 0.0)
    pose = Reference(('a', 'b'), np.zeros(1), np.array([[0.1, 0.2]])).sample(FINE)
    np.testing.assert_array_equal(pose.q, np.tile([0.1, 0.2], (len(FINE), 1)))


def test_joints_are_matched_by_name(humanoid) -> None:
    backwards = humanoid.joints[::-1]
    q = np.arange(6.0)[np.newaxis]
    ordered = Reference(backwards, np.zeros(1), q, 10.0 + q, 20.0 + q).for_robot(humanoid)
    assert ordered.joints == humanoid.joints
    np.testing.assert_array_equal(ordered.q, q[:, ::-1])
    np.testing.assert_array_equal(ordered.dq, 10.0 + q[:, ::-1])
    np.testing.assert_array_equal(ordered.ddq, 20.0 + q[:, ::-1])


def test_unknown_and_missing_joints_are_named(humanoid) -> None:
    names = ('elbo', *humanoid.joints[1:])
    with pytest.raises(TrajectoryError, match=r"'elbo' .*shoulder_pitch"):
        Reference(names, np.zeros(1), np.zeros((1, 6))).for_robot(humanoid)
    with pytest.raises(TrajectoryError, match="'shoulder_pitch'"):
        Reference(humanoid.joints[1:], np.zeros(1), np.zeros((1, 5))).for_robot(humanoid)


@pytest.mark.parametrize(
    ('t', 'q', 'message'),
    [
        ([0.0, 1.0, 1.0], np.zeros((3, 1)), r'point 2 .* 1\.0 s'),
        ([0.0, 2.0, 1.0], np.zeros((3, 1)), r'point 2'),
        ([-1.0, 1.0], np.zeros((2, 1)), r'-1\.0 s'),
        ([0.0, np.nan], np.zeros((2, 1)), r'point 1 .* nan s'),
        ([], np.zeros((0, 1)), r'no waypoints'),
        ([0.0, 1.0], np.zeros((3, 1)), r'\(3, 1\)'),
        ([0.0, 1.0], np.array([[0.0], [np.nan]]), r"'a' at point 1"),
    ],
)
def test_malformed_waypoints_are_refused(t, q, message: str) -> None:
    with pytest.raises(TrajectoryError, match=message):
        Reference(('a',), np.array(t), q)


def test_accelerations_without_velocities_and_repeated_joints_are_refused() -> None:
    with pytest.raises(TrajectoryError, match='velocities'):
        Reference(('a',), np.zeros(1), np.zeros((1, 1)), None, np.zeros((1, 1)))
    with pytest.raises(TrajectoryError, match='twice'):
        Reference(('a', 'a'), np.zeros(1), np.zeros((1, 2)))


def test_a_limit_that_only_the_curve_passes_is_found(humanoid) -> None:
    """Both waypoints are inside the limits; the cubic between them is not."""
    upper = humanoid.upper[3]
    q, dq = np.zeros((2, 6)), np.zeros((2, 6))
    q[:, 3] = upper - 0.01
    dq[:, 3] = [1.0, -1.0]
    reference = Reference(humanoid.joints, np.array([0.0, 0.5]), q, dq)
    with pytest.raises(TrajectoryError, match=f"'{humanoid.joints[3]}'.*upper.*{upper:.4g} rad"):
        reference.require_limits(humanoid, 1e-3)
    q[:, 3] = upper - 0.2
    Reference(humanoid.joints, np.array([0.0, 0.5]), q, dq).require_limits(humanoid, 1e-3)


def test_lower_and_velocity_limits_are_named(humanoid) -> None:
    q = np.zeros((2, 6))
    q[1, 0] = humanoid.lower[0] - 0.1
    slow = Reference(humanoid.joints, np.array([0.0, 100.0]), q)
    with pytest.raises(TrajectoryError, match=r"'shoulder_pitch'.*lower"):
        slow.require_limits(humanoid, 1e-3)
    q[1, 0] = 0.5
    fast = Reference(humanoid.joints, np.array([0.0, 0.1]), q)
    with pytest.raises(TrajectoryError, match=r"'shoulder_pitch'.*velocity"):
        fast.require_limits(humanoid, 1e-3)


def test_what_was_to_begin_some_time_ago_is_joined_where_it_is_by_now():
    t = np.linspace(0.0, 4.0, 41)
    q = np.sin(t)[:, np.newaxis]
    whole = Reference(('a',), t, q, np.cos(t)[:, np.newaxis])
    late = whole.remaining(0.55)
    ahead = np.linspace(late.t[0], late.t[-1], 50)
    np.testing.assert_allclose(late.sample(ahead).q, whole.sample(ahead + 0.55).q, atol=1e-9)
    assert 0.5 < late.t[0] < 0.7
    assert whole.remaining(0.0) is whole and whole.remaining(3.0) is whole
