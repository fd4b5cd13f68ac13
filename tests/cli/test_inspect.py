# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What armid inspect prints and shows of bags and tables."""

import numpy as np

from .conftest import armid, DURATION, RATE, ROBOT


def test_a_bag_is_shown_within_80_columns_and_on_a_page(bags, tmp_path):
    text = armid('inspect', bags[0], '--robot', ROBOT, '--out', tmp_path / 'o').stdout
    assert max(len(line) for line in text.splitlines() if line.startswith('  ')) <= 80
    for said in (f'/joint_states: {DURATION * RATE}', 'elbow_pitch', 'armid identify'):
        assert said in text
    page = (tmp_path / 'o' / 'inspection.html').read_text()
    assert page.count('<figure') == 3 * 6 + 1
    assert '<script src' not in page


def test_a_table_is_inspected_as_a_bag_is(tmp_path):
    t = np.arange(0, 10, 0.01)
    table = np.column_stack([t, 100 * np.sin(t), 3 * np.sin(t)])
    path = tmp_path / 'run.csv'
    np.savetxt(path, table, delimiter=',', header='time,q1,tau1', comments='')
    result = armid('inspect', path)
    assert 'in degrees' in result.stdout
    assert '(guessed)' in result.stderr
    assert 'in degrees' not in armid('inspect', path, '--degrees').stdout
