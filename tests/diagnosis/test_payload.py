# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A payload on an arm that is described exactly."""

from dataclasses import replace

from armid_ros.diagnosis import diagnose
from armid_ros.identification import identify
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest

MASS, HEIGHT = 0.6, 0.3


def held_by(robot, link=-1):
    """Return what a body that a link holds, the last one, adds to torques of a motion."""
    parameters = robot.rigid_parameters.copy()
    inertia = MASS * HEIGHT**2
    body = [MASS, 0.0, 0.0, MASS * HEIGHT, inertia, 0.0, inertia, 0.0, 0.0, 0.0]
    parameters.reshape(-1, 10)[link] += body
    true = robot.with_inertias(parameters)
    return lambda motion, tau: inverse_dynamics(true, motion) - inverse_dynamics(robot, motion)


@pytest.mark.parametrize(
    ('arm', 'friction'),
    [('bench', 'named'), pytest.param('upright', 'known', marks=pytest.mark.long)],
)
def test_a_payload_is_named_with_its_mass(request, arm, friction):
    arm = request.getfixturevalue(arm)
    hidden = arm.recordings(held_by(arm.robot))
    model = arm.arm if friction == 'known' else arm.named_friction()
    found = diagnose(model, hidden, rng=np.random.default_rng(0))
    assert found.verdict in ('named', 'ambiguous'), found.summary
    payload = next(finding for finding in found.findings if finding.name == 'payload')
    assert payload.joints == ('elbow',)
    assert payload.values[0] == pytest.approx(MASS, rel=0.05)
    others = {finding.name for finding in found.findings} - {'payload'}
    assert others <= {'viscous_friction', 'coulomb_friction'}


@pytest.mark.long
def test_a_load_of_an_inner_link_may_be_that_link(upright):
    """Both are the same ten values: nothing but what a user knows tells them apart."""
    hidden = upright.recordings(held_by(upright.robot, link=1))
    found = diagnose(upright.arm, hidden, rng=np.random.default_rng(0))
    assert found.verdict == 'ambiguous', found.summary
    (one,) = found.findings
    assert {one.name, *one.ambiguous_with} == {'link_inertia', 'payload'}
    assert one.joints == ('shoulder',)


@pytest.mark.slow
def test_a_payload_that_was_put_down_is_less_than_nothing(bench):
    loaded, now = bench.recordings(held_by(bench.robot)), bench.recordings(seed=7)
    model = identify(bench.arm, loaded, rng=np.random.default_rng(0)).arm
    found = diagnose(model, now, baseline=loaded, rng=np.random.default_rng(0))
    assert found.verdict in ('named', 'ambiguous'), found.summary
    (payload,) = found.findings
    assert (payload.name, payload.joints) == ('payload', ('elbow',))
    values = dict(zip([p.name for p in payload.parameters], payload.values, strict=True))
    assert values['payload_mz'] == pytest.approx(-MASS * HEIGHT, rel=0.05)
    assert 'put down' in found.summary


@pytest.mark.long
def test_a_heavy_load_is_no_fault_of_the_data(bench):
    light = bench.robot.rigid_parameters.copy()
    light[-10:] *= 0.02
    robot = bench.robot.with_inertias(light)
    mass = 8.0
    first = mass * np.array([0.12, 0.0, 0.2])
    reach = (first / mass) @ (first / mass)
    spread = mass * reach * np.eye(3) - np.outer(first, first) / mass + 0.01 * np.eye(3)
    body = [mass, *first, spread[0, 0], 0.0, spread[1, 1], spread[0, 2], 0.0, spread[2, 2]]
    load = light.copy()
    load[-10:] += body
    true = robot.with_inertias(load)
    recordings = bench.recordings(
        lambda m, tau: inverse_dynamics(true, m) - inverse_dynamics(bench.robot, m)
    )
    arm = replace(bench.arm, robot=robot)
    found = diagnose(arm, recordings, rng=np.random.default_rng(0))
    assert found.verdict != 'bad_data', found.summary
    assert found.findings[0].name == 'payload'
    assert found.findings[0].values[0] == pytest.approx(mass, rel=0.05)
