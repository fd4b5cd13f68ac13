# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every command of the work ends with the command that follows, ready to be pasted."""

import shlex

from armid_ros.cli import main
import pytest

from .conftest import armid, ROBOT

FAST = ('--no-physical', '--no-verify')
QUICK = ('--duration', 6, '--starts', 1, '--iterations', 1)


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp('results')


@pytest.mark.parametrize(
    ('command', 'then', 'words'),
    [
        (('check', ROBOT), 'excite', (ROBOT,)),
        (
            ('check', ROBOT, 'BAG', '--topic', 'joint_states'),
            'identify',
            ('--topic', 'joint_states'),
        ),
        (('check', ROBOT, 'BAG', '--gravity', 'moon'), 'inspect', ('BAG', '--gravity', 'moon')),
        (('inspect', 'BAG', '--robot', '-'), 'identify', ('BAG', '-')),
        (('excite', '--robot', ROBOT, *QUICK, '--out', 'plan'), 'simulate', (ROBOT,)),
        (('identify', 'BAG', '--robot', ROBOT, *FAST, '--out', 'a'), 'excite', (ROBOT,)),
        (('identify', 'HELD', '--robot', ROBOT, *FAST, '--out', 'b'), 'excite', (ROBOT,)),
        (('compare', 'a', 'b', '--out', 'c'), 'identify', ('BAG', 'HELD', ROBOT)),
        (('diagnose', 'BAG', '--robot', ROBOT, '--out', 'd'), 'simulate', (ROBOT, '--model')),
    ],
)
def test_the_last_line_is_a_command(bags, folder, command, then, words):
    paths = {name: str(folder / name) for name in ('plan', 'a', 'b', 'c', 'd')}
    paths |= {'BAG': str(bags[0]), 'HELD': str(bags[1])}
    done = armid(*(paths.get(word, word) for word in command)).stdout.splitlines()
    program, name, *arguments = shlex.split(done[-1].removeprefix('next: '))
    assert (program, name) == ('armid', then)
    main.get_command(None, name).make_context(name, list(arguments))
    assert {paths.get(word, word) for word in words} <= set(arguments)
    for page in (folder / name / 'report.html' for name in ('plan', 'c') if name in command):
        assert done[-1].removeprefix('next: ') in page.read_text()


def test_a_check_takes_the_robot_of_the_project(bags, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    armid('check', code=2)
    (tmp_path / 'armid.toml').write_text(f'robot = "{ROBOT}"\n')
    assert f'{ROBOT}' in armid('check', bags[0]).stdout.splitlines()[-1]
    armid('check', 'no.urdf', code=2)
    assert '- is taken' in armid('check', '-', bags[0]).stderr
