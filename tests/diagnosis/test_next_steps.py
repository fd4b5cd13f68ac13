# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What to do next is one piece of advice: look at the robot, then record what tells names."""

from dataclasses import replace
from types import SimpleNamespace

from armid_ros.diagnosis.next_run.steps import next_steps
from armid_ros.diagnosis.verdict.finding import Finding, Rival
from armid_ros.effects import CATALOGUE, Traits
from armid_ros.estimate import ParameterName
import pytest

LINK = (Rival('link_inertia', ('wrist',)),)


def diagnosis(name, joints, rivals=(), verdict='named', effects=(), given=()):
    finding = Finding(name, joints, (), (), (), 0.9, (0.8, 1.0), 0.0, rivals=rivals)
    return SimpleNamespace(
        findings=(finding,),
        verdict=verdict,
        left=(),
        not_visible=(),
        doubt='',
        harmful=False,
        contradicted=False,
        not_checked=(),
        arm=SimpleNamespace(effects=effects),
        explanation=SimpleNamespace(given=SimpleNamespace(effects=given)),
    )


def planned(rival, told):
    pair = SimpleNamespace(name='payload', rival=rival, distinct=told)
    return SimpleNamespace(sentence='Run it.', separations=(pair,))


@pytest.mark.parametrize('name', [n for n, kind in CATALOGUE.items() if not kind.learned])
def test_every_effect_says_what_to_look_at(name):
    what = CATALOGUE[name].traits.look_at
    assert what and not what.endswith('.') and ':' not in what


def test_a_payload_sends_a_person_to_the_hand_first():
    first, *others = next_steps(diagnosis('payload', ('wrist',)), model='out/model.yaml')
    assert 'wrist' in first and 'gripper' in first
    (use,) = others
    assert use.startswith('Use') and 'out/model.yaml' in use


@pytest.mark.parametrize(
    ('facts', 'worse', 'stated'),
    [
        ({'harmful': True}, (), 'Identify'),
        ({'doubt': 'The model leaves 30 %.'}, (), 'Identify'),
        ({'not_checked': ('elbow',)}, (), 'elbow'),
        ({}, ('elbow',), 'elbow'),
    ],
    ids=['harmful', 'poor itself', 'a joint is not checked', 'simulates worse'],
)
def test_a_model_that_may_be_worse_is_not_to_be_used(facts, worse, stated):
    found = diagnosis('payload', ('wrist',))
    vars(found).update(facts)
    steps = next_steps(found, worse=worse)
    assert stated in steps[-1]
    assert not any(step.startswith('Use') for step in steps)


def test_the_centre_of_a_load_is_said_where_it_is_determined():
    units = ('kg', 'kg m', 'kg m', 'kg m')
    names = [ParameterName(n, 'wrist', u) for n, u in zip('mxyz', units, strict=True)]
    found = diagnosis('payload', ('wrist',))
    load = replace(found.findings[0], parameters=tuple(names), weighs=True)
    values, std = (0.3, -0.054, 0.0, 0.003), (0.003, 0.0006, 0.0006, 0.0006)
    found.findings = (replace(load, values=values, std=std),)
    place = '(-0.180, 0.000, 0.010) ± 0.005 m'
    assert place in next_steps(found)[0]
    found.findings = (replace(load, values=values, std=(0.03, *std[1:])),)
    assert '(-0.180, 0.000, 0.010) ± 0.04 m' in next_steps(found)[0]
    found.findings = (replace(load, values=values, std=(0.3, *std[1:])),)
    assert 'centred' not in next_steps(found)[0]


def test_a_run_that_tells_the_names_is_the_only_recording_that_is_asked_for():
    doubt = diagnosis('payload', ('wrist',), LINK, 'ambiguous')
    told = next_steps(doubt, planned('link_inertia', True))
    assert told[0] == 'Run it.' and 'record' not in ''.join(told)
    alike = next_steps(doubt, planned('link_inertia', False))
    assert alike[0] == 'Run it.'
    assert 'No motion' in alike[1] and 'link inertia' in alike[1]


def test_an_effect_of_ones_own_says_it_as_well():
    hose = SimpleNamespace(name='hose', traits=Traits(look_at='the clamps of the hose'))
    found = diagnosis('hose', ('elbow',), effects=(hose,))
    assert 'elbow' in next_steps(found)[0] and 'the clamps' in next_steps(found)[0]
    assert len(next_steps(diagnosis('hose', ('elbow',)))) == 1
