# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Motions are consistent to the second derivative, and what the arm does of them is, too."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from tests.hidden.lived.arms import load_arm
from tests.hidden.lived.chain import Chain
from tests.hidden.lived.motions import draw_path, STEP, STYLES, tracked

ROBOT = load_arm('ur5')
CHAIN = Chain.of(ROBOT)


def draw(style, seed=0):
    """Draw a motion and what the arm does of it."""
    wanted = draw_path(style, ROBOT, CHAIN, 16.0, np.random.default_rng(seed))
    return wanted, tracked(wanted, CHAIN, np.full(6, 2e-3))


@pytest.mark.parametrize('style', STYLES)
@pytest.mark.parametrize('which', [0, 1])
def test_integrals_of_the_derivatives_are_the_motion(style, which):
    path = draw(style)[which]
    speed = np.abs(path.dq).max()
    back = path.q[0] + cumulative_trapezoid(path.dq, dx=STEP, axis=0, initial=0.0)
    np.testing.assert_allclose(back, path.q, atol=1e-4 * np.ptp(path.q))
    # an acceleration may jump within a step, where friction or a profile turns
    back = path.dq[0] + cumulative_trapezoid(path.ddq, dx=STEP, axis=0, initial=0.0)
    np.testing.assert_allclose(back, path.dq, atol=1e-2 * speed)


@pytest.mark.parametrize('style', STYLES)
def test_motions_rest_at_both_ends_and_keep_the_limits(style):
    wanted, done = draw(style)
    assert np.all(np.abs(wanted.dq[[0, -1]]) < 1e-2)
    assert np.all(np.abs(done.q - wanted.q) < 0.02)
    assert np.any(np.abs(done.q - wanted.q) > 1e-4)
    assert np.all(wanted.q > ROBOT.lower)
    assert np.all(wanted.q < ROBOT.upper)
    assert np.all(np.abs(wanted.dq).max(axis=0) < ROBOT.velocity_limit)
    assert np.all(np.ptp(wanted.q, axis=0) > 0.1)
