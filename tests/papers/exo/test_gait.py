# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The shipped gait, and files that are none."""

from armid_ros.errors import TrajectoryError
from armid_ros.papers.exo.plant.gait import read_gait, stance_motion
import numpy as np
import pytest

JOINTS = tuple('abcdef')


def test_the_shipped_gait_has_the_ranges_of_the_source() -> None:
    hip, knee, _ = np.degrees(read_gait()(np.linspace(0.0, 1.0, 2001))).T
    assert (hip.min(), hip.max()) == (
        pytest.approx(-20.0, abs=0.01),
        pytest.approx(40.0, abs=0.01),
    )
    assert (knee.min(), knee.max()) == (
        pytest.approx(0.0, abs=0.01),
        pytest.approx(65.0, abs=0.01),
    )


def test_a_gait_is_periodic_and_knows_its_derivatives() -> None:
    gait, phase, h = read_gait(), np.linspace(0.0, 1.0, 50), 1e-5
    np.testing.assert_allclose(gait(phase), gait(phase + 1.0), atol=1e-12)
    for order in (0, 1):
        slope = (gait(phase + h, order) - gait(phase - h, order)) / (2.0 * h)
        np.testing.assert_allclose(slope, gait(phase, order + 1), atol=1e-5)


def test_the_stance_foot_is_flat_the_trunk_upright_and_legs_are_half_a_cycle_apart() -> None:
    t = np.linspace(0.0, 1.2, 101)
    phase = np.array([t / 1.2, np.full_like(t, 1.0 / 1.2), np.zeros_like(t)])
    motion = stance_motion(read_gait(), JOINTS, t, phase)
    for part in (motion.q, motion.dq, motion.ddq):
        np.testing.assert_allclose(part[:, 0] - part[:, 1] + part[:, 2], 0.0, atol=1e-9)
    np.testing.assert_allclose(motion.q[:51, 3], motion.q[50:, 2], atol=1e-9)


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('time,hip\n', 'phase'),
        ('phase,hip_deg,knee_deg,ankle_deg\n0,1,2,x\n', 'numbers'),
        ('phase,hip_deg,knee_deg,ankle_deg\n0,1,2,3\n', '13'),
    ],
)
def test_what_is_no_gait_is_refused(tmp_path, text, message) -> None:
    path = tmp_path / 'gait.csv'
    path.write_text(text, encoding='utf-8')
    with pytest.raises(TrajectoryError, match=message):
        read_gait(path)
