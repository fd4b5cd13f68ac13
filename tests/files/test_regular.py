# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Readers refuse what is no regular file, and documents are bounded before they are built."""

import math
import os

from armid_ros.arm import load_model
from armid_ros.errors import ArmidError, ModelError, RobotError, visible
from armid_ros.excitation import load_environment, load_excitation
from armid_ros.files import finite, load_yaml, read_text, reading, regular, yaml_line
from armid_ros.identification.parameters_file import read_parameters
from armid_ros.papers.exo.plant.gait import read_gait
from armid_ros.recording import copy_bag, read_recording
from armid_ros.recording.bag import Bag
from armid_ros.recording.tables import open_table
from armid_ros.robots import load_robot
import pytest

READERS = {
    'model.yaml': load_model,
    'identification.json': read_parameters,
    'excitation.yaml': load_excitation,
    'environment.yaml': load_environment,
    'robot.urdf': load_robot,
    'robot.urdf.xacro': load_robot,
    'gait.csv': read_gait,
    'bag.mcap': Bag,
    'bag.db3': Bag,
    'bag.mcap.zstd': Bag,
    'bag.db3.zstd': lambda path: read_recording(path, joints=['a']),
    'cut.mcap': lambda path: copy_bag(path, path.parent / 'out'),
    'metadata.yaml': lambda path: Bag(path.parent),
    'bag.bag': Bag,
    **{f'table.{end}': open_table for end in ('csv', 'csv.gz', 'npz', 'mat', 'h5', 'parquet')},
}


@pytest.mark.parametrize('name', READERS)
@pytest.mark.parametrize('kind', ['a FIFO', 'a device', 'a folder'])
def test_what_is_no_file_is_refused_without_waiting(tmp_path, name, kind):
    path = tmp_path / name
    if kind == 'a FIFO':
        os.mkfifo(path)
    elif kind == 'a device':
        path.symlink_to('/dev/zero')
    else:
        path.mkdir()
    with pytest.raises(ArmidError, match=name) as refusal:
        READERS[name](path)
    assert kind in str(refusal.value) or kind == 'a folder'


@pytest.mark.parametrize('name', READERS)
@pytest.mark.parametrize(
    'content',
    [b'\xff\xfe\x00rubbish', b'[' * 5000, b'{"a":' * 5000, b'a: ' + b'9' * 5000, b'2001-99-99'],
)
def test_rubbish_in_any_file_is_refused_with_its_name(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ArmidError, match=name):
        READERS[name](tmp_path / name)


def test_a_text_has_a_largest_size(tmp_path, monkeypatch):
    monkeypatch.setattr(regular, 'TEXT_LIMIT', 100)
    (tmp_path / 'large.urdf').write_text('x' * 101)
    with pytest.raises(RobotError, match=r'large\.urdf: '):
        read_text(tmp_path / 'large.urdf', RobotError)


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
