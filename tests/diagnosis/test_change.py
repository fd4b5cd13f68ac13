# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Between two days only what differs is named: not what was there, nor what the body can do."""

from dataclasses import replace
from types import SimpleNamespace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import diagnose, known_misfit
from armid_ros.diagnosis.verdict.finding import Finding
from armid_ros.diagnosis.verdict.remarks import with_doubt
from armid_ros.diagnosis.verdict.words import Verdict
from armid_ros.effects import make_effect
from armid_ros.identification import identify
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest

from tests.diagnosis.conftest import Bench, changed_since, drag, UPRIGHT_URDF

HOSE = np.array([1.5, 0.8])


def hose(motion, tau):
    """Return the torque of springs that hang on the arm on both days."""
    return HOSE * np.sin(1.3 * motion.q + 0.4)


@pytest.mark.long
def test_a_slow_recording_that_hardly_shows_a_cause_denies_it_not(bench):
    def stirring(motion, tau):
        return hose(motion, tau) + drag(0.5)(motion, tau)

    after = bench.recordings(stirring, seed=2)[1:]
    slow = bench.recordings(stirring, seed=3)[:1]
    found = changed_since(bench.arm, bench.recordings(hose, seed=1), after, slow)
    assert [one.name for one in found.findings] == ['quadratic_friction'], found.summary


@pytest.mark.long
@pytest.mark.parametrize('of_today', [True, False])
def test_one_recording_with_a_mistake_is_named_among_sound_ones(bench, of_today):
    """It would be a gap without a name, or a misfit in which any change hides."""

    def with_drag(motion, tau):
        return hose(motion, tau) + np.array([0.0, 1.2]) * np.sign(motion.dq)

    rng = np.random.default_rng(0)
    before, after = bench.recordings(hose, seed=1), bench.recordings(with_drag, seed=2)
    arm = identify(bench.arm, before, rng=rng).arm
    days = {True: after, False: before}
    mistaken = days[of_today][1]
    tau = mistaken.tau * [1.0, -1.0]
    days[of_today][1] = replace(mistaken, tau=tau, source='negated')
    found = diagnose(arm, days[True], baseline=days[False], rng=rng)
    assert found.verdict == 'bad_data', found.summary
    assert all(fact in found.summary for fact in ('negated', 'elbow', 'opposite sign'))


@pytest.mark.parametrize('changed', [False, True])
def test_a_baseline_that_the_model_is_not_of_is_doubted(bench, changed):
    """Something happened after the model was identified, and before the baseline."""
    rng = np.random.default_rng(0)

    def with_drag(motion, tau):
        return hose(motion, tau) + np.array([0.0, 2.5]) * np.sign(motion.dq)

    old = bench.recordings(hose, seed=1)
    found = identify(bench.arm, old, rng=rng)
    torque = with_drag if changed else hose
    days = [bench.recordings(torque, seed=seed) for seed in (2, 3)]
    result = diagnose(
        found.arm,
        days[1],
        baseline=days[0],
        misfit=known_misfit(found.arm, old, found.used),
        rng=rng,
    )
    assert result.verdict == 'consistent', result.summary
    assert ('elbow' in result.doubt) == changed
    assert (result.doubt in result.summary) and bool(result.doubt) == changed


def test_joints_that_warm_up_each_by_its_own_share_are_told_so(bench):
    viscous, coulomb = bench.friction
    shares = np.array([-0.35, -0.15])

    def warm(motion, tau):
        own = viscous * motion.dq + coulomb * np.sign(motion.dq)
        return 0.05 * hose(motion, tau) + shares * own

    before = bench.recordings(lambda motion, tau: 0.05 * hose(motion, tau), seed=1)
    after, new = (bench.recordings(warm, seed=seed) for seed in (2, 3))
    found = changed_since(bench.arm, before, after, new)
    assert {one.name for one in found.findings} == {'viscous_friction', 'coulomb_friction'}
    for one in found.findings:
        told, wide = (np.array(each) / one.added_to for each in (one.values, one.std))
        np.testing.assert_allclose(told, shares, atol=5.0 * wide.max())


@pytest.mark.long
@pytest.mark.parametrize('new', ['coulomb_friction', 'viscous_friction'])
def test_a_law_that_all_joints_have_since_is_one_cause(new):
    """It is no factor of the friction that they had, with a rest that looks like other laws."""
    had, more = np.array([0.8, 0.6, 0.4]), np.array([1.0, 0.9, 0.3])
    coulomb = new == 'coulomb_friction'
    old = Bench(UPRIGHT_URDF, *((had, 0.0 * had) if coulomb else (0.0 * had, had)))
    known = 'viscous_friction' if coulomb else 'coulomb_friction'
    arm = ArmModel(old.robot).with_effect(make_effect(known, old.robot), had)

    def law(motion, tau):
        return more * (np.sign(motion.dq) if coulomb else 0.3 * motion.dq)

    before, after, new_ones = (
        old.recordings(hidden, seed) for seed, hidden in enumerate((None, law, law))
    )
    found = changed_since(arm, before, after, new_ones)
    assert found.verdict == 'named', found.summary
    (one,) = found.findings
    assert (one.name, one.joints) == (new, old.robot.joints)
    np.testing.assert_allclose(one.values, more * (1.0 if coulomb else 0.3), atol=0.03)


@pytest.mark.parametrize('of', ['velocity', pytest.param('position', marks=pytest.mark.long)])
def test_a_new_law_that_the_catalogue_lacks_leaves_the_gap_open(bench, of):
    """A cubic drag resembles quadratic friction, and a bump resembles torque ripple."""

    def law(motion, tau):
        dq, q = motion.dq, motion.q
        new = 2.0 * dq**3 if of == 'velocity' else 8.0 * np.exp(-(((q - 0.3) / 0.15) ** 2))
        return 0.1 * hose(motion, tau) + np.array([0.0, 1.0]) * new

    before = bench.recordings(lambda motion, tau: 0.1 * hose(motion, tau), seed=1)
    found = changed_since(
        bench.arm, before, bench.recordings(law, seed=2), bench.recordings(law, seed=3)
    )
    assert found.verdict in {'partial', 'unknown'}, found.summary
    assert {one.joint for one in (*found.where, *found.left)} == {'elbow'}


def test_a_new_law_of_the_catalogue_closes_the_gap(bench):
    """Quadratic friction is named, and no unlisted law, where the gap is only a few misfits."""

    def law(motion, tau):
        return 0.3 * hose(motion, tau) + drag(0.05)(motion, tau)

    before = bench.recordings(lambda motion, tau: 0.3 * hose(motion, tau), seed=1)
    found = changed_since(
        bench.arm, before, bench.recordings(law, seed=2), bench.recordings(law, seed=3)
    )
    assert found.verdict == 'named', found.summary
    assert [one.name for one in found.findings] == ['quadratic_friction']


def test_recordings_with_more_noise_than_the_baseline_have_a_floor_of_their_own(bench):
    """A simulated baseline has no noise at all."""
    floors = []
    for noise in (0.0, 1.0):
        before = bench.recordings(seed=1, noise=noise)
        found = changed_since(bench.arm, before, bench.recordings(seed=2))
        assert found.verdict == 'consistent', found.summary
        floors.append(found.gap.floor)
    np.testing.assert_allclose(floors[0], floors[1], rtol=0.5)


@pytest.mark.parametrize(('name', 'doubted'), [('link_inertia', True), ('payload', False)])
def test_a_link_that_is_named_between_two_days_is_doubted(name, doubted):
    found = Finding(name, ('elbow',), (), (), (), 0.9, (0.8, 1.0), 0.0)
    _, warning = with_doubt(Verdict('named', ''), '', [found], None, SimpleNamespace())
    assert ('exchanged' in warning) == doubted


def test_what_slow_motion_does_not_tell_of_a_body_is_no_change(bench):
    """Inertias that are off show first in faster motion, which is no change of the arm."""
    slow = [bench.recordings(seed=seed)[0] for seed in (1, 2, 3)]
    fast = [bench.recordings(seed=seed)[2] for seed in (4, 5, 6)]
    found = changed_since(bench.arm, slow, fast[:2], fast[2:])
    assert not found.findings, found.summary


@pytest.mark.long
@pytest.mark.parametrize('with_baseline', [True, False])
def test_friction_that_has_become_less_is_named(bench, with_baseline):
    """A value may go down to zero: what is left of it is no bound of what it lost."""
    less = np.array([0.0, -0.2])
    before = bench.recordings(seed=1)
    after, new = (
        bench.recordings(lambda motion, tau: less * np.sign(motion.dq), seed=seed)
        for seed in (2, 3)
    )
    rng = np.random.default_rng(0)
    arm = identify(bench.arm, before, rng=rng).arm
    found = diagnose(arm, after, validate=new, baseline=before if with_baseline else (), rng=rng)
    (first, *others) = found.findings
    assert (first.name, first.joints, others) == ('coulomb_friction', ('elbow',), [])
    assert first.values[0] == pytest.approx(-0.2, abs=4.0 * first.std[0])


def test_a_load_of_a_link_between_two_days_is_a_payload(upright):
    """Links do not change, and something may be fixed to any of them."""
    body = np.zeros(30)
    body[10:20] = [1.0, 0.1, 0.0, 0.2, 0.05, 0.0, 0.06, -0.02, 0.0, 0.02]
    true = upright.robot.with_inertias(upright.robot.rigid_parameters + body)

    def load(motion, tau):
        return inverse_dynamics(true, motion) - inverse_dynamics(upright.robot, motion)

    before, after, new = (upright.recordings(make, k) for k, make in enumerate((None, load, load)))
    (found,) = changed_since(upright.arm, before, after, new).findings
    assert (found.name, found.joints) == ('payload', ('shoulder',))
    values = dict(zip([p.name for p in found.parameters], found.values, strict=True))
    assert values['payload_mz'] == pytest.approx(0.2, rel=0.05)


def test_one_recording_a_day_names_what_takes_most_of_the_gap_alone(bench):
    """Nothing tells a smaller cause from the misfit of another motion."""

    def with_drag(size):
        return lambda motion, tau: (
            hose(motion, tau) + size * np.array([0.0, 1.0]) * np.sign(motion.dq)
        )

    before = bench.recordings(hose, seed=1)[1:2]
    large, small = (
        changed_since(bench.arm, before, bench.recordings(with_drag(size), seed=2)[1:2], ())
        for size in (1.2, 0.7)
    )
    assert [one.name for one in large.findings] == ['coulomb_friction']
    assert any('second motion' in note for note in large.notes)
    assert not small.findings
    assert [one.name for one in small.minor] == ['coulomb_friction']
