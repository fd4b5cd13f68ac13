# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Documents are bounded before they are built, and what a parser raises names the file."""

import math

from armid_ros.errors import ModelError, visible
from armid_ros.files import finite, load_yaml, reading, yaml_line
import pytest


@pytest.mark.parametrize(
    ('place', 'line'),
    [(('a',), 1), (('b', 1), 4), (('b', 1, 'd'), 5), (('b', 1, 'e'), 4), (('c', 0), 1), ((), 1)],
)
def test_the_line_of_a_place_is_that_of_its_key_or_of_the_last_that_is_there(place, line):
    text = 'a: 1\nb:\n- 2\n- c: 3\n  d: 4\n'
    assert yaml_line(text, place) == line


LAUGHS = ['l0: &l0 [x, x, x, x, x, x, x, x, x, x]']
LAUGHS += [f'l{k}: &l{k} [{", ".join([f"*l{k - 1}"] * 10)}]' for k in range(1, 10)]


@pytest.mark.parametrize(
    ('text', 'fact'), [('\n'.join(LAUGHS), 'aliases'), ('a: &a [*a]', 'anchor')]
)
def test_aliases_that_grow_beyond_measure_are_refused(text, fact):
    with pytest.raises(ValueError, match=fact):
        load_yaml(text)


@pytest.mark.parametrize(
    ('problem', 'said'),
    [
        (KeyError('name'), 'name'),
        (RecursionError(), 'nested'),
        (MemoryError(), 'large'),
        (OverflowError('too big'), 'too big'),
        (ModelError('of the arm'), 'of the arm'),
    ],
)
def test_what_a_parser_raises_names_the_file(problem, said):
    with pytest.raises(ModelError, match=f'^model.yaml: .*{said}'):
        with reading('model.yaml', ModelError):
            raise problem


@pytest.mark.parametrize(
    'value',
    ['nan', float('inf'), 10**4000, None, [1], '2001-01-01', 1e101, -1e308, '1.48e200', 10**150],
)
def test_a_number_is_finite_and_of_a_size_that_arithmetic_bears(value):
    with pytest.raises(ValueError, match='mass'):
        finite(value, 'mass')


def test_an_escape_sequence_in_a_name_is_spelled_out():
    assert visible('elbow\x1b[2J\u202e') == 'elbow\\x1b[2J\\u202e'
    assert str(ModelError("joint '\x1b]0;x\x07'")) == "joint '\\x1b]0;x\\x07'"


def test_angles_have_the_tags_of_joint_limits():
    limits = load_yaml('{lower: !degrees -180.0, upper: !radians 1.5, speed: 2.0}')
    assert limits == {'lower': -math.pi, 'upper': 1.5, 'speed': 2.0}
