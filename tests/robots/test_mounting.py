# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A file beside a description says where its floor is."""

from armid_ros.errors import RobotError
from armid_ros.robots import load_robot, read_mounting, robot_from_urdf
import pytest


@pytest.fixture
def beside(tmp_path):
    """Return a function that writes what stands beside a description, and reads it."""

    def read(text):
        path = tmp_path / 'arm.urdf'
        path.write_text(load_robot('two_link_elastic').urdf)
        if text is not None:
            (tmp_path / 'arm.mounting.yaml').write_text(text)
        return read_mounting(load_robot(path))

    return read


@pytest.mark.parametrize(('text', 'floor'), [('floor: -0.75', -0.75), ('floor: none', None)])
def test_a_height_or_none_is_read(beside, text, floor):
    assert beside(text)[0] == floor


def test_without_a_file_nothing_is_known(beside):
    assert beside(None) is None
    assert read_mounting(robot_from_urdf(load_robot('two_link_elastic').urdf)) is None


@pytest.mark.parametrize(
    'text', ['floor: low', 'floor: true', 'floor: .nan', 'height: 1', '[', '']
)
def test_anything_else_is_refused_with_the_file(beside, text):
    with pytest.raises(RobotError, match=r'arm\.mounting\.yaml'):
        beside(text)
