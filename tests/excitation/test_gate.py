# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The check before a motion is sent always leaves a way to rest."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    check_limits,
    Excitation,
    Limits,
    plan_run,
    random_feasible,
    transfer_limits,
    TransferPlanner,
)
from armid_ros.excitation.gate import MotionGate
from armid_ros.robots.reference import Reference
import numpy as np
import pytest


@pytest.fixture(scope='module')
def gate(two_link):
    arm = ArmModel(two_link)
    path = random_feasible(arm, Limits.of(two_link), 2.0, 3, np.random.default_rng(1))
    excitation = Excitation(path, 1, 0.5)
    planner = TransferPlanner(arm, transfer_limits(two_link), None)
    run = plan_run(excitation, planner, excitation.at([0.0]).q[0], 100.0)
    return MotionGate.of(run, planner)


@pytest.mark.parametrize('share', [1.0, 1e-6])
@pytest.mark.parametrize('where', [-1.0, 0.3, 0.7, 2.0])
def test_a_stop_is_sent_on_the_path_whatever_the_acceleration_limit(gate, share, where):
    strict = replace(
        gate, limits=replace(gate.limits, acceleration=share * gate.limits.acceleration)
    )
    phase = float(np.clip(where, 0.0, 1.0)) * gate.run.duration
    motion = strict.stop(where * gate.run.duration, 0.3, *np.full((2, 2), np.nan))
    path = gate.run.at(np.arange(0.0, gate.run.duration + 1e-3, 1e-3)).q
    away = np.abs(motion.q[:, np.newaxis] - path).max(axis=2).min(axis=1)
    assert away.max() < 0.01
    np.testing.assert_allclose(motion.dq[-1], 0.0, atol=1e-9)
    assert np.all(np.abs(motion.dq) <= np.abs(gate.run.motion().dq).max(axis=0) + 1e-9)
    assert np.abs(motion.q[0] - gate.run.at([phase]).q[0]).max() < 0.1


def test_a_run_is_held_to_acceleration_limits_that_are_given(gate, two_link):
    peak = np.abs(gate.run.motion().ddq).max(axis=0)
    robot = replace(two_link, acceleration_limit=np.array([np.inf, 0.9 * peak[1]]))
    planner = TransferPlanner(ArmModel(robot), transfer_limits(robot), None)
    with pytest.raises(TrajectoryError, match=f'{two_link.joints[1]}.*acceleration'):
        MotionGate.of(gate.run, planner)


@pytest.mark.parametrize('limit', [2.0, 0.2])
def test_a_stop_lasts_as_long_as_given_acceleration_limits_require(two_link, limit):
    robot = replace(two_link, acceleration_limit=np.full(2, limit))
    arm = ArmModel(robot)
    path = random_feasible(arm, Limits.of(robot), 10.0, 2, np.random.default_rng(1))
    excitation = Excitation(path, 1, 2.0)
    planner = TransferPlanner(arm, transfer_limits(robot), None)
    run = plan_run(excitation, planner, excitation.at([0.0]).q[0], 100.0)
    gate = MotionGate.of(run, planner)
    for phase in np.linspace(0.0, run.duration, 60):
        motion = gate.stop(phase, 0.1, *np.full((2, 2), np.nan))
        assert np.abs(motion.ddq).max() < 1.05 * limit
        assert motion.t[-1] < 4.8 * max(
            0.1, np.pi / 2.0 * np.abs(run.at([phase]).dq).max() / limit
        )


@pytest.mark.parametrize(('rate', 'harmonics'), [(1.0, 1), (2.0, 3), (10.0, 20)])
def test_a_run_is_sent_with_enough_waypoints_for_its_path(gate, two_link, rate, harmonics):
    excitation = gate.run.excitation
    a, b = np.zeros((2, 2, harmonics))
    a[:, -1] = 0.02 * np.pi * harmonics  # 0.04 rad to and fro, at most twice the rate
    excitation = replace(excitation, trajectory=replace(excitation.trajectory, a=a, b=b))
    robot = replace(two_link, acceleration_limit=np.full(2, 100.0))
    planner = TransferPlanner(ArmModel(robot), transfer_limits(robot), None)
    start = excitation.at([0.0]).q[0]
    with pytest.raises(TrajectoryError, match='waypoints'):
        plan_run(excitation, planner, start, rate)
    run = plan_run(excitation, planner, start, 20.0 * rate)
    MotionGate.of(run, planner)
    with pytest.raises(TrajectoryError, match='waypoints'):
        MotionGate.of(replace(run, rate=rate), planner)


def test_a_run_is_held_to_assumed_acceleration_limits(gate, two_link):
    planner = TransferPlanner(ArmModel(two_link), transfer_limits(two_link), None)
    path = gate.run.excitation.trajectory.scaled(0.05).stretched(0.125)
    fast = replace(gate.run.excitation, trajectory=path)
    run = plan_run(fast, planner, fast.at([0.0]).q[0], 400.0)
    with pytest.raises(TrajectoryError, match='acceleration'):
        MotionGate.of(run, planner)


def test_a_set_point_that_moves_is_held_within_the_acceleration_limits(gate):
    stop = gate.stop(0.6 * gate.run.duration, 0.5, *np.full((2, 2), np.nan))
    k = int(np.argmax(np.abs(stop.dq).max(axis=1)))
    blocked = stop.q[k] - 0.05 * np.sign(stop.dq[k])
    motion = gate.hold(stop.q[k], np.abs(stop.dq[k]), blocked, 0.1)
    played = Reference(motion.joints, motion.t, motion.q, motion.dq, motion.ddq)
    played = played.after(stop.q[k], stop.dq[k], stop.ddq[k])
    played = played.sample(np.linspace(0.0, motion.t[-1], 1000))
    assert not check_limits(gate.limits, played)
