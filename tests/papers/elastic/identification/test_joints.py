# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Springs of any arm are found joint by joint, where encoders are on both sides."""

import json

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect, parse_effect
from armid_ros.errors import IdentificationError
from armid_ros.identification import Conditioning
from armid_ros.motion import Motion
from armid_ros.papers.elastic.identification.files import read_sides
from armid_ros.papers.elastic.identification.joints import fit_springs, fit_transmission
from armid_ros.recording.elastic import write_runs
from armid_ros.robots import load_robot
from armid_ros.robots.two_link import planar_pair
from armid_ros.simulation import Reference, Sensors
from armid_ros.simulation.elastic import make_simulated_arm
from armid_ros.simulation.run import record
import numpy as np
import pytest

from docsite.schemas import faults
from tests.cli.conftest import armid

ROBOT = load_robot('humanoid_arm')
STIFFNESS = np.array([2000.0, 3000.0, 1500.0, 1000.0, 500.0, 500.0])
GAP = np.array([0.0, 0.0, 0.0, 5e-4, 0.0, 0.0])


def swing(seed):
    """Return a motion of all joints over 8 s."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 8.0, 4001)
    rate, phase = 2.0 * np.pi * rng.uniform(0.3, 0.6, 6), rng.uniform(0.0, 2.0 * np.pi, 6)
    size = 0.6 * np.minimum((ROBOT.upper - ROBOT.lower) / 2.0, 1.0)
    size = np.minimum(size, 0.8 * ROBOT.velocity_limit / rate)
    middle = (ROBOT.upper + ROBOT.lower) / 2.0
    angle = rate * t[:, np.newaxis] + phase
    q, dq = middle + size * np.sin(angle), size * rate * np.cos(angle)
    return Motion(ROBOT.joints, t, q, dq, -size * rate**2 * np.sin(angle))


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Record the humanoid arm under gravity on springs, with free play in its elbow."""
    arm = ArmModel(ROBOT).with_effect(make_effect('joint_elasticity', ROBOT), 1.0 / STIFFNESS)
    arm = arm.with_effect(make_effect('backlash', ROBOT), GAP)
    for text in (
        'rotor_inertia:rotor_inertia=0.02',
        'viscous_friction:viscous_coefficient=0.2',
        'coulomb_friction:coulomb_torque=0.15',
    ):
        arm = arm.with_effect(*parse_effect(text, ROBOT))
    sensors = Sensors(torque_noise=0.01, resolution=2.0 * np.pi / 2**20)
    live = make_simulated_arm(arm, rng=np.random.default_rng(0), warn=pytest.fail, sensors=sensors)
    runs = [record(live, Reference.of(swing(seed)), rate=500.0).sides for seed in (1, 2)]
    path = tmp_path_factory.mktemp('springs') / 'bag'
    write_runs(path, runs, live.plant.robot)
    return path


@pytest.fixture(scope='module')
def found(bag):
    """Fit the springs."""
    return fit_springs(ROBOT, [read_sides(bag, ROBOT)])


@pytest.mark.long
def test_stiffness_of_every_joint_that_carries_a_load(found):
    for one, wanted in list(zip(found, STIFFNESS, strict=True))[:3]:
        assert one.informative, one.joint
        assert one.transmission.stiffness[0] == pytest.approx(wanted, rel=0.01), one.joint


def test_free_play_is_told_from_the_spring(found):
    fit = found[3].transmission
    assert fit.backlash_seen
    assert fit.backlash[0] == pytest.approx(GAP[3], rel=0.1)
    assert fit.stiffness[0] == pytest.approx(STIFFNESS[3], rel=0.05)
    assert not found[0].transmission.backlash[0] > 2e-4


def test_rotor_and_friction_are_what_the_motor_keeps_for_itself(found):
    for one in found:
        np.testing.assert_allclose(one.motor, [0.02, 0.2, 0.15], rtol=0.08)


def test_armid_elastic_takes_any_arm(bag, tmp_path):
    asked = ('elastic', bag, '--robot', 'humanoid_arm', '--out', tmp_path / 'out')
    assert 'N m/rad' in armid(*asked).stdout
    assert faults('springs', json.loads((tmp_path / 'out' / 'elastic.json').read_text())) == []
    assert (tmp_path / 'out' / 'report.html').is_file()


def test_two_links_are_a_planar_pair_where_they_bear_no_weight():
    assert planar_pair(load_robot('two_link_elastic'))
    assert not planar_pair(load_robot('two_link_elastic', gravity='0,-9.81,0'))
    assert not planar_pair(ROBOT)
    assert not planar_pair(load_robot('humanoid_arm', joints=ROBOT.joints[:2]))


SPRING, BACKLASH = 5e5, 4e-4


USED = Conditioning(250.0, 8.0, 12)


def stretch(rng, *, play=BACKLASH, weight=0.0, delay=0.0):
    """Return both sides of a joint that accelerates, with or without a constant weight."""
    dt = 4e-3
    t = dt * np.arange(2500)
    phases = rng.uniform(0.0, 6.0, 3)
    w = 2.0 * np.pi * np.array([0.3, 0.5, 0.8])
    q = np.sum(0.2 * np.sin(np.outer(t, w) + phases), axis=1)
    velocity = np.sum(0.2 * w * np.cos(np.outer(t, w) + phases), axis=1)
    acceleration = -np.sum(0.2 * w**2 * np.sin(np.outer(t, w) + phases), axis=1)
    load = 100.0 * acceleration + 60.0 * np.cos(2.0 * q) * np.sin(5.0 * t) + weight
    twist = load / SPRING + 0.5 * play * np.tanh(load / 5.0) + delay * velocity
    noise = 2e-6 * rng.standard_normal((2, len(t)))
    motor, link = (
        Motion(('joint',), t, x[:, None], velocity[:, None], acceleration[:, None])
        for x in (q + twist + noise[0] + 0.01, q + noise[1])
    )
    return motor, link, load[:, None]


def holds(interval, value, slack=0.0):
    """Return whether an interval, widened by a share of the value, holds it."""
    return interval[1] - slack * value <= value <= interval[2] + slack * value


def test_free_play_under_a_weight_is_an_offset() -> None:
    rng = np.random.default_rng(2)
    fit = fit_transmission([stretch(rng, weight=5000.0) for _ in range(3)], USED, 0)
    assert np.isnan(fit.backlash[0])
    assert not fit.backlash_seen
    assert holds(fit.stiffness, SPRING, slack=0.1)


def test_a_late_encoder_is_not_taken_for_a_spring() -> None:
    rng = np.random.default_rng(3)
    fit = fit_transmission([stretch(rng, delay=3e-3) for _ in range(3)], USED, 0)
    assert fit.delay[0] == pytest.approx(3e-3, rel=0.05)
    assert holds(fit.stiffness, SPRING, slack=0.1)


def test_a_joint_that_stands_is_refused() -> None:
    still = Motion.of_states(('joint',), np.zeros((200, 1)), 0.0, 0.0)
    with pytest.raises(IdentificationError, match='hardly moves'):
        fit_transmission([(still, still, np.ones((200, 1)))], USED, 0)
