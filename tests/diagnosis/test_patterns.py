# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which described value is wrong, by the pattern of what has changed, and what a user knows."""

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import DiagnosisSettings
from armid_ros.errors import ModelError
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.diagnosis.conftest import diagnosed
from tests.diagnosis.test_payload import held_by

EARTH, MOON = 9.81, 1.62


def names(found):
    """Return all names that what was found may be."""
    return {name for f in found.findings for name in (f.name, *f.ambiguous_with)}


def test_a_factor_in_one_joint_is_a_gain_of_its_drive(bench):
    hidden = bench.recordings(lambda m, tau: 0.05 * tau * [0.0, 1.0])
    found = diagnosed(bench.arm, hidden)
    (finding,) = found.findings
    assert (finding.name, finding.joints) == ('torque_gain', ('elbow',))
    assert finding.values[0] == pytest.approx(0.05, abs=0.002)


def test_what_gravity_alone_enters_is_gravity(bench):
    share = MOON / EARTH
    moon = bench.robot.with_gravity(share * bench.robot.gravity)
    hidden = bench.recordings(
        lambda m, tau: inverse_dynamics(moon, m) - inverse_dynamics(bench.robot, m)
    )
    found = diagnosed(bench.arm, hidden)
    (finding,) = found.findings
    assert finding.name == 'gravity_magnitude'
    assert finding.values[0] == pytest.approx(MOON - EARTH, rel=0.02)
    assert not names(found) & {'payload', 'link_inertia', 'torque_gain'}


def gravity_of(arm):
    """Return gravity as a patched arm has it [m/s^2]."""
    bare = ArmModel(arm.robot)
    for effect in arm.effects:
        if effect.name in ('base_tilt', 'gravity_magnitude'):
            changed = effect.action(arm.values_of(effect), bare).robot
            bare = ArmModel(changed)
    return np.array(bare.robot.gravity)


@pytest.mark.long
@pytest.mark.parametrize(
    ('axis', 'angle', 'size'),
    [
        ('y', 37.0, EARTH),
        ('x', 180.0, EARTH),
        ('x', 60.0, MOON),
    ],
)
def test_any_mounting_is_found_with_friction_that_only_has_names(upright, axis, angle, size):
    """An arm is on a wall, a ceiling, a slope or another planet."""
    robot = upright.robot
    turned = Rotation.from_euler(axis, angle, degrees=True).inv()
    gravity = turned.apply([0.0, 0.0, -size])
    true = robot.with_gravity(gravity)
    hidden = upright.recordings(
        lambda m, tau: inverse_dynamics(true, m) - inverse_dynamics(robot, m)
    )
    found = diagnosed(upright.named_friction(), hidden)
    assert found.verdict in ('named', 'ambiguous'), found.summary
    names = {finding.name for finding in found.findings}
    assert ('base_tilt' in names) == (angle > 0.0)
    assert ('gravity_magnitude' in names) == (size != EARTH)
    seen = gravity_of(found.arm)
    length = np.linalg.norm(seen)
    assert length == pytest.approx(size, rel=0.02)
    assert np.rad2deg(np.arccos(min(1.0, seen @ gravity / length / size))) < 1.0


@pytest.mark.parametrize(
    ('never', 'named'),
    [
        ('payload', 'link_inertia'),
        pytest.param('link_inertia', 'payload', marks=pytest.mark.long),
    ],
)
def test_what_never_happens_is_not_named_where_something_else_explains_as_much(
    upright, never, named
):
    """A load of an inner link has the same ten values as that link."""
    hidden = upright.recordings(held_by(upright.robot, link=1))
    settings = DiagnosisSettings(prior={never: 'never'})
    found = diagnosed(upright.arm, hidden, settings=settings)
    (one,) = found.findings
    assert one.name == named and not one.rivals
    assert any(never in note and 'never' in note for note in found.notes)


@pytest.mark.parametrize(
    'prior', [{'paylaod': 'often'}, {'payload': 'sometimes'}, {'payload': ''}]
)
def test_an_unknown_word_is_named(prior):
    with pytest.raises(ModelError, match='prior'):
        DiagnosisSettings(prior=prior)
