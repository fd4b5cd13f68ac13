# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm on a wall, a ceiling, a slope or another planet, with friction by name only."""

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import diagnose
from armid_ros.effects import make_effect
from armid_ros.identification import identify
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.lived_scoring import felt_directions
from tests.hidden.lived.adapter import recording_of, robot_of
from tests.hidden.lived.arms import load_arm
from tests.hidden.lived.cases import lived_case
from tests.hidden.lived.chain import Chain

pytestmark = pytest.mark.long

EARTH, MOON = 9.81, 1.62


def gravity_of(arm):
    """Return gravity as a patched arm has it [m/s^2]."""
    bare = ArmModel(arm.robot)
    for effect in arm.effects:
        if effect.name in ('base_tilt', 'gravity_magnitude', 'gravity_vector'):
            changed = effect.action(arm.values_of(effect), bare).robot
            bare = ArmModel(changed)
    return np.array(bare.robot.gravity)


@pytest.mark.parametrize(
    ('axis', 'angle', 'size'),
    [
        ('x', 5.0, EARTH),
        ('y', 37.0, EARTH),
        ('y', 90.0, EARTH),
        ('x', 180.0, EARTH),
        ('x', 60.0, MOON),
        ('x', 0.0, MOON),
    ],
)
def test_any_mounting_is_found_with_friction_that_only_has_names(upright, axis, angle, size):
    robot = upright.robot
    turned = Rotation.from_euler(axis, angle, degrees=True).inv()
    gravity = turned.apply([0.0, 0.0, -size])
    true = robot.with_gravity(gravity)
    hidden = upright.recordings(
        lambda m, tau: inverse_dynamics(true, m) - inverse_dynamics(robot, m)
    )
    found = diagnose(upright.named_friction(), hidden, rng=np.random.default_rng(0))
    assert found.verdict in ('named', 'ambiguous'), found.summary
    names = {finding.name for finding in found.findings}
    assert ('base_tilt' in names) == (angle > 0.0)
    assert ('gravity_magnitude' in names) == (size != EARTH)
    seen = gravity_of(found.arm)
    length = np.linalg.norm(seen)
    assert length == pytest.approx(size, rel=0.02)
    assert np.rad2deg(np.arccos(min(1.0, seen @ gravity / length / size))) < 1.0


def test_fifty_values_of_a_body_and_a_person_are_no_better_than_a_wall():
    case = lived_case('development/mounting', 4)
    recordings = [recording_of(one) for one in case.day_2]
    found = diagnose(ArmModel(robot_of(case)), recordings, rng=np.random.default_rng(0))
    assert found.findings[0].name == 'base_tilt', found.summary
    assert found.findings[0].share > 0.9
    assert 'human_interaction' not in {finding.name for finding in found.findings}
    seen, true = gravity_of(found.arm), case.gravity
    cosine = seen @ true / np.linalg.norm(seen) / np.linalg.norm(true)
    assert np.rad2deg(np.arccos(min(1.0, cosine))) < 1.0
    assert np.linalg.norm(seen) == pytest.approx(np.linalg.norm(true), rel=0.02)


@pytest.mark.parametrize('index', [10, 14, 18])
def test_any_mounting_is_found_with_friction_that_nobody_named(index):
    """Friction that takes little, left out, turned gravity by up to 63 degrees."""
    case = lived_case('development/mounting', index)
    recordings = [recording_of(one) for one in case.day_2]
    found = diagnose(ArmModel(robot_of(case)), recordings, rng=np.random.default_rng(0))
    assert found.verdict == 'named', found.summary
    assert found.findings[0].name in ('base_tilt', 'gravity_magnitude')
    assert found.findings[0].share > 0.8
    names = {finding.name for finding in found.findings}
    friction = {'coulomb_friction', 'viscous_friction', 'torque_offset'}
    assert names <= {'base_tilt', 'gravity_magnitude'} | friction
    felt = felt_directions(Chain.of(load_arm(case.spec.arm)))
    seen, true = felt @ gravity_of(found.arm), felt @ case.gravity
    cosine = seen @ true / np.linalg.norm(seen) / np.linalg.norm(true)
    assert np.rad2deg(np.arccos(min(1.0, cosine))) < 0.2
    assert np.linalg.norm(seen) == pytest.approx(np.linalg.norm(true), rel=0.002)


def test_a_tilt_of_which_the_day_before_told_little_is_not_put_down_to_a_person():
    """A change shows less of itself the less the baseline tells of what it was before."""
    case = lived_case('development', 50)
    before, after = ([recording_of(one) for one in day] for day in (case.day_1, case.day_2))
    arm = ArmModel(robot_of(case))
    for name in ('viscous_friction', 'coulomb_friction', 'torque_offset'):
        arm = arm.with_effect(make_effect(name, arm.robot))
    rng = np.random.default_rng(0)
    model = identify(arm, before, rng=rng).arm
    found = diagnose(
        model, after, validate=[recording_of(case.held_out)], baseline=before, rng=rng
    )
    (tilt,) = found.findings
    assert tilt.name == 'base_tilt', found.summary
    true = {one.name: one.value for one in case.truth[0].parameters}
    for parameter, value, std in zip(tilt.parameters, tilt.values, tilt.std, strict=True):
        assert abs(value - true[parameter.name]) < 3.0 * std
