# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sentences say what the evidence bears out, and no more."""

from dataclasses import replace

from armid_ros.diagnosis.data.evidence import joints_that_do_not_repeat, NoiseFloor
from armid_ros.diagnosis.settings import Thresholds
from armid_ros.diagnosis.verdict.finding import Finding, Rival
from armid_ros.diagnosis.verdict.where import Excess
from armid_ros.diagnosis.verdict.words import decide, sentence, share_interval_in_words
from armid_ros.effects import CATALOGUE
from armid_ros.report.sections.diagnosed import named_section
import numpy as np
import pytest

#: The floor of a gap, which a summary repeats.
FLOOR = 'old misfit'


def excess(bench, ratio):
    """Return losses over their limits: one ratio in all joints, or one each."""
    return Excess(np.ones(bench.robot.n_joints) * ratio, 'in the recordings')


def verdict(bench, *findings, left=0.5, given=None, minor=()):
    """Decide between a closed gap, by default, and an open one."""
    given = None if given is None else excess(bench, given)
    return decide(findings, (), [excess(bench, left)], bench.arm, FLOOR, given, minor)


def finding(bench, share=0.3, name='encoder_offset', values=(0.1,), joints=('elbow',), **more):
    """Return a cause in the elbow that takes a share of the gap."""
    effect = CATALOGUE[name].on(bench.robot, joints or None)
    parameters = effect.parameters(bench.robot)[: len(values)]
    numbers = parameters, values, (0.01,) * len(values), share, (0.2, 0.4), 0.0
    return Finding(name, joints, *numbers, sign=effect.traits.sign, **more)


@pytest.mark.parametrize(('given', 'fitted'), [(None, False), (0.8, False), ([0.8, 4.0], True)])
def test_a_body_that_has_to_be_fitted_is_stated(bench, given, fitted):
    for named, word in (((), 'consistent'), ((finding(bench),), 'named')):
        found = verdict(bench, *named, given=given)
        assert found.word == word and FLOOR in found.summary
        assert ('fitted' in found.summary) == fitted


@pytest.mark.parametrize('given', [None, 4.0])
@pytest.mark.parametrize(('share', 'mentioned'), [(0.45, True), (0.001, False)])
def test_small_print_of_no_size_is_not_read_out(bench, given, share, mentioned):
    text = verdict(bench, given=given, minor=[finding(bench, share)]).summary
    assert ('encoder offset' in text) == ('45 %' in text) == mentioned


def test_what_is_not_explained_has_the_cause_that_explains_most_of_it(bench):
    plain = verdict(bench, left=4.0)
    assert plain.word == 'unknown' and '2.0 times' in plain.summary
    assert verdict(bench, left=4.0, minor=[finding(bench, 0.001)]) == plain
    text = verdict(bench, left=4.0, minor=[finding(bench)]).summary
    assert all(fact in text for fact in ('elbow', '0.100', '0.020 rad', '5.7 degrees', '30 %'))


def test_a_share_has_its_interval(bench):
    assert share_interval_in_words(finding(bench)) == ' (20 % to 40 %)'


@pytest.mark.parametrize(
    ('rivals', 'stated'),
    [
        ((('link_inertia', 'elbow'),), 'link inertia'),
        ((('link_inertia', 'shoulder'),), 'inertia of shoulder'),
        ((('link_inertia', 'elbow'), ('payload', 'shoulder')), 'elbow (40 %) or payload'),
        (
            (('torque_offset', 'shoulder'),),
            '(probability 0 %) or torque offset of shoulder (40 %)',
        ),
    ],
)
def test_a_rival_in_another_joint_is_stated_with_it(bench, rivals, stated):
    others = tuple(Rival(name, (joint,), 0.4) for name, joint in rivals)
    found = verdict(bench, finding(bench, 0.9, 'torque_offset', rivals=others))
    assert found.word == 'ambiguous' and stated in found.summary


def test_a_changed_effect_has_its_old_and_its_new_value(bench):
    friction = finding(bench, 1.0, 'coulomb_friction', (0.25,), added_to=(0.06,))
    text = verdict(bench, friction).summary
    assert text.startswith('Coulomb friction of elbow rose from 0.060 to 0.310 ± 0.020 N m')
    assert named_section((friction,)).blocks[0].rows[0][-1] == '0.060 to 0.310 ± 0.020 N m'
    assert 'fell from 0.310 to 0.060' in sentence(
        replace(friction, values=(-0.25,), added_to=(0.31,))
    )
    assert 'from' not in sentence(replace(friction, added_to=(0.01,)))  # inside its interval


def test_the_same_body_on_another_link_is_no_ambiguity(bench):
    same = Rival('payload', ('shoulder',), 0.4, same_body=True)
    load = finding(bench, 0.9, 'payload', (0.7,), weighs=True, rivals=(same,))
    found = verdict(bench, load)
    assert found.word == 'named' and not load.experiment and not load.ambiguous_with
    assert found.summary.startswith('Payload of 0.700 ± 0.020 kg on elbow')
    assert 'link of shoulder may carry it instead' in found.summary


def test_what_does_not_repeat_has_to_matter(bench):
    joints = bench.robot.n_joints
    one = np.ones(joints)
    floor = NoiseFloor(0.1 * one, 8.0, 20.0 * one, np.array([0.05, 0.2]), 0.1 * one)
    closed = excess(bench, 0.5)

    def word(least):
        floors, limits = [floor] * 3, Thresholds()
        different = joints_that_do_not_repeat(bench.robot.joints, floors, limits, least * one)
        return decide((), different, [closed], bench.arm, FLOOR)

    assert word(0.1).word == 'not_repeatable'
    assert 'elbow' in word(0.1).summary and 'shoulder' not in word(0.1).summary
    assert word(0.3).word == 'consistent'


@pytest.mark.parametrize(('time', 'std', 'told'), [(206.0, 12908.0, False), (206.0, 20.0, True)])
def test_a_shape_that_the_data_do_not_determine_has_no_value(bench, time, std, told):
    effect = CATALOGUE['thermal_friction'].on(bench.robot, ('elbow',))
    names = (*effect.parameters(bench.robot), *effect.shape_parameters(bench.robot))
    numbers = (names, (0.4, time), (0.05, std), 0.9, (0.8, 1.0), 0.0)
    found = Finding('thermal_friction', ('elbow',), *numbers)
    summary = verdict(bench, found).summary
    assert ('206' in summary) is told
    rows = named_section((found,)).blocks[0].rows
    assert ('not determined' in [row[-1] for row in rows]) is not told
    assert '0.4' in rows[0][-1]
