# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of real machines in the formats of their authors, as a person would type them."""

import json

import pytest

from .conftest import armid

pytestmark = pytest.mark.real_data


def identified(*arguments, out):
    """Identify and return the document."""
    armid('identify', *arguments, '--no-verify', '--out', out)
    return json.loads((out / 'identification.json').read_text())


def test_a_table_that_says_it_all_needs_no_word(real_data, tmp_path):
    """The authors' moments of the double pendulum: k 0.33 and h 0.116 kg m."""
    folder = real_data / 'dfki_double_pendulum'
    document = identified(
        folder / 'A0_sysid' / '20220812-061157-PM_measured.csv.gz',
        '--robot', folder / 'parameters' / 'design_A.0_model_2.1' / 'pendubot.urdf',
        '--cutoff', 5, out=tmp_path / 'out',
    )  # fmt: skip
    moments = [row['value'] for row in document['parameters'] if row['name'].startswith('mz')]
    assert moments == pytest.approx([-0.33, 0.116], rel=0.02)
    assert document['training']['relative_error_percent'] < 10.0
