# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A description made wrong on purpose: impossible values and wrong links are found."""

import re

import armid_ros as ar
from armid_ros.api.arguments import USUAL
import numpy as np
import pytest

from docsite.desk import ARM, FRICTION, LOAD
from tests.golden.inputs import recorded

URDF = ARM.read_text()
NO_MESH = '<collision><geometry><mesh filename="no.stl"/></geometry></collision>'
BOX = '<collision><geometry><box size="{0} {0} {0}"/></geometry></collision></link>'


def with_box(edge):
    """Return the description with a cube for its forearm."""
    end = URDF.rindex('</link>')
    return URDF[:end] + BOX.format(edge) + URDF[end + len('</link>') :]


@pytest.mark.parametrize(
    ('text', 'weight', 'fact'),
    [
        (URDF.replace('izz="0.002"', 'izz="2.0"'), 'bad', 'triangle inequality'),
        (URDF.replace('upper="2.4"', 'upper="137"'), 'bad', 'degrees'),
        (URDF.replace('velocity="3"', 'velocity="172"'), 'doubt', 'degrees per second'),
        (URDF.replace('effort="60"', 'effort="600"'), 'doubt', 'takes at most 9.31'),
        (URDF.replace('effort="60"', 'effort="4"'), 'doubt', 'takes up to 9.31'),
        (URDF.replace('effort="30"', 'effort="300"'), 'doubt', 'other joints have at most 60'),
        (URDF.replace('velocity="4"', 'velocity="40"'), 'doubt', 'median joint has 3'),
        (re.sub('velocity="."', 'velocity="49"', URDF), 'doubt', 'the last joint at 24.5 m/s'),
        (URDF, 'note', 'no <collision> in turret, upper_arm, forearm'),
        (with_box(0.04), 'bad', '1.56e+04 kg/m^3'),
        (with_box(0.5), 'doubt', '8 kg/m^3'),
        (with_box(300), 'bad', 'millimetres'),
        (with_box(0.05).replace('0 0.01 0.15', '0 0.01 1.5'), 'doubt', 'outside its shape'),
        (URDF.replace('0 0.01 0.15', '0 0 150'), 'bad', 'millimetres'),
        (URDF.replace('axis xyz="0 1 0"', 'axis xyz="0 2 0"', 1), 'doubt', "'shoulder': its axis"),
        (URDF.replace('</inertial>', f'</inertial>{NO_MESH}'), 'note', '3 meshes not found'),
    ],
    ids=lambda one: one if len(one) < 60 else '',
)
def test_an_impossible_value_is_found(text, weight, fact):
    found = ar.check(ar.load_robot(text))
    assert any(one.weight == weight and fact in one.text for one in found.remarks)
    assert found.wrong == (weight == 'bad')
    shown = found.summary()
    assert found.wrong == bool(shown.steps) == (shown.then == '')
    assert not found.wrong or found.remarks[0].text.split(':')[0] in shown.steps[0]
    assert found.remarks[0].weight == 'note' or found.remarks[0].text[1:12] in found.finding


def test_a_thin_inertia_is_doubtful_and_a_fixed_link_without_mass_is_not():
    shape = '<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision>'
    fixed = '<joint name="cover" type="fixed"><parent link="forearm"/><child link="hull"/></joint>'
    text = URDF.replace('</robot>', f'<link name="hull">{shape}</link>{fixed}</robot>')
    thin = re.sub('<inertia .*?/>', '<inertia ixx="2.2e-4" iyy="2.2e-4" izz="5.6e-7"/>', text)
    assert not [one for one in ar.check(ar.load_robot(text)).remarks if one.weight != 'note']
    doubts = [one.text for one in ar.check(ar.load_robot(thin)).remarks if one.weight == 'doubt']
    assert doubts and all('5.6e-07, 0.00022, 0.00022 kg m^2' in text for text in doubts)


def run(effects, seed=0):
    return recorded(ar.ArmModel.of(ARM, effects=effects), seed)


def test_a_mass_that_the_description_lacks_is_recovered_with_its_interval():
    found = ar.check(ARM, run((*FRICTION, LOAD)))
    assert found.links.wrong == (2,)
    links, centre = found.links, np.array([0.0, 0.01, 0.27]) / 1.4
    assert abs(links.measured_mass[2] - 1.4) < 4.0 * links.mass_std[2] < 0.04
    assert np.all(np.abs(links.measured_centre[2] - centre) < 4.0 * links.centre_std[2])
    assert 'elbow' in found.finding
    assert '\n'.join(found.summary().text()).count('±') == 3  # finding, mass and centre


def test_a_description_that_is_right_agrees():
    found = ar.check(ARM, run(FRICTION))
    assert found.links.agrees and found.links.wrong == () and not found.wrong


def test_a_rotor_that_is_grouped_with_a_link_is_no_wrong_link():
    rotors = 'rotor_inertia:rotor_inertia=0.1'
    found = ar.check(ARM, run((*FRICTION, rotors)), effects=f'{USUAL},rotor_inertia')
    assert not found.links.wrong and found.links.agrees and not found.wrong
