# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""``armid exo``: from walking to stiffness, and from a recording alone."""

from __future__ import annotations

import json

from armid_ros.cli import main
from armid_ros.papers.exo import command
from armid_ros.papers.exo.plant.exercises import EXERCISES
from click.testing import CliRunner
import pytest

from docsite.schemas import faults

pytestmark = pytest.mark.slow


@pytest.fixture(scope='module')
def result(tmp_path_factory):
    out = tmp_path_factory.mktemp('exo') / 'result'
    done = CliRunner().invoke(main, ['exo', '--out', str(out), '--duration', '4', '--json'])
    assert done.exit_code == 0, done.output
    return out, json.loads(done.stdout)


def test_the_springs_that_were_simulated_are_found(result) -> None:
    _, document = result
    overall, *each = document['stiffness']
    assert overall['segment'] == 'all'
    assert overall['value'] == pytest.approx(overall['truth'], rel=0.01)
    assert [row['value'] for row in each] == pytest.approx([1e4] * 4, rel=0.1)
    assert {row['joint']: row['error_deg'] < 0.01 for row in document['gait']} == {
        'exo_swing_hip': True,
        'exo_swing_knee': True,
    }


def test_the_document_is_as_its_schema_says(result) -> None:
    assert faults('exo', result[1]) == []


def test_hip_and_knee_walk_a_whole_cycle_by_their_torque(result) -> None:
    _, document = result
    off = {row['joint']: row['error_deg'] for row in document['cycle']}
    assert off['exo_right_hip'] < 0.05
    assert off['exo_right_knee'] < 0.1
    for row in document['cycle']:
        assert 10.0 * row['error_deg'] < row['error_softer_deg'] < row['source_deg']
    assert all(0.15 < row['double_support'] < 0.35 for row in document['feet'])


def test_the_animation_has_a_frame_for_every_step_of_its_slider(result) -> None:
    page = (result[0] / 'report.html').read_text(encoding='utf-8')
    data = json.loads(page.split('id="walk-data">')[1].split('</script>')[0])
    frames = int(page.split('id="walk-at"')[1].split('max="')[1].split('"')[0]) + 1
    assert len(data['phase']) == len(data['springs']) == len(data['feet']) == frames
    assert [len(part) for part in data['wearer']] == [frames] * 3
    assert len(data['machine']) == 1 + len(data['error']) == 3


def test_the_report_loads_nothing_and_has_all_parts(result) -> None:
    page = (result[0] / 'report.html').read_text(encoding='utf-8')
    for title in (
        *('Stiffness', 'Walking', 'Whole cycle by torque', 'Feet', 'Gait by torque'),
        *('Interaction', 'Poses', 'Assumptions'),
    ):
        assert f'<h2>{title}</h2>' in page
    assert '<polyline' in page
    assert 'src="http' not in page


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
    assert found['gait'] == found['cycle'] == found['feet'] == []


def test_one_topic_is_not_enough(tmp_path) -> None:
    done = CliRunner().invoke(main, ['exo', '--out', str(tmp_path), '--topics', '/exo'])
    assert done.exit_code == 2
    assert 'give two' in done.output


def test_help_offers_the_motions_that_there_are():
    assert tuple(EXERCISES) == command.EXERCISES
