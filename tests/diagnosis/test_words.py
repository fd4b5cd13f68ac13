# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sentences say what the evidence bears out, and no more."""

from dataclasses import replace
from types import SimpleNamespace

from armid_ros.diagnosis.data.evidence import NoiseFloor
from armid_ros.diagnosis.search.explain import without_later
from armid_ros.diagnosis.search.explanation import NOISE
from armid_ros.diagnosis.search.trial import Step
from armid_ros.diagnosis.settings import Thresholds
from armid_ros.diagnosis.verdict.finding import Finding, Rival
from armid_ros.diagnosis.verdict.gap import not_repeating
from armid_ros.diagnosis.verdict.naming import (
    _as_looked_at,
    _rivals,
    _separating,
    small_print,
)
from armid_ros.diagnosis.verdict.where import Excess
from armid_ros.diagnosis.verdict.words import (
    decide,
    Hiding,
    names_and_places,
    percent,
    sentence,
    share_in_words,
    Unnamed,
)
from armid_ros.effects import CATALOGUE
from armid_ros.effects.friction import FrictionLevel
from armid_ros.estimate import ParameterName
from armid_ros.report.sections.diagnosed import NamedParameters
import numpy as np
import pytest

FLOOR = 'the misfit that the model had before'


def said(arm, as_it_is):
    closed = Excess(np.full(arm.robot.n_joints, 0.9), 'in the recordings')
    return decide((), (), [closed], arm, FLOOR, as_it_is)


def test_a_model_that_explains_as_it_is_needs_no_fit(bench):
    closed = Excess(np.full(bench.robot.n_joints, 0.8), 'in the recordings')
    for as_it_is in (None, closed):
        verdict = said(bench.arm, as_it_is)
        assert verdict.word == 'consistent'
        assert (
            verdict.summary
            == f'The model explains the recordings: what is left is no more than {FLOOR}.'
        )


@pytest.mark.parametrize('floor', [NOISE, FLOOR])
def test_what_is_there_and_too_small_to_matter_is_said(bench, floor):
    """A Stribeck torque of a hundredth of a joint's torque is no gap, and no noise either."""
    closed = Excess(np.full(bench.robot.n_joints, 0.9), 'in the recordings')
    small = Finding('stribeck_friction', ('elbow',), (), (), (), 0.45, (0.4, 0.5), 0.0)
    summary = decide((), (), [closed], bench.arm, floor, None, Unnamed([small])).summary
    text = 'too small to matter. A stribeck friction in elbow explains 45 % of what is left.'
    assert text in summary
    nothing = replace(small, share=0.001)
    assert (
        'stribeck'
        not in decide((), (), [closed], bench.arm, floor, None, Unnamed([nothing])).summary
    )


def test_a_model_that_is_far_off_in_a_joint_says_how_much_can_hide_there(bench):
    closed = Excess(np.full(bench.robot.n_joints, 0.9), 'in the recordings')
    hides = Hiding(np.array([0.01, 0.13]), np.array([0.014, 0.18]))
    small = small_finding(bench, 0.3)

    def text(minor):
        return decide((), (), [closed], bench.arm, FLOOR, None, Unnamed(minor), hides).summary

    hidden = (
        'In elbow that misfit is 13 % of the torque: a change of up to 18 % of it can hide there'
    )
    assert text(()).endswith(f'is no more than {FLOOR}. {hidden}.')
    assert text([small]).endswith(f'{hidden}, such as the encoder offset of the small print.')
    assert text([replace(small, joints=('shoulder',))]).endswith(f'. {hidden}.')


def test_a_share_is_the_same_text_wherever_it_is_said(bench):
    small = small_finding(bench, 0.3)
    assert share_in_words(small) == '30 % of the gap'
    assert share_in_words(small, interval=True) == '30 % of the gap (20 % to 40 %)'
    beside = replace(small, share=0.001, of_joint=('elbow', 0.94))
    assert share_in_words(beside) == '0.1 % of the gap, and most of what the others leave in elbow'
    assert [percent(x) for x in (0.957, 0.004, 0.0, -1e-5)] == ['96 %', '0.4 %', '0 %', '0 %']


def test_no_value_is_less_than_nothing_by_rounding(bench):
    small = replace(small_finding(bench, 0.3), values=(-1e-6,), std=(0.0007,))
    assert 'encoder offset 0.0000 +- 0.0014 rad' in sentence(small)


def test_a_model_that_has_to_be_fitted_says_so(bench):
    excess = np.full(bench.robot.n_joints, 0.8)
    excess[-1] = 4.0
    verdict = said(bench.arm, Excess(excess, 'in the recordings'))
    assert verdict.word == 'consistent'
    assert 'once its rigid body and friction are fitted' in verdict.summary


def test_what_does_not_repeat_has_to_matter(bench):
    joints = bench.robot.n_joints
    one = np.ones(joints)
    floor = NoiseFloor(0.1 * one, 8.0, 20.0 * one, np.array([0.05, 0.2]), 0.1 * one, one)
    closed = Excess(0.5 * one, 'in the recordings')

    def word(least):
        strange = not_repeating([floor] * 3, bench.arm, Thresholds(), least * one)
        return decide((), strange, [closed], bench.arm, FLOOR)

    assert word(0.1).word == 'not_repeatable'
    assert 'elbow' in word(0.1).summary and 'shoulder' not in word(0.1).summary
    assert word(0.3).word == 'consistent'


def small_finding(bench, share):
    """Return an encoder offset that takes a share of the gap."""
    effect = CATALOGUE['encoder_offset'].on(bench.robot, ('elbow',))
    names = effect.parameters(bench.robot)
    return Finding(
        'encoder_offset',
        ('elbow',),
        names,
        (0.1,),
        (0.01,),
        share,
        (0.2, 0.4),
        0.0,
        sign=effect.traits.sign,
    )


def test_what_is_not_explained_is_said_with_what_explains_most_of_it(bench):
    gap = Excess(4.0 * np.ones(bench.robot.n_joints), 'in the recordings')
    small = small_finding(bench, 0.3)

    def text(minor):
        return decide((), (), [gap], bench.arm, FLOOR, None, Unnamed(minor)).summary

    assert text(()).endswith('Nothing in the catalogue explains it.')
    assert text([replace(small, share=0.001)]) == text(())
    assert text([small]).endswith(
        'Nothing in the catalogue closes it. An encoder offset in elbow (encoder offset 0.100 '
        '+- 0.020 rad, 5.7 degrees: the joint is at its reading plus that) explains 30 % of the '
        'gap.'
    )


def test_a_small_angle_is_no_zero_in_degrees(bench):
    effect = CATALOGUE['base_tilt'].on(bench.robot)
    numbers = (effect.parameters(bench.robot), (0.03517, 0.0006), (0.00017, 0.00015))
    tilt = Finding('base_tilt', (), *numbers, 0.9, (0.8, 1.0), 0.0)
    assert 'tilt y 0.00060 +- 0.00029 rad, 0.034 degrees)' in sentence(tilt)


def test_names_that_are_one_cause_are_one_sentence(bench):
    closed = Excess(0.5 * np.ones(bench.robot.n_joints), 'in the recordings')

    def found(name, share, together=()):
        effect = CATALOGUE[name].on(bench.robot)
        parameters = effect.parameters(bench.robot)[:1]
        shares = share, (share - 0.01, share + 0.01)
        return Finding(name, (), parameters, (0.3,), (0.01,), *shares, 0.0, together=together)

    tilt = found('base_tilt', 0.9, ('gravity_magnitude',))
    size = found('gravity_magnitude', 0.9, ('base_tilt',))
    delay = found('time_delay', 0.001)
    said = decide([tilt, size, delay], (), [closed], bench.arm, FLOOR).summary
    assert said == (
        'A base tilt (tilt x 0.300 +- 0.020 rad, 17.2 degrees) and a gravity magnitude (gravity '
        'difference 0.300 +- 0.020 m/s^2) together explain 90 % of the gap. A time delay (delay '
        '0.300 +- 0.020 s) explains 0.1 % of the gap. The rest is '
        'the misfit that the model had before.'
    )


def test_friction_of_many_joints_is_said_with_how_much_of_it_has_changed(bench):
    joints = tuple(f'joint_{k}' for k in range(5))
    both = {'viscous_friction': 'viscous_coefficient', 'coulomb_friction': 'coulomb_torque'}
    had = np.arange(1.0, 6.0)
    closed = Excess(0.5 * np.ones(bench.robot.n_joints), 'in the recordings')

    def finding(name, shares):
        parameters = tuple(ParameterName(both[name], joint, 'N m') for joint in joints)
        numbers = parameters, tuple(shares * had), tuple(0.005 * had)
        other = tuple(one for one in both if one != name)
        share = 0.97, (0.9, 1.0), 0.0
        return Finding(name, joints, *numbers, *share, together=other, added_to=tuple(had))

    def said(shares):
        return decide([finding(one, shares) for one in both], (), [closed], bench.arm, FLOOR)

    assert said(np.linspace(-0.3, -0.2, 5)).summary.startswith(
        'Viscous friction and coulomb friction in 5 joints (by -30 to -20 % of what it was) '
        'together explain 97 % of the gap.'
    )
    assert '(by -7 % of what it was)' in said(np.linspace(-0.072, -0.068, 5)).summary
    group = [finding(one, np.ones(5)) for one in both]
    where = 'joint_0, joint_1, joint_2, joint_3, joint_4'
    assert names_and_places(group) == f'viscous friction and coulomb friction of {where}'
    assert names_and_places([replace(group[0], joints=())]) == 'viscous friction of the whole arm'


@pytest.mark.parametrize(('share', 'mentioned'), [(0.3, True), (0.001, False)])
def test_small_print_of_no_size_is_not_read_out(bench, share, mentioned):
    off = Excess(4.0 * np.ones(bench.robot.n_joints), 'in the recordings')
    closed = Excess(0.5 * np.ones(bench.robot.n_joints), 'in the recordings')
    minor = (small_finding(bench, share),)
    summary = decide((), (), [closed], bench.arm, FLOOR, off, Unnamed(minor)).summary
    assert ('encoder offset' in summary) == mentioned


@pytest.mark.parametrize(
    ('rivals', 'said'),
    [
        ((Rival('link_inertia', ('elbow',)),), 'it from link inertia.'),
        ((Rival('link_inertia', ('shoulder',)),), 'it from link inertia of shoulder.'),
        (
            (Rival('link_inertia', ('elbow',)), Rival('payload', ('shoulder',))),
            'it from link inertia of elbow or payload of shoulder.',
        ),
        ((Rival('torque_offset', ('shoulder',)),), 'it from one of shoulder.'),
    ],
)
def test_what_could_stand_in_another_joint_is_said_with_it(bench, rivals, said):
    closed = Excess(0.5 * np.ones(bench.robot.n_joints), 'in the recordings')
    effect = CATALOGUE['torque_offset'].on(bench.robot, ('elbow',))
    numbers = (effect.parameters(bench.robot), (1.0,), (0.1,), 0.9, (0.8, 0.95), 0.0)
    found = Finding('torque_offset', ('elbow',), *numbers, rivals=rivals)
    assert f'cannot tell {said}' in decide([found], (), [closed], bench.arm, FLOOR).summary


def test_rivals_of_every_name_are_said_whatever_is_left(bench):
    rival = (Rival('payload', ('shoulder',)),)
    first = replace(small_finding(bench, 0.6), rivals=rival)
    second = replace(first, name='torque_offset', rivals=(Rival('torque_gain', ('elbow',)),))
    tied = (
        ' These data cannot tell the encoder offset from payload of shoulder, nor the torque '
        'offset from torque gain.'
    )
    for ratio, word in ((0.5, 'ambiguous'), (4.0, 'partial')):
        left = Excess(np.full(bench.robot.n_joints, ratio), 'in the recordings', ', all day')
        said = decide([first, second], (), [left], bench.arm, FLOOR)
        assert said.word == word and tied in said.summary
    assert said.summary.endswith(
        ' There is more: the error of shoulder in the recordings is 2.0 times as large as '
        f'{FLOOR} can be, all day.'
    )


def test_names_that_need_a_body_fitted_beside_them_say_so(bench):
    closed, off = (Excess(np.full(bench.robot.n_joints, x), '') for x in (0.5, 2.0))
    for as_it_is, once in (
        (closed, ''),
        (off, ', once its rigid body and friction are fitted as'),
    ):
        said = decide([small_finding(bench, 0.9)], (), [closed], bench.arm, FLOOR, as_it_is)
        assert said.word == 'named' and f'The rest is {FLOOR}{once}' in said.summary


def test_a_cause_that_may_have_been_there_before_is_said_though_it_is_not_named(bench):
    gap = Excess(4.0 * np.ones(bench.robot.n_joints), 'in the recordings')
    stop = replace(small_finding(bench, 0.5), name='soft_limit')
    unnamed = Unnamed(unproven=[stop])
    assert decide((), (), [gap], bench.arm, FLOOR, None, unnamed).summary.endswith(
        'is at its reading plus that) would explain 50 % of the gap, and is not named, as the '
        'recordings from before do not tell whether it was there then.'
    )


def test_what_is_suspected_is_said_once_for_all_of_its_names(bench):
    closed = Excess(0.5 * np.ones(bench.robot.n_joints), 'in the recordings')
    joints = tuple(f'joint_{k}' for k in range(5))
    viscous = replace(small_finding(bench, 0.7), name='viscous_friction', joints=joints)
    both = (
        replace(viscous, together=('coulomb_friction',)),
        replace(viscous, name='coulomb_friction', together=('viscous_friction',)),
    )
    said = decide((), (), [closed], bench.arm, FLOOR, None, Unnamed(suspected=both)).summary
    assert said.count('would explain') == 1
    assert 'Viscous friction and coulomb friction in 5 joints would explain 70 % of what' in said


def test_a_factor_of_all_friction_is_suspected_with_the_names_of_its_parts(bench):
    effect = FrictionLevel(bench.robot.joints, viscous=(1.0, 1.0), coulomb=(0.5, 0.5))
    trial = SimpleNamespace(
        candidate=SimpleNamespace(effect=effect, kept=(0,)),
        values=np.array([0.05]),
        std=np.array([0.01]),
        gains=np.array([1.0, 2.0]),
        gain=3.0,
        p=1e-6,
    )
    found = _as_looked_at(trial, SimpleNamespace(total=6.0, tried=1), bench.arm)
    names = 'viscous_friction', 'coulomb_friction'
    assert [(one.name, one.share, *one.together) for one in found] == [
        (names[0], 0.5, names[1]),
        (names[1], 0.5, names[0]),
    ]
    assert _as_looked_at(None, SimpleNamespace(total=6.0, tried=1), bench.arm) == ()


def test_an_experiment_names_the_joints_of_both():
    same = _separating('payload', ['elbow'], Rival('link_inertia', ('elbow',)))
    assert same.startswith('To separate payload from link inertia of elbow: ')
    assert same.endswith('elbow: the same motion with and without the tool.')
    other = _separating('torque_offset', ['elbow'], Rival('link_inertia', ('wrist',)))
    assert other.startswith('To separate torque offset of elbow from link inertia of wrist: ')


@pytest.mark.parametrize(('value', 'shown'), [(-0.06, 0), (-0.01, 1), (0.06, 1)])
def test_the_small_print_has_no_value_beyond_its_bound(bench, value, shown):
    """A search lets a share of lost torque be negative by what noise makes."""
    effect = CATALOGUE['actuator_saturation'].on(bench.robot, ('elbow',))
    trial = SimpleNamespace(
        candidate=SimpleNamespace(effect=effect, kept=(1,)),
        values=np.array([value]),
        std=np.array([0.02]),
        gains=np.array([1.0, 2.0]),
        gain=3.0,
        p=1e-6,
    )
    assert len(small_print([trial], 10.0, 1, bench.arm)) == shown


def test_the_same_name_in_another_joint_is_a_rival():
    def trial(name, *joints):
        effect = SimpleNamespace(said_as=name, joints=joints)
        return SimpleNamespace(candidate=SimpleNamespace(effect=effect), gain=1.0)

    others = trial('payload', 'elbow'), trial('payload', 'wrist'), trial('torque_gain', 'elbow')
    step = SimpleNamespace(trial=trial('payload', 'wrist'), rivals=others)
    arm = SimpleNamespace(robot=SimpleNamespace(joints=('elbow', 'wrist')))
    found = _rivals([step], Rival('payload', ('wrist',)), {'torque_gain'}, arm)
    assert found == (Rival('payload', ('elbow',)),)


def test_what_stands_in_for_a_later_name_is_no_rival_of_an_earlier_one():
    def trial(*key):
        return SimpleNamespace(candidate=SimpleNamespace(key=(*key, ())))

    link, lag = trial('link_inertia', ('elbow',)), trial('torque_lag', ())
    first = Step(trial('viscous_friction', ('elbow',)), (link, lag), (), 1.0, 1, None)
    second = Step(trial('payload', ('elbow',)), (link,), (), 1.0, 1, None)
    earlier, later = without_later([first, second])
    assert earlier.rivals == (lag,)
    assert later.rivals == (link,)


def test_a_parameter_of_several_joints_is_called_by_its_name_once(bench):
    effect = CATALOGUE['viscous_friction'].on(bench.robot, ('shoulder', 'elbow'))
    found = Finding(
        'viscous_friction',
        effect.joints,
        effect.parameters(bench.robot),
        (0.3, 0.2),
        (0.01, 0.01),
        0.9,
        (0.8, 1.0),
        0.0,
    )
    values = '(viscous coefficient 0.300 +- 0.020 N m s/rad, 0.200 +- 0.020 N m s/rad)'
    assert sentence(found) == (
        f'A viscous friction in shoulder, elbow {values} explains 90 % of the gap.'
    )


@pytest.mark.parametrize(('time', 'std', 'told'), [(206.0, 12908.0, False), (206.0, 20.0, True)])
def test_a_shape_that_the_data_do_not_determine_is_said_so_with_what_shows_it(
    bench, time, std, told
):
    effect = CATALOGUE['thermal_friction'].on(bench.robot, ('elbow',))
    names = (*effect.parameters(bench.robot), *effect.shape_parameters(bench.robot))
    numbers = (names, (0.4, time), (0.05, std), 0.9, (0.8, 1.0), 0.0)
    found = Finding('thermal_friction', ('elbow',), *numbers)
    open_gap = Excess(np.full(bench.robot.n_joints, 0.9), 'in the recordings')
    summary = decide((found,), (), [open_gap], bench.arm, FLOOR).summary
    assert ('warm up time 206' in summary) is told
    way = f'do not determine its warm up time; what shows it is {effect.traits.shown_by}.'
    assert (way in summary) is not told
    rows = NamedParameters((found,)).rows
    assert ('not determined' in [row[-1] for row in rows]) is not told
    assert '0.4' in rows[0][-1]
