# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A payload on an arm that is described exactly."""

from armid_ros.diagnosis import diagnose
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest

MASS, HEIGHT = 0.6, 0.3


@pytest.mark.parametrize('friction', ['known', 'named'])
@pytest.mark.parametrize('arm', ['bench', 'upright'])
def test_a_payload_is_named_with_its_mass(request, arm, friction):
    arm = request.getfixturevalue(arm)
    robot = arm.robot
    parameters = robot.rigid_parameters.copy()
    inertia = MASS * HEIGHT**2
    parameters[-10:] += [MASS, 0.0, 0.0, MASS * HEIGHT, inertia, 0.0, inertia, 0.0, 0.0, 0.0]
    true = robot.with_inertias(parameters)
    hidden = arm.recordings(lambda m, tau: inverse_dynamics(true, m) - inverse_dynamics(robot, m))
    model = arm.arm if friction == 'known' else arm.named_friction()
    found = diagnose(model, hidden, rng=np.random.default_rng(0))
    assert found.verdict in ('named', 'ambiguous'), found.summary
    payload = next(finding for finding in found.findings if finding.name == 'payload')
    assert payload.joints == ('elbow',)
    assert payload.values[0] == pytest.approx(MASS, rel=0.05)
    others = {finding.name for finding in found.findings} - {'payload'}
    assert others <= {'viscous_friction', 'coulomb_friction'}
