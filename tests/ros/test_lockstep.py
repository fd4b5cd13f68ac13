# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""In lock step nothing is lost and the outcome is the same every time."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect, parse_effect
from armid_ros.errors import ArmidError
from armid_ros.excitation import Excitation, Limits, random_feasible
from armid_ros.identification.online import OnlineIdentifier
from armid_ros.nodes.lockstep import EPOCH_NS, replay_lockstep, run_lockstep
from armid_ros.recording import read_recording, topics
from armid_ros.robots import load_robot
from armid_ros.simulation import Sensors, SimulatedArm
import numpy as np
import pytest

RATE = 200.0
APPROACH = 2.5
EFFECTS = ('viscous_friction:viscous_coefficient=0.5', 'torque_offset:torque_offset=0.1')


@pytest.fixture(scope='module')
def robot():
    return load_robot('humanoid_arm', gravity='moon')


@pytest.fixture(scope='module')
def truth(robot):
    arm = ArmModel(robot)
    for effect in EFFECTS:
        arm = arm.with_effect(*parse_effect(effect, robot))
    return arm


@pytest.fixture(scope='module')
def excitation(truth, robot):
    rng = np.random.default_rng(1)
    trajectory = random_feasible(truth, Limits.of(robot, speed='medium'), 4.0, 3, rng)
    return Excitation(trajectory, n_periods=1, run_in=1.0)


def identifier(robot):
    arm = ArmModel(robot)
    for effect in EFFECTS:
        arm = arm.with_effect(make_effect(effect.partition(':')[0], robot))
    return OnlineIdentifier(arm, rng=np.random.default_rng(0))


def run(truth, robot, excitation, bag, **options):
    rng = np.random.default_rng(2)
    arm = SimulatedArm(truth, rng=rng, sensors=Sensors(torque_noise=0.05))
    return run_lockstep(arm, excitation, identifier(robot), bag, rate=RATE, **options)


def test_excite_identify_record_and_replay(truth, robot, excitation, tmp_path):
    told = []
    bag = tmp_path / 'bag'
    result = run(truth, robot, excitation, bag, approach=APPROACH, on_progress=told.append)

    recording = read_recording(bag, joints=robot.joints)
    assert recording.report.clean
    assert recording.start_ns == EPOCH_NS + round(1e9 / RATE)
    np.testing.assert_allclose(np.diff(recording.t), 1.0 / RATE, atol=1e-9)
    assert recording.t[-1] + 1.0 / RATE == pytest.approx(result.t)
    assert result.t == pytest.approx(APPROACH + excitation.duration + 0.5, abs=0.02)
    found = {topic.name: topic.count for topic in topics(bag)}
    assert found['/robot_description'] == found['/joint_trajectory'] == 1
    assert found['/joint_states'] == len(recording) and found['/online_identifier/estimate'] > 10

    middle = APPROACH + excitation.duration / 2.0
    reached = recording.q[np.searchsorted(recording.t, middle - 1.0 / RATE)]
    wanted = excitation.at([middle - APPROACH]).q[0]
    np.testing.assert_allclose(reached, wanted, atol=0.01)

    assert [round(p.t) for p in told] == list(range(1, len(told) + 1))
    error = [
        np.abs(p.estimate.values - identifier(robot).base.values(truth.theta)).max() for p in told
    ]
    assert error[-1] < 0.1 * error[0]

    again = replay_lockstep(bag, identifier(robot), duration=result.t)
    assert again.samples == result.samples
    np.testing.assert_allclose(again.estimate.values, result.estimate.values, rtol=1e-9)


def test_two_runs_give_the_same_samples(truth, robot, excitation, tmp_path):
    recordings = []
    for name in ('first', 'second'):
        run(truth, robot, excitation, tmp_path / name, approach=APPROACH)
        recordings.append(read_recording(tmp_path / name, joints=robot.joints))
    first, second = recordings
    np.testing.assert_array_equal(first.t, second.t)
    np.testing.assert_array_equal(first.q, second.q)
    np.testing.assert_array_equal(first.tau, second.tau)


def test_an_excitation_that_the_arm_refuses_ends_the_run_with_its_reason(
    truth, robot, excitation, tmp_path
):
    with pytest.raises(ArmidError, match='velocity limit'):
        run(truth, robot, excitation, tmp_path / 'bag', approach=0.1)
    assert len(read_recording(tmp_path / 'bag', joints=robot.joints)) > 0
