# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every reader refuses what is no regular file at once, with its name."""

import os

from armid_ros.arm import load_model
from armid_ros.errors import ArmidError, RobotError
from armid_ros.excitation import load_environment, load_excitation
from armid_ros.files import read_text, regular
from armid_ros.identification.parameters_file import read_parameters
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
