# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a diagnosis says of arms in which something is hidden, or nothing."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import diagnosis_document
from armid_ros.model import inverse_dynamics
from armid_ros.model.pseudo_inertia import pseudo_inertia
import numpy as np
import pytest

from tests.diagnosis.conftest import diagnosed, drag, on_elbow, TORQUE_NOISE
from tests.diagnosis.test_floor import cut


def test_values_that_are_off_are_no_effect(bench):
    robot = bench.robot
    off = robot.rigid_parameters * np.tile([1.06, 1.04] + [0.95] * 8, robot.n_joints)
    arm = bench.arm.with_theta(np.concatenate([off, [0.32, 0.19], [0.47, 0.32]]))
    found = diagnosed(arm, bench.recordings())
    assert found.verdict == 'consistent'


def test_links_of_a_patched_arm_are_bodies(bench):
    robot = bench.robot
    off = robot.rigid_parameters * np.tile([0.9] + [1.1] * 9, robot.n_joints)
    arm = bench.arm.with_theta(np.concatenate([off, [0.32, 0.19], [0.47, 0.32]]))
    found = diagnosed(arm, bench.recordings(drag(0.08)))
    assert found.refitted
    links = found.arm.robot.rigid_parameters.reshape(-1, 10)
    assert all(np.linalg.eigvalsh(pseudo_inertia(link))[0] > 0.0 for link in links)


def test_a_link_that_is_too_heavy_is_named_instead_of_all_values(bench):
    robot = bench.robot
    heavy = robot.rigid_parameters.reshape(-1, 10).copy()
    heavy[1, 0] += 0.5
    heavy[1, 3] += 0.06
    heavy[1, [4, 6]] += 0.5 * 0.12**2
    true = robot.with_inertias(heavy.ravel())
    weight = bench.recordings(lambda m, _: inverse_dynamics(true, m) - inverse_dynamics(robot, m))
    found = diagnosed(bench.arm, weight)
    names = {n for f in found.findings for n in (f.name, *f.ambiguous_with)}
    assert not found.refitted
    assert names & {'payload', 'link_inertia'}
    (effect,) = diagnosis_document(found)['effects']
    rivals = {rival['name']: rival['joints'] for rival in effect['rivals']}
    assert list(rivals) == effect['ambiguous_with']
    there = {effect['name']: effect['joints'], **rivals}
    assert there['link_inertia'] == there['payload'] == ['elbow']


def test_parameters_of_a_name_are_in_the_order_of_the_joints(bench):
    """The elbow lacks more and is found first."""
    hidden = bench.recordings(lambda m, tau: [0.02, 0.1] * m.dq * np.abs(m.dq))
    found = diagnosed(bench.arm, hidden)
    (finding,) = found.findings
    assert finding.name == 'quadratic_friction'
    assert finding.joints == tuple(p.joint for p in finding.parameters) == ('shoulder', 'elbow')
    errors = np.abs(np.array(finding.values) - [0.02, 0.1])
    assert np.all(errors < 4 * np.array(finding.std))
    assert found.gap.closed > 0.9


def test_all_friction_is_named_of_an_arm_of_which_only_bodies_are_known(bench):
    """Drag that is a thousandth of the gap of all friction brings a joint to its noise, too."""
    hidden = bench.recordings(lambda m, tau: [15.0, 0.0] * np.sign(m.dq))
    found = diagnosed(ArmModel(bench.robot), hidden)
    assert found.verdict in ('named', 'ambiguous')
    values = {
        (p.name, p.joint): v
        for f in found.findings
        for p, v in zip(f.parameters, f.values, strict=True)
    }
    wanted = {
        ('coulomb_torque', 'shoulder'): 15.5,
        ('coulomb_torque', 'elbow'): 0.3,
        ('viscous_coefficient', 'shoulder'): 0.3,
        ('viscous_coefficient', 'elbow'): 0.2,
    }
    assert {name: pytest.approx(value, rel=0.1) for name, value in wanted.items()} == values


def test_a_name_that_does_not_hold_where_the_motion_is_new_is_provisional(bench):
    def drag(size):
        return lambda m, tau: on_elbow(size * m.dq[:, 1] * np.abs(m.dq[:, 1]))

    other = bench.recordings(drag(0.2), seed=5)[-1:]
    found = diagnosed(bench.arm, bench.recordings(drag(0.08)), validate=other)
    assert found.verdict == 'partial'
    assert 'elbow' in found.summary


def test_what_happens_in_one_period_only_is_not_repeatable(bench):
    def bumps(motion, tau):
        t = motion.t
        slow = np.sin(2 * np.pi * (0.3 + 0.05 * t) * t) * np.exp(-(((t - 3.0) / 1.5) ** 2))
        return on_elbow(1.5 * slow)

    found = diagnosed(bench.arm, bench.recordings(bumps))
    assert found.verdict == 'not_repeatable'
    assert 'elbow' in found.summary


@pytest.mark.parametrize(
    ('fault', 'word'),
    [
        (lambda tau: tau * [1.0, -1.0], 'opposite sign'),
        (lambda tau: tau * 1000.0, 'N mm'),
        (lambda tau: tau * 57.2958, 'degrees'),
        (lambda tau: tau[:, ::-1], 'exchanged'),
    ],
)
def test_faults_of_the_data_are_named_before_physics(bench, fault, word):
    spoilt = [replace(r, tau=fault(r.tau)) for r in bench.recordings()]
    found = diagnosed(bench.arm, spoilt)
    assert found.verdict == 'bad_data'
    assert word in found.summary
    assert not found.findings


@pytest.mark.long
def test_friction_that_has_grown_is_named_beside_a_body_that_is_off(upright):
    """Its values are known: a body that is fitted anew does not take the change."""
    inertias = upright.robot.rigid_parameters.reshape(-1, 10).copy()
    inertias[1:] *= np.array([1.15, 0.9])[:, np.newaxis]
    described = replace(upright.arm, robot=upright.robot.with_inertias(inertias.ravel()))
    grown = np.array([0.0, 0.0, 0.35])
    hidden = upright.recordings(lambda motion, tau: grown * np.sign(motion.dq))
    found = diagnosed(described, hidden)
    friction = [one for one in found.findings if one.name == 'coulomb_friction']
    assert [one.joints for one in friction] == [('elbow',)], found.summary
    assert friction[0].values[0] == pytest.approx(0.35, abs=4.0 * friction[0].std[0])


SIZE = np.array([0.03, 0.05])


def cubic_drag(motion, tau):
    """Return a torque that grows with the cube of the speed, which is in no catalogue."""
    return SIZE * motion.dq**3


def left(arm, data):
    """Return the root mean square that an arm leaves of each joint [N m]."""
    rows = [np.where(part.informative, part.residual(arm), np.nan) for part in data]
    return np.sqrt(np.nanmean(np.concatenate(rows) ** 2, axis=0))


@pytest.mark.long
@pytest.mark.parametrize('speed', [0, -1], ids=['slow', 'fast'])
def test_a_substitute_of_cubic_drag_makes_no_joint_worse(bench, speed):
    recordings = bench.recordings(cubic_drag)
    new = [bench.recordings(cubic_drag, seed=50)[speed]]
    found = diagnosed(bench.arm, recordings, validate=new)
    assert found.verdict != 'consistent'
    for seen in (recordings, new):
        data = cut(seen)
        before, after = left(bench.arm, data), left(found.arm, data)
        assert np.all(after < np.maximum(1.05 * before, TORQUE_NOISE)), found.summary
