# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid fleet` as a person uses it: one command each, one line for wrong input."""

import json

import pytest

from tests.cli.conftest import armid
from tests.golden.simulated_fleet import generate, ROBOT

pytestmark = pytest.mark.slow


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """Return a folder of two arms with four bags each, one of them damaged."""
    folder = tmp_path_factory.mktemp('fleet')
    generate(folder, arms=2, bags=4, changed=0, damaged=1, seconds=12.0)
    return folder


def test_identify_then_watch(bags, tmp_path):
    out = tmp_path / 'results'
    arguments = ('fleet', 'identify', f'{bags}/*/*', '--robot', ROBOT, '--out', out)
    said = armid(*arguments, '--workers', 1).output
    assert '2 arms' in said and '7 bags' in said and '1 refused' in said
    assert 'armid identify' in said and '--cutoff' in said
    again = json.loads(armid(*arguments, '--workers', 1, '--resume', '--json').stdout)
    assert (again['done'], again['found'], len(again['refused'])) == (7, 7, 1)
    watched = armid('fleet', 'watch', '--out', out).output
    assert 'index.html' in watched and (out / 'index.html').exists()
    armid('fleet', 'diagnose', '--out', out)
    assert not list(out.rglob('diagnosis.json'))


@pytest.mark.parametrize(
    ('arguments', 'said'),
    [
        (('identify', '{bags}/*/*', '--out', '{out}'), '--robot'),
        (('identify', '{bags}/none/*', '--robot', ROBOT, '--out', '{out}'), 'there is no bag'),
        (('identify', '{bags}/*/*', '--robot', 'nobody', '--out', '{out}'), 'nobody'),
        (('identify', '{bags}/*/*', '--robots', '{bags}/none.csv', '--out', '{out}'), 'none.csv'),
        (
            ('identify', '{bags}/*/*', '--robot', 'humanoid_arm', '--out', '{out}'),
            'no bag of humanoid_arm can be read',
        ),
        (('identify', '{bags}/*/*', '--robot', ROBOT, '--out', ROBOT), 'give a folder with --out'),
        (('watch', '--out', '{out}'), 'run `armid fleet identify` first'),
        (('diagnose', '--out', '{out}'), 'run `armid fleet identify` first'),
    ],
)
def test_wrong_input_is_one_line(bags, tmp_path, arguments, said):
    filled = [str(one).format(bags=bags, out=tmp_path / 'out') for one in arguments]
    result = armid('fleet', *filled, code=2)
    line = [line for line in result.output.splitlines() if line.startswith('armid:')]
    assert len(line) == 1 and said in line[0]


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('name,robot\n', 'columns arm and robot'),
        ('arm,robot\narm_0000,\n', 'line 2'),
        ('arm,robot\na,r\na,r\n', 'line 3: arm a appears twice'),
        ('arm,robot\nother,r\n', "arm 'arm_0000' is not in the table"),
    ],
)
def test_a_table_of_robots_is_checked_by_line(bags, tmp_path, text, said):
    table = tmp_path / 'robots.csv'
    table.write_text(text)
    out = tmp_path / 'out'
    result = armid('fleet', 'identify', f'{bags}/*/*', '--robots', table, '--out', out, code=2)
    assert said in result.output


def test_watch_takes_options_of_a_project(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'armid.toml').write_text('alpha = 0.1\n[fleet.watch]\nout = "results"\n')
    said = armid('fleet', 'watch', code=2).stderr
    assert '--alpha 0.1' in said and '--out results' in said
