# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A payload on an arm that is described exactly."""

from types import SimpleNamespace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.ranking import CauseResult
from armid_ros.diagnosis.verdict.bodies import is_same_body, on_outer_link
from armid_ros.effects.load import PayloadChange
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest

from .conftest import changed_since, diagnosed, JOINT, LINK, URDF

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
    found = diagnosed(model, hidden)
    assert found.verdict in ('named', 'ambiguous'), found.summary
    payload = next(finding for finding in found.findings if finding.name == 'payload')
    assert payload.joints == ('elbow',)
    assert payload.values[0] == pytest.approx(MASS, rel=0.05)
    others = {finding.name for finding in found.findings} - {'payload'}
    assert others <= {'viscous_friction', 'coulomb_friction'}


def load_on(joint, first_moments, rivals=()):
    """Return a cause: a payload of 0.7 kg on the link of a joint."""
    cause = PayloadChange((joint,)), tuple(range(10))
    values = np.array([0.7, *first_moments, *(6 * [0.01])])
    each = np.full(10, 1e-3)
    return CauseResult(*cause, values, each, each, each, 1.0, 9.0, 9.0, 1.0, 1, 0.45, rivals)


@pytest.mark.parametrize(
    ('joint', 'moments', 'outer', 'other', 'same'),
    [
        ('elbow', (0.0, 0.0, 0.3), 'roll', (1e-3, 1e-3, 0.1), True),
        ('elbow', (0.0, 0.0, 0.3), 'roll', (0.02, 0.0, 0.1), False),  # beside the axis
        ('shoulder', (0.0, 0.0, 0.3), 'roll', (0.0, 0.0, 0.1), False),  # two joints apart
    ],
)
def test_a_load_on_the_axis_of_a_joint_is_assumed_on_the_outer_link(
    joint, moments, outer, other, same
):
    roll = JOINT.format(name='roll', parent='lower', child='hand', height=0.3, axis='0 0 1')
    hand = LINK.format(name='hand', mass=0.4, com=0.05)
    arm = ArmModel.of(URDF.replace('</robot>', f'{hand}{roll}</robot>'))
    rival = load_on(outer, other)
    trial = load_on(joint, moments, (rival,))
    assert is_same_body(trial, rival, arm.robot) == same
    fitted = SimpleNamespace(named=(None,))
    problem = SimpleNamespace(fit=lambda named: named)
    found = Explanation(arm, fitted, fitted, (trial,), None, problem)
    (step,) = on_outer_link(found).steps
    assert step.effect.joints == ((outer,) if same else (joint,))
    assert [one.effect.joints for one in step.rivals] == [(joint,) if same else (outer,)]


@pytest.mark.slow
def test_a_payload_that_was_put_down_is_less_than_nothing(bench):
    loaded, now = bench.recordings(held_by(bench.robot)), bench.recordings(seed=7)
    found = changed_since(bench.arm, loaded, now)
    assert found.verdict in ('named', 'ambiguous'), found.summary
    (payload,) = found.findings
    assert (payload.name, payload.joints) == ('payload', ('elbow',))
    values = dict(zip([p.name for p in payload.parameters], payload.values, strict=True))
    assert values['payload_mz'] == pytest.approx(-MASS * HEIGHT, rel=0.05)
    assert 'put down' in found.summary
