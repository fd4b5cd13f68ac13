# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A payload that is hidden in a MuJoCo arm is named from positions alone."""

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
