# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which described value is wrong, by the pattern of what has changed."""

from armid_ros.diagnosis import diagnose
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest

ANGLE = 0.02

#: Ways in which the decision is not right yet.
A_PAYLOAD = 'a payload that could be there explains what links of an arm in a plane are off by'


def names(found):
    """Return all names that what was found may be."""
    return {name for f in found.findings for name in (f.name, *f.ambiguous_with)}


@pytest.fixture
def other(bench):
    """Return a function that diagnoses recordings of an arm that is not as described."""

    def diagnosed(true):
        def change(motion, tau):
            return inverse_dynamics(true, motion) - inverse_dynamics(bench.robot, motion)

        return diagnose(bench.arm, bench.recordings(change), rng=np.random.default_rng(0))

    return diagnosed


def links(robot, *factors):
    """Return a robot whose links have all their inertial parameters times a factor each."""
    parameters = robot.rigid_parameters.reshape(-1, 10) * np.array(factors)[:, np.newaxis]
    return robot.with_inertias(parameters.ravel())


@pytest.mark.parametrize(
    'factors', [pytest.param((1.06, 0.96), marks=pytest.mark.long), (0.93, 1.08)]
)
def test_links_that_are_off_each_by_its_own_factor_have_no_name(bench, other, factors):
    found = other(links(bench.robot, *factors))
    assert not found.findings


def test_a_factor_in_one_joint_is_a_gain_of_its_drive(bench):
    hidden = bench.recordings(lambda m, tau: 0.05 * tau * [0.0, 1.0])
    found = diagnose(bench.arm, hidden, rng=np.random.default_rng(0))
    (finding,) = found.findings
    assert (finding.name, finding.joints) == ('torque_gain', ('elbow',))
    assert finding.values[0] == pytest.approx(0.05, abs=0.002)


@pytest.mark.parametrize('share', [pytest.param(0.97, marks=pytest.mark.long), 1.62 / 9.81])
def test_what_gravity_alone_enters_is_gravity(bench, other, share):
    found = other(bench.robot.with_gravity(share * bench.robot.gravity))
    (finding,) = found.findings
    assert finding.name == 'gravity_magnitude'
    assert finding.values[0] == pytest.approx(9.81 * (share - 1.0), rel=0.02)
    assert not names(found) & {'payload', 'link_inertia', 'torque_gain'}


@pytest.mark.parametrize('joint', [pytest.param('shoulder', marks=pytest.mark.long), 'elbow'])
def test_one_direction_of_ten_parameters_is_a_link(bench, other, joint):
    factors = [1.1 if name == joint else 1.0 for name in bench.robot.joints]
    found = other(links(bench.robot, *factors))
    (finding,) = found.findings
    assert 'link_inertia' in names(found)
    assert finding.joints == (joint,)
    assert not names(found) & {'gravity_magnitude', 'torque_gain', 'base_tilt'}


def tilted(bench):
    """Return the gravity of a base that leans about the axis of the joints."""
    return 9.81 * np.array([np.sin(ANGLE), 0.0, -np.cos(ANGLE)])


@pytest.mark.long
@pytest.mark.xfail(strict=True, reason='the size of gravity is a value that counts against a tilt')
def test_a_planar_arm_cannot_tell_a_tilt_from_the_zero_of_its_first_encoder(bench, other):
    found = other(bench.robot.with_gravity(tilted(bench)))
    assert names(found) == {'encoder_offset', 'base_tilt'}
    (finding,) = found.findings
    assert max(np.abs(finding.values)) == pytest.approx(ANGLE, abs=0.001)
