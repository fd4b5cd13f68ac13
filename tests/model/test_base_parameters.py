# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from armid_ros.arm import ArmModel
from armid_ros.model import (
    random_motion,
    regressor,
    rigid_parameter_names,
)
from armid_ros.robots import load_robot, robot_from_urdf
import numpy as np
import pytest

from tests.diagnosis.conftest import UPRIGHT_URDF

#: The composites of the humanoid-arm paper (its Table 5, completed), lunar gravity [N mm]:
#: expression, without load, with 0.3 kg at the centroid of link 6.
COMPOSITES = [
    ('mx1', 0.648, 0.648),
    ('my1 + mz2', 10.206, 10.206),
    ('mx2', 1.701, 1.701),
    ('my2 + 0.35 (m3 + m4 + m5 + m6) - mz3', 620.136, 790.236),
    ('mx3', 4.455, 4.455),
    ('my3 + mz4', 12.717, 12.717),
    ('mx4', 3.645, 3.645),
    ('my4 + 0.25 (m5 + m6) - mz5', 139.320, 260.820),
    ('mx5', 1.701, 1.701),
    ('my5 + mz6', 6.318, 7.776),
    ('mx6', 0.648, 1.620),
    ('my6', 1.782, 4.455),
]


@pytest.fixture
def rng():
    return np.random.default_rng(3)


@pytest.mark.parametrize(('name', 'column'), [('humanoid_arm', 1), ('humanoid_arm_loaded', 2)])
def test_gravity_composites_are_the_papers(name, column, rng):
    robot = load_robot(name, gravity='moon')
    base = ArmModel(robot, quasi_static=True).base_parameters(rng)
    values = 1e3 * 1.62 * base.values(robot.rigid_parameters)
    assert [p.name for p in base.parameters] == [row[0] for row in COMPOSITES]
    expected = np.array([row[column] for row in COMPOSITES])
    np.testing.assert_allclose(values, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ('gravity', 'rank'),
    [((0.0, 0.0, -9.81), 12), ((0.0, -9.81, 0.0), 10), ((0.0, -6.0, -6.0), 12), (np.zeros(3), 0)],
)
def test_two_composites_less_when_the_first_axis_is_vertical(humanoid, rng, gravity, rank):
    """Turning about a vertical axis lifts nothing: joint 1 sees no gravity and frees no pair."""
    arm = ArmModel(humanoid.with_gravity(gravity), quasi_static=True)
    assert arm.base_parameters(rng).rank == rank


def test_a_lift_has_the_base_parameters_asked_for_and_stays_near(humanoid, rng):
    """A link without mass gets one for its moments."""
    base, prior = ArmModel(humanoid).base_parameters(rng), humanoid.rigid_parameters
    np.testing.assert_allclose(base.lift(base.values(prior), prior), prior, atol=1e-12)
    beta = base.values(prior) + rng.normal(size=base.rank)
    np.testing.assert_allclose(base.values(base.lift(beta, prior)), beta, atol=1e-10)
    lifted = base.lift(beta, np.zeros(60))
    np.testing.assert_allclose(base.values(lifted), beta, atol=1e-9)
    assert np.all(np.abs(lifted[::10]) > 1e-9)


def test_rank_agrees_with_the_singular_values(humanoid, rng):
    robot = humanoid
    y = regressor(robot, random_motion(robot, rng, 200)).reshape(-1, 60)
    s = np.linalg.svd(y, compute_uv=False)
    assert ArmModel(robot).base_parameters(rng).rank == int(np.sum(s > 1e-9 * s[0]))


def hung(angle):
    """Return an upright arm of three joints, hung by a fixed joint."""
    ceiling = (
        '<robot name="upright"><link name="world"/><joint name="ceiling" type="fixed">'
        '<parent link="world"/><child link="base"/>'
        f'<origin xyz="0 0 2" rpy="{angle} 0 0.4"/></joint>'
    )
    text = UPRIGHT_URDF.replace('<robot name="upright">', ceiling)
    return robot_from_urdf(text, gravity='earth')


@pytest.mark.parametrize('angle', ['3.1415926', '3.14159', '3.1416', '3.14'])
def test_what_a_rounded_angle_shows_is_no_parameter(rng, angle):
    """Of 3.1416 first moments of an upright link show by 7e-6 of what others do."""
    exact = ArmModel(hung(repr(np.pi))).base_parameters(rng)
    rounded = ArmModel(hung(angle)).base_parameters(rng)
    assert [exact.standard[k].name for k in exact.independent] == [
        rounded.standard[k].name for k in rounded.independent
    ]
    leaning = ArmModel(hung('3.13')).base_parameters(rng).parameters
    assert any(name.name.startswith('mx1') for name in leaning)


def test_parameters_among_more_keep_their_values(humanoid, rng):
    robot = humanoid
    some = ArmModel(robot).base_parameters(rng)
    longer = (*rigid_parameter_names(robot), *rigid_parameter_names(robot))
    columns = np.arange(60, 120)
    among = some.among(longer, columns)
    theta = rng.normal(size=120)
    np.testing.assert_allclose(among.values(theta), some.values(theta[60:]))
    np.testing.assert_array_equal(among.independent, some.independent + 60)
    lifted = among.lift(some.values(2.0 * theta[60:]), theta)
    np.testing.assert_allclose(lifted[:60], theta[:60])
