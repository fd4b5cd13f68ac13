# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a planned motion shows of the effects of the catalogue."""

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.next_run.isolability import isolability
from armid_ros.effects import make_effect
from armid_ros.motion import Motion
from armid_ros.report.sections.diagnosed import isolability_section
from armid_ros.robots import load_robot
import numpy as np
import pytest

NOISE, SAMPLES = np.array([0.2, 0.2, 0.1, 0.1, 0.05, 0.05]), 2000.0


@pytest.fixture(scope='module')
def arm():
    return ArmModel(load_robot('humanoid_arm'))


@pytest.fixture(scope='module')
def motion(arm):
    t, n = np.arange(0.0, 20.0, 0.02), arm.robot.n_joints
    w = np.pi * np.arange(1, n + 1) / 10.0
    angle = [np.outer(t, factor * w) + np.arange(n) for factor in (1.0, 2.3)]
    q, dq, ddq = (
        0.3 * sum(f(x) for f, x in zip(parts, angle, strict=True))
        for parts in (
            (np.sin, np.sin),
            (lambda x: w * np.cos(x), lambda x: 2.3 * w * np.cos(x)),
            (lambda x: -(w**2) * np.sin(x), lambda x: -((2.3 * w) ** 2) * np.sin(x)),
        )
    )
    return Motion(arm.robot.joints, t, q + arm.robot.middle_pose, dq, ddq)


@pytest.fixture(scope='module')
def shown(arm, motion):
    return isolability(arm, motion, NOISE, SAMPLES)


def index(shown, name, joints):
    return next(k for k, e in enumerate(shown.effects) if (e.name, e.joints) == (name, joints))


def test_sizes_are_five_deviations_of_a_least_squares_fit(arm, motion, shown):
    effect = make_effect('joint_spring', arm.robot).on(arm.robot, ('elbow_pitch',))
    moving = np.abs(motion.dq) > 0.02 * np.abs(motion.dq).max(axis=0)
    scale = moving * np.sqrt(SAMPLES / len(motion)) / NOISE
    columns = (scale[:, :, None] * arm.columns_of(effect, motion)).reshape(scale.size, -1)
    std = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    found = shown.effects[index(shown, 'joint_spring', ('elbow_pitch',))]
    assert found.parameter.name == 'spring_stiffness'
    assert found.size == pytest.approx(5.0 * std[0])


def test_effects_of_equal_or_nested_columns_are_not_distinguishable(shown):
    last = ('wrist_pitch',)
    payload, link = (index(shown, name, last) for name in ('payload', 'link_inertia'))
    assert shown.apart[payload, link] == pytest.approx(0.0, abs=1e-5)
    offset, spring = (index(shown, name, last) for name in ('torque_offset', 'joint_spring'))
    # The spring has a preload, which is an offset, and a slope, which is none.
    assert shown.apart[offset, spring] == pytest.approx(0.0, abs=1e-5)
    assert shown.apart[spring, offset] > 0.3
    assert [one.name for one in shown.rivals(payload)] == ['link_inertia']


def test_kinds_have_the_least_difference_of_all_places(shown):
    kinds, apart = shown.of_kinds()
    assert set(kinds) <= {one.name for one in shown.effects}
    a, b = kinds.index('time_delay'), kinds.index('torque_lag')
    assert apart[a, b] < 0.1 < apart[a, kinds.index('rotor_inertia')]
    assert np.all((apart >= 0.0) & (apart <= 2.0))


def test_the_map_of_the_report_marks_what_another_effect_reproduces(shown):
    kinds, apart = shown.of_kinds()
    rows = isolability_section(shown).blocks[-1].rows
    row = rows[kinds.index('payload')][1:]
    assert row[kinds.index('link_inertia')].text == '='
    assert row[kinds.index('link_inertia')].shade > 50
    assert [cell.shade for cell in row] == [
        round(55 * (1 - x)) for x in apart[kinds.index('payload')]
    ]
