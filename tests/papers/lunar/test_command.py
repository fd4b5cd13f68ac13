# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The lunar paper is repeated by one command, and better than it was."""

import json

import pytest

from tests.cli.conftest import armid

pytestmark = pytest.mark.slow


@pytest.fixture(scope='module')
def repeated(tmp_path_factory):
    """Run the command once."""
    out = tmp_path_factory.mktemp('lunar') / 'out'
    text = armid('lunar', '--out', out).stdout
    return text, json.loads((out / 'lunar.json').read_text()), (out / 'report.html').read_text()


def test_errors_on_the_moon_are_a_fifth_of_the_papers(repeated):
    tables = {table['number']: table for table in repeated[1]['tables']}
    for number, stated in ((3, 5.51), (4, 5.26)):
        paper, slow, whole = (
            list(tables[number][key].values())
            for key in ('paper', 'weight_alone', 'whole_dynamics')
        )
        assert sum(paper) / 6 == pytest.approx(stated, abs=0.01)
        assert sum(slow) / 6 <= 1.1
        assert sum(whole) / 6 <= 1.0
        assert max(slow) <= 2.0
        assert max(whole) <= 1.5


def test_against_the_noisy_torque_the_error_is_the_noise_as_in_the_paper(repeated):
    noisy = repeated[1]['tables'][0]['against_noise']
    assert sum(noisy.values()) / 6 == pytest.approx(5.5, abs=0.6)


def test_errors_on_earth_are_a_small_share_of_the_noise(repeated):
    table = repeated[1]['tables'][2]
    assert min(table['paper'].values()) >= 0.25
    assert max(table['weight_alone'].values()) <= 0.15
    assert max(table['whole_dynamics'].values()) <= 0.15


def test_the_largest_torques_are_those_that_the_paper_prints(repeated):
    """Joints 3 to 6 reach them; the first two never do."""
    for table, tolerance in zip(repeated[1]['tables'][:2], (0.008, 0.016), strict=True):
        paper, ours = (list(table[key].values()) for key in ('paper_peak', 'largest_torque'))
        assert ours[2:] == pytest.approx(paper[2:], rel=tolerance)
        assert ours[0] > paper[0]


def test_twelve_parameters_and_the_load_are_found(repeated):
    document = repeated[1]
    assert len(document['composites']) == 12
    inside = [
        abs(row[value] - row[truth]) <= 2.6 * row[std]
        for row in document['composites']
        for value, truth, std in (
            ('value', 'truth', 'std'),
            ('loaded', 'loaded_truth', 'loaded_std'),
        )
    ]
    assert sum(inside) >= 23
    assert document['load']['value'] == pytest.approx(0.3, abs=0.01)
