# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From positions alone: a hidden payload, wrong gains, and a joint that sticks."""

from dataclasses import replace

from armid_ros.diagnosis import diagnose, diagnosis_document
from armid_ros.positions.fit import fit_positions
from armid_ros.positions.loop import CommandedMotion, LoopModel
import numpy as np
import pytest

from benchmarks.two_days import identification_of
from tests.hidden.machines import load_machine
from tests.positions.machine import play, random_chain, Secret

pytestmark = pytest.mark.long


def arm_of(name, rng):
    return random_chain(rng) if name == 'chain' else load_machine(name)


@pytest.mark.parametrize('name', ['chain', 'humanoid_earth', 'ur10'])
def test_a_payload_is_named_with_its_mass(name):
    rng = np.random.default_rng(1)
    robot = arm_of(name, rng)
    model = LoopModel(robot)
    empty = replace(Secret.draw(robot, rng), mass=0.0, center=np.zeros(3), velocities=False)
    mass = 0.05 * float(robot.rigid_parameters[::10].sum())
    loaded = replace(empty, mass=mass, center=np.array([0.02, -0.03, 0.08]))
    gains = np.array([empty.kp, empty.kd])

    def day(secret, count):
        """Return recordings with the torque of the control."""
        played = [play(robot, secret, rng, duration=12.0) for _ in range(count)]
        runs = [(one, CommandedMotion.of(commands, one)) for one, commands in played]
        found = fit_positions(model, runs[:1], gains)
        torques = [model.with_torque(found.values, *run) for run in runs]
        return [replace(one, source=f'run {k}') for k, one in enumerate(torques)]

    before, after = day(empty, 2), day(loaded, 3)
    arm = identification_of(robot, before).arm
    found = diagnose(
        arm,
        after[:2],
        validate=after[2:],
        baseline=before,
        rng=np.random.default_rng(0),
    )
    document = diagnosis_document(found)
    (named,) = document['effects']
    value = next(one for one in named['parameters'] if one['name'] == 'payload_m')
    assert document['verdict'] == 'named' and named['name'] == 'payload'
    assert named['joints'] == [robot.joints[-1]]
    assert abs(value['value'] - mass) < max(2.5 * value['std'], 0.02 * mass)


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
