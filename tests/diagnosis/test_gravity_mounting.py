# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm on a wall, a ceiling, a slope or another planet, with friction by name only."""

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import diagnose
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

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
        ('y', 37.0, EARTH),
        ('x', 180.0, EARTH),
        ('x', 60.0, MOON),
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
