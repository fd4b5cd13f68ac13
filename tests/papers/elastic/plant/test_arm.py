# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm with elastic joints takes trajectories, and is read on both sides of its springs."""

from operator import attrgetter

from armid_ros.arm import ArmModel
from armid_ros.effects import parse_effect
from armid_ros.motion import Motion
from armid_ros.robots import load_robot
from armid_ros.robots.two_link import two_link_set
from armid_ros.simulation import Reference
from armid_ros.simulation.elastic import (
    elastic_joints,
    make_simulated_arm,
    shipped_arm,
)
from armid_ros.simulation.run import record
from armid_ros.simulation.sensors import accelerometer_readings
import numpy as np
import pytest

SHIPPED = two_link_set('after')
TWO_LINKS = load_robot('two_link_elastic')
HUMANOID = load_robot('humanoid_arm')


def made(arm, **options):
    """Return a simulated arm with elastic joints."""
    rng = np.random.default_rng(0)
    return make_simulated_arm(arm, rng=rng, warn=pytest.fail, **options)


def two_links(**options):
    """Return the shipped arm with its drives."""
    arm, drives = shipped_arm(TWO_LINKS)
    return made(arm, drives=drives, **options)


def humanoid(joints=HUMANOID.joints, **options):
    """Return the humanoid arm under gravity with springs in some joints."""
    effects = (
        'rotor_inertia:rotor_inertia=0.02',
        'viscous_friction:viscous_coefficient=0.1',
        'coulomb_friction:coulomb_torque=0.2',
        f'joint_elasticity@{"+".join(joints)}:compliance=0.0005',
    )
    return made(ArmModel.of(HUMANOID, effects=effects), **options)


def ramp(q, velocity, duration, tau=None):
    """Return the way from a pose at constant velocity."""
    q = np.array([q, q + duration * np.asarray(velocity)])
    return Reference(TWO_LINKS.joints, np.array([0.0, duration]), q, tau=tau)


def test_torque_of_a_trajectory_comes_on_top_of_the_loop():
    pose, torque = np.zeros(2), np.array([[20.0, 0.0], [20.0, 0.0]])
    loop = made(shipped_arm(TWO_LINKS)[0], drives=SHIPPED, gain=1e-9, start=pose)
    loop.set_trajectory(ramp(pose, np.zeros(2), 0.1, torque))
    for _ in range(99):
        sample = loop.advance()
        np.testing.assert_allclose(sample.tau, torque[0], atol=1e-6)
    assert sample.dq[0] > 0.1


@pytest.mark.parametrize('joints', [HUMANOID.joints, HUMANOID.joints[1:4:2]])
def test_it_holds_its_links_where_they_were_and_its_springs_carry_their_weight(joints):
    arm = humanoid(joints)
    home = arm.state.q.copy()
    for _ in range(500):
        sample = arm.advance()
    np.testing.assert_allclose(sample.link.q, home, atol=1e-9)
    compliance = 0.0005 * np.isin(HUMANOID.joints, joints)
    np.testing.assert_allclose(sample.q - sample.link.q, compliance * sample.tau, atol=1e-9)


def test_links_of_any_arm_follow_a_trajectory():
    arm = humanoid()
    goal = arm.state.q + 0.3
    still = np.zeros((1, 6))
    arm.set_trajectory(Reference(HUMANOID.joints, np.array([1.0]), goal[np.newaxis], still, still))
    for _ in range(1500):
        sample = arm.advance()
    np.testing.assert_allclose(sample.link.q, goal, atol=2e-4)
    np.testing.assert_allclose(sample.link.dq, 0.0, atol=1e-4)
    arm.reset(7)
    assert arm.state.steps == 7
    np.testing.assert_allclose(arm.read().link.q, goal - 0.3)


def test_accelerometers_feel_what_their_places_do():
    """Numerical second derivative of where they are, and gravity, in the frames of the links."""
    import pinocchio as pin

    rng = np.random.default_rng(1)
    places = rng.uniform(-0.2, 0.2, (6, 3))
    q, dq, ddq = rng.uniform(-1.0, 1.0, (3, 6))
    model = HUMANOID.model
    data = model.createData()
    where = []
    for t in (-1e-4, 0.0, 1e-4):
        pin.forwardKinematics(model, data, q + t * dq + t**2 / 2 * ddq)
        where.append([data.oMi[j].act(place) for j, place in enumerate(places, 1)])
    world = np.diff(np.array(where), 2, axis=0)[0] / 1e-8 + [0.0, 0.0, 9.81]
    pin.forwardKinematics(model, data, q)
    wanted = [data.oMi[j].rotation.T @ a for j, a in enumerate(world, 1)]
    motion = Motion(HUMANOID.joints, np.arange(2.0), *(np.array([x, x]) for x in (q, dq, ddq)))
    readings = accelerometer_readings(HUMANOID, motion, places)
    np.testing.assert_allclose(readings, np.stack([wanted, wanted], axis=1), atol=1e-5)


def test_springs_need_rotors_to_move_on_their_own():
    arm = ArmModel(HUMANOID).with_effect(
        *parse_effect('joint_elasticity:compliance=0.001', HUMANOID)
    )
    assert elastic_joints(arm) == ((), HUMANOID.joints)
    elbow = HUMANOID.joints[3]
    effect = parse_effect(f'rotor_inertia@{elbow}:rotor_inertia=0.1', HUMANOID)
    assert elastic_joints(arm.with_effect(*effect))[0] == (elbow,)
    assert elastic_joints(ArmModel(HUMANOID)) == ((), ())


def test_no_more_torque_is_read_than_the_drives_have():
    """What a loop asks for beyond that is cut off before it is given, reported and recorded."""
    arm = humanoid()
    goal = arm.state.q + 0.1
    arm.set_trajectory(Reference(HUMANOID.joints, np.array([0.06]), goal[np.newaxis]))
    tau = np.array([arm.advance().tau for _ in range(60)])
    limit = HUMANOID.torque_limit
    assert np.any(np.abs(tau) == limit)
    assert np.all(np.abs(tau) <= limit)


def test_a_run_has_what_its_samples_would_have_been():
    """Sample by sample or as a whole: one arm, without noise."""
    pose, velocity = np.array([0.0, np.pi / 4]), np.array([1.0, -1.0])
    reference = ramp(pose, velocity, 0.3, np.array([[5.0, 0.0], [0.0, 5.0]]))
    run, arm = record(two_links(), reference, rate=250.0).sides, two_links()
    arm.start_on(reference)
    samples = [arm.read(), *(arm.advance(4) for _ in range(len(run.motor) - 1))]
    for name, values in (
        ('q', run.motor.q),
        ('dq', run.motor.dq),
        ('tau', run.motor.tau),
        ('link.q', run.link.q),
        ('link.dq', run.link.dq),
        ('link.acceleration', run.felt.transpose(1, 0, 2)),
    ):
        wanted = [attrgetter(name)(sample) for sample in samples]
        np.testing.assert_allclose(values, wanted, atol=1e-9, err_msg=name)
    np.testing.assert_allclose(run.reference, np.tile(velocity, (len(samples), 1)), atol=1e-9)
