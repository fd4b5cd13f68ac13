# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Friction beyond Coulomb and viscous: humps, load, memory, warmth."""

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.model import inverse_dynamics
from armid_ros.motion import Motion
import numpy as np

ELBOW = 3


def elbow_path(robot, q, t=None):
    """Move the elbow along a path and keep the rest still."""
    t = np.arange(len(q)) * 1e-3 if t is None else t
    path = np.tile((robot.lower + robot.upper) / 2, (len(q), 1))
    path[:, ELBOW] = q
    dq = np.gradient(path, t, axis=0)
    return Motion(robot.joints, t, path, dq, np.zeros_like(path))


def test_a_payload_adds_to_the_friction_of_the_joints_that_carry_it(robot, motion):
    """Whichever of the two was added to the arm first."""
    body = np.array([0.5, 0.0, 0.0, 0.05, *[0.0] * 6])
    both = [('load_dependent_friction', np.full(6, 0.1)), ('payload', body)]
    for order in (both, both[::-1]):
        arm = ArmModel(robot)
        for name, values in order:
            arm = arm.with_effect(make_effect(name, robot), values)
        load = inverse_dynamics(arm.body, motion)
        expected = load + 0.1 * np.abs(load) * np.sign(motion.dq)
        np.testing.assert_allclose(arm.torque(motion), expected, atol=1e-12)


def triangle(amplitude, rate, cycles=3):
    """Go to and fro at a constant speed [rad/s], at 1 kHz."""
    period = 4.0 * amplitude / rate
    phase = np.arange(0.0, cycles * period, 1e-3) / period % 1.0
    return 1.0 + amplitude * (1.0 - np.abs(4.0 * phase - 2.0))


def test_presliding_loops_are_the_same_at_any_rate(robot, added):
    loops = []
    for rate in (0.02, 0.08):
        q = triangle(0.02, rate)
        torque = added(elbow_path(robot, q), 'presliding_hysteresis', 0.5, [0.005])[:, ELBOW]
        last = slice(2 * len(q) // 3, None)
        loops.append((q[last], torque[last]))
    for end in (0.99, 1.0, 1.01):
        levels = [np.sort(t[np.abs(q - end) < 1.5e-4])[[0, -1]] for q, t in loops]
        np.testing.assert_allclose(levels[0], levels[1], atol=0.03)


def test_presliding_takes_energy_in_every_loop(robot, added):
    q = triangle(0.004, 0.04, cycles=6)
    torque = added(elbow_path(robot, q), 'presliding_hysteresis', 0.5, [0.005])[:, ELBOW]
    period = len(q) // 6
    for start in range(period, len(q) - period, period):
        loop = slice(start, start + period + 1)
        assert np.trapezoid(torque[loop], q[loop]) > 1e-5


def test_presliding_becomes_coulomb_friction_after_a_long_way(robot, added):
    q = np.concatenate([np.linspace(0.5, 1.0, 500), np.linspace(1.0, 0.5, 500)])
    motion = elbow_path(robot, q)
    presliding = added(motion, 'presliding_hysteresis', 0.5, [0.005])[:, ELBOW]
    coulomb = added(motion, 'coulomb_friction', 0.5)[:, ELBOW]
    far = np.abs(q - 1.0) > 0.06
    np.testing.assert_allclose(presliding[far], coulomb[far], atol=1e-5)
    reversal = np.abs(q - 1.0) < 0.003
    assert np.abs(presliding - coulomb)[reversal].max() > 0.5
