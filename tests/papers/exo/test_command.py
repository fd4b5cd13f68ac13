# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""``armid exo``: from walking to stiffness, and from a recording alone."""

import json

from armid_ros.cli import main
from armid_ros.papers.exo import command
from armid_ros.papers.exo.plant.leg_pair import EXERCISES
from click.testing import CliRunner
import pytest

from docsite.schemas import faults

pytestmark = pytest.mark.slow


@pytest.fixture(scope='module')
def result(tmp_path_factory):
    out = tmp_path_factory.mktemp('exo') / 'result'
    done = CliRunner().invoke(main, ['exo', '--out', str(out), '--duration', '2', '--json'])
    assert done.exit_code == 0, done.output
    return out, json.loads(done.stdout)


@pytest.mark.long
def test_the_document_is_as_its_schema_says(result) -> None:
    assert faults('exo', result[1]) == []


@pytest.mark.long
def test_the_animation_has_a_frame_for_every_step_of_its_slider(result) -> None:
    page = (result[0] / 'report.html').read_text(encoding='utf-8')
    data = json.loads(page.split('id="walk-data">')[1].split('</script>')[0])
    frames = int(page.split('id="walk-at"')[1].split('max="')[1].split('"')[0]) + 1
    assert len(data['phase']) == len(data['springs']) == len(data['feet']) == frames
    assert [len(part) for part in data['wearer']] == [frames] * 3
    assert len(data['machine']) == 1 + len(data['error']) == 3


@pytest.mark.long
def test_a_recording_gives_the_same_again(result, tmp_path) -> None:
    out, document = result
    again = CliRunner().invoke(
        main, ['exo', str(out / 'recording'), '--out', str(tmp_path / 'again'), '--json']
    )
    assert again.exit_code == 0, again.output
    found = json.loads(again.stdout)
    assert [row['value'] for row in found['stiffness']] == [
        row['value'] for row in document['stiffness']
    ]
    assert found['cycle'] == found['feet'] == []


def test_one_topic_is_not_enough(tmp_path) -> None:
    done = CliRunner().invoke(main, ['exo', '--out', str(tmp_path), '--topics', '/exo'])
    assert done.exit_code == 2
    assert 'give two topics' in done.output


def test_help_offers_the_motions_that_there_are():
    assert tuple(EXERCISES) == command.EXERCISES
