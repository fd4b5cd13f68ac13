# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What of a description is not driven, or is two arms, is said by every command."""

import pytest

from .conftest import armid


def chain(side, count):
    """Return links and joints of an arm with a gripper of two fingers."""
    body = (
        '<inertial><mass value="1"/><origin xyz="0 0 0.1"/>'
        '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    names = [f'{side}_{k}' for k in range(count)] + [f'{side}_finger', f'{side}_thumb']
    parents = ['base', *names[: count - 1], names[count - 1], names[count - 1]]
    text = ''
    for name, parent in zip(names, parents, strict=True):
        mimic = f'<mimic joint="{side}_finger"/>' if name.endswith('thumb') else ''
        below = 'base' if parent == 'base' else f'{parent}_link'
        text += (
            f'<link name="{name}_link">{body}</link><joint name="{name}" type="revolute">'
            f'<parent link="{below}"/><child link="{name}_link"/><origin xyz="0 0 0.2"/>'
            f'<axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="1" effort="9"/>{mimic}'
            '</joint>'
        )
    return text


@pytest.fixture
def urdf(tmp_path):
    path = tmp_path / 'duo.urdf'
    path.write_text(
        f'<robot name="duo"><link name="base"/>{chain("left", 3)}{chain("right", 3)}</robot>'
    )
    return path


def test_grippers_and_a_second_arm_are_said(urdf, tmp_path):
    said = armid('layout', '--robot', urdf, '--out', tmp_path / 'all').stderr
    for name in ('left_finger', 'left_thumb', 'right_finger', "'left_0'", "'right_0'"):
        assert name in said
    assert '2 arms' in said
    assert said.count('--joints') == 2


def test_an_error_stays_one_line(urdf, tmp_path):
    refused = armid('layout', '--robot', urdf, '--out', urdf / 'below', code=2)
    assert refused.stderr.count('\n') == 1
    assert 'not driven' not in refused.stderr


def test_who_chooses_is_told_nothing(urdf, tmp_path):
    done = armid(
        'layout', '--robot', urdf, '--joints', 'left_0,left_1,left_2', '--out', tmp_path / 'one'
    )
    assert done.stderr == ''
    assert 'right_0' not in (tmp_path / 'one' / 'plotjuggler.xml').read_text()
