# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Delay, gains, friction, rotors and tool from positions alone, of arms in MuJoCo."""

from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.positions.fit import fit_positions
from armid_ros.positions.loop import CommandedMotion, LoopModel, windows_of
import numpy as np
import pytest

from tests.positions.machine import play, random_chain

SECONDS = 10.0


@pytest.fixture(scope='module')
def robot():
    return random_chain(np.random.default_rng(3), links=3)


@pytest.fixture(scope='module')
def run(robot, secret):
    """Return positions and commands with velocities."""
    measured, commanded = play(robot, secret, np.random.default_rng(5), duration=SECONDS)
    return measured, CommandedMotion.of(commanded, measured)


def true_values(model, secret):
    truth = secret.truth(model.robot)
    return np.array([truth[one.name, one.joint] for one in model.parameters])


def test_held_commands_are_averaged_over_each_step():
    commands = CommandedMotion(np.array([0.0, 1.0]), np.array([[1.0], [3.0]]), np.zeros((2, 1)))
    q, dq = commands.mean(np.array([-0.5, 0.5, 0.75, 1.25, 5.0]))
    np.testing.assert_allclose(q[:, 0], [1.0, 1.0, 2.0, 3.0])
    assert not dq.any()


def test_the_loop_moves_as_in_an_independent_engine(robot, secret):
    exact = replace(secret, noise=0.0, resolution=1e-9)
    measured, commanded = play(robot, exact, np.random.default_rng(5), duration=6.0)
    commands, model = CommandedMotion.of(commanded, measured), LoopModel(robot)
    windows = list(windows_of(measured, commands))
    simulated = model.simulated(true_values(model, exact), windows)
    for window, q in zip(windows, simulated, strict=True):
        assert np.abs(commands.mean(np.append(window.t, 6.0))[0] - window.q).max() > 0.01
        np.testing.assert_allclose(q, window.q, atol=1e-4)


def test_positions_determine_delay_gains_friction_and_tool(robot, secret, run):
    """Without known gains; most intervals hold the truth, and the residual is the noise."""
    model, (measured, commands) = LoopModel(robot), run
    late = replace(commands, t=commands.t + 100.0)
    with pytest.raises(IdentificationError, match='positions and commands'):
        fit_positions(model, [(measured, late)])
    unaided = fit_positions(model, [run])
    truth, n = true_values(model, secret), robot.n_joints
    friction = slice(3 * n + 1, 5 * n + 1)
    np.testing.assert_allclose(unaided.values[friction], truth[friction], rtol=0.05)
    np.testing.assert_allclose(unaided.values[1 : n + 1], truth[1 : n + 1], rtol=0.05)
    assert unaided.of('command_delay')[0] == pytest.approx(secret.delay, abs=5e-4)
    assert unaided.of('payload_m', robot.joints[-1])[0] == pytest.approx(secret.mass, rel=0.05)
    assert np.mean(np.abs(unaided.values - truth) <= 1.96 * unaided.std) >= 0.85
    noise = np.hypot(secret.noise, secret.resolution / np.sqrt(12.0))
    np.testing.assert_allclose(unaided.residual, noise, rtol=0.1)
    assert np.all(unaided.tracking > 20.0 * unaided.residual)


@pytest.mark.long
def test_viscous_friction_and_velocity_gain_are_one_without_commanded_velocities(robot, secret):
    quiet = replace(secret, velocities=False)
    measured, commanded = play(robot, quiet, np.random.default_rng(6), duration=SECONDS)
    run = measured, CommandedMotion.of(commanded, measured)
    found = fit_positions(LoopModel(robot), [run])
    for joint in robot.joints:
        assert np.isinf(found.of('viscous_coefficient', joint)[1])
        assert np.isfinite(found.of('coulomb_torque', joint)[1])
    assert any('give --gains' in reason for reason in found.reasons)
