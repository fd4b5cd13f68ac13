# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which described value is wrong, by the pattern of what has changed."""

from armid_ros.diagnosis import diagnose
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest


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


def test_links_that_are_off_each_by_its_own_factor_have_no_name(bench, other):
    found = other(links(bench.robot, 0.93, 1.08))
    assert not found.findings


def test_a_factor_in_one_joint_is_a_gain_of_its_drive(bench):
    hidden = bench.recordings(lambda m, tau: 0.05 * tau * [0.0, 1.0])
    found = diagnose(bench.arm, hidden, rng=np.random.default_rng(0))
    (finding,) = found.findings
    assert (finding.name, finding.joints) == ('torque_gain', ('elbow',))
    assert finding.values[0] == pytest.approx(0.05, abs=0.002)


def test_what_gravity_alone_enters_is_gravity(bench, other):
    share = 1.62 / 9.81
    found = other(bench.robot.with_gravity(share * bench.robot.gravity))
    (finding,) = found.findings
    assert finding.name == 'gravity_magnitude'
    assert finding.values[0] == pytest.approx(9.81 * (share - 1.0), rel=0.02)
    assert not names(found) & {'payload', 'link_inertia', 'torque_gain'}


def test_one_direction_of_ten_parameters_is_a_link(bench, other):
    found = other(links(bench.robot, 1.0, 1.1))
    (finding,) = found.findings
    assert 'link_inertia' in names(found)
    assert finding.joints == ('elbow',)
    assert not names(found) & {'gravity_magnitude', 'torque_gain', 'base_tilt'}
