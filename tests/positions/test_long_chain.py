# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a longer arm shows: given gains that are wrong, and a joint that sticks."""

from dataclasses import replace

from armid_ros.positions.fit import fit_positions
from armid_ros.positions.loop import CommandedMotion, LoopModel
import numpy as np
import pytest

from tests.positions.machine import play, random_chain

pytestmark = pytest.mark.long
SECONDS = 12.0


@pytest.fixture(scope='module')
def robot():
    return random_chain(np.random.default_rng(3))


@pytest.fixture(scope='module')
def silent(robot, secret):
    """Return positions and commands without velocities."""
    quiet = replace(secret, velocities=False)
    measured, commanded = play(robot, quiet, np.random.default_rng(6), duration=SECONDS)
    return measured, CommandedMotion.of(commanded, measured)


def test_given_gains_separate_viscous_friction_and_wrong_ones_are_named(robot, secret, silent):
    gains = np.array([secret.kp, secret.kd])
    found = fit_positions(LoopModel(robot), [silent], gains)
    viscous = [found.of('viscous_coefficient', joint)[0] for joint in robot.joints]
    np.testing.assert_allclose(viscous, secret.viscous, rtol=0.05)
    assert np.all(np.abs(found.gain_ratio - 1.0) < 3.0 * found.gain_ratio_std)
    wrong = fit_positions(LoopModel(robot), [silent], gains * [[1.2], [1.0]])
    np.testing.assert_allclose(wrong.gain_ratio, 1.0 / 1.2, rtol=0.06)


def test_nothing_but_its_friction_is_seen_of_a_joint_that_sticks(robot, secret):
    jammed = replace(secret, coulomb=np.append(500.0, secret.coulomb[1:]))
    measured, commanded = play(robot, jammed, np.random.default_rng(5), duration=6.0)
    assert np.ptp(measured.q[:, 0]) < 1e-3 < np.ptp(commanded.q[:, 0])
    run = measured, CommandedMotion.of(commanded, measured)
    found = fit_positions(LoopModel(robot), [run], np.array([secret.kp, secret.kd]))
    for name in ('viscous_coefficient', 'rotor_inertia'):
        assert np.isinf(found.of(name, robot.joints[0])[1])
        assert np.isfinite(found.of(name, robot.joints[1])[1])
