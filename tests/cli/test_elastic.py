# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid elastic`, from simulated bags to parameters."""

from __future__ import annotations

import json

from armid_ros.cli.elastic import elastic
from armid_ros.errors import RecordingError, RobotError
from armid_ros.robots.two_link import two_link_set
from click.testing import CliRunner
import pytest


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Simulate three experiments and the steps, and identify them."""
    out = tmp_path_factory.mktemp('elastic') / 'result'
    arguments = ['--demo', '--experiments', '3', '--out', str(out), '--json']
    result = CliRunner().invoke(elastic, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    assert json.loads(result.stdout) == json.loads((out / 'elastic.json').read_text())
    return out


def stiffness(document):
    """Return both spring stiffnesses of a document [N m/rad]."""
    return [row['value'] for row in document['parameters'] if row['name'] == 'kg']


def test_demo_finds_the_springs(folder) -> None:
    document = json.loads((folder / 'elastic.json').read_text())
    wanted = two_link_set('after').parameters.stiffness.tolist()
    assert document['schema'] == 'armid/elastic/1'
    assert stiffness(document) == pytest.approx(wanted, rel=0.02)
    assert {path.name for path in folder.glob('*.png')} == {
        'bode.png',
        'parameters.png',
        'steps.png',
    }


def test_bags_give_the_same_again_and_no_steps_leave_out_the_tuning(folder, tmp_path) -> None:
    arguments = [str(folder / 'resonances'), '--out', str(tmp_path / 'again')]
    result = CliRunner().invoke(elastic, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    assert 'antiresonance' in result.stdout
    again = json.loads((tmp_path / 'again' / 'elastic.json').read_text())
    assert 'tuning' not in again
    assert again['untuned'] == json.loads((folder / 'elastic.json').read_text())['untuned']


@pytest.mark.parametrize(
    'arguments, error, message',
    [
        ([], RecordingError, 'no bag is named'),
        (['missing'], RecordingError, 'there is no such bag'),
        (['x', '--robot', 'humanoid_arm'], RobotError, 'two links'),
        (['x', '--gear', '50'], RobotError, '--gear takes two positive numbers'),
    ],
)
def test_bad_input_is_said(arguments, error, message, tmp_path) -> None:
    result = CliRunner().invoke(elastic, [*arguments, '--out', str(tmp_path / 'out')])
    assert isinstance(result.exception, error)
    assert message in str(result.exception)
