# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""``armid exo``: from walking to stiffness, and from a recording alone."""

import json

from armid_ros.papers.exo import command
from armid_ros.papers.exo.plant.leg_pair import EXERCISES
import pytest

from tests.cli.conftest import armid

pytestmark = pytest.mark.slow


@pytest.fixture(scope='module')
def result(tmp_path_factory):
    out = tmp_path_factory.mktemp('exo') / 'result'
    return out, json.loads(armid('exo', '--out', out, '--duration', 2, '--json').stdout)


@pytest.mark.long
def test_a_recording_gives_the_same_again(result, tmp_path) -> None:
    out, document = result
    again = armid('exo', out / 'recording', '--out', tmp_path / 'again', '--json')
    found = json.loads(again.stdout)
    assert [row['value'] for row in found['stiffness']] == [
        row['value'] for row in document['stiffness']
    ]
    assert found['cycle'] == found['feet'] == []


def test_one_topic_is_not_enough(tmp_path) -> None:
    said = armid('exo', '--out', tmp_path, '--topics', '/exo', code=2).output
    assert 'two topics' in said


def test_help_offers_the_motions_that_there_are():
    assert tuple(EXERCISES) == command.EXERCISES
