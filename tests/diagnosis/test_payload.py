# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A payload on an arm that is described exactly."""

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
