# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What of a description is not driven, or is two arms, is said by every command."""

from .conftest import armid


def test_grippers_and_a_second_arm_are_said_unless_joints_are_chosen(example_robot, tmp_path):
    asked = ('layout', '--robot', example_robot('baxter.urdf'))
    said = armid(*asked, '--out', tmp_path / 'all').stderr
    assert all(f'{side}_gripper_{side}_finger_joint' in said for side in 'lr')
    assert "'left_s0'" in said and "'right_s0'" in said
    assert '2 arms' in said and said.count('--joints') == 2
    chosen = armid(*asked, '--joints', 'left_s0,left_s1,left_e0', '--out', tmp_path / 'one')
    assert chosen.stderr == ''
    assert 'right_s0' not in (tmp_path / 'one' / 'plotjuggler.xml').read_text()


def test_an_error_stays_one_line(example_robot, tmp_path):
    (tmp_path / 'file').touch()
    out = tmp_path / 'file' / 'below'
    refused = armid('layout', '--robot', example_robot('baxter.urdf'), '--out', out, code=2)
    assert refused.stderr.count('\n') == 1 and 'not driven' not in refused.stderr
