# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of numbers lists every number of the diagnosis with its meaning."""

from dataclasses import fields
from pathlib import Path

from armid_ros.diagnosis.settings import Thresholds

from docsite.numbers import numbers_page

PACKAGE = Path(__file__).parents[2] / 'armid_ros' / 'diagnosis'


def rows(page):
    """Return the cells of all table rows of a page."""
    lines = [line for line in page.splitlines() if line.startswith('| `')]
    return [[cell.strip() for cell in line.strip('|').split(' | ')] for line in lines]


def test_each_has_a_value_and_a_reason():
    page = numbers_page(PACKAGE)
    found = rows(page)
    assert {field.name for field in fields(Thresholds)} <= {row[0].strip('`') for row in found}
    assert not [row for row in found if not (row[1] and row[2])]
    assert len(fields(Thresholds)) <= 45


def test_a_number_without_a_comment_is_noticed(tmp_path):
    (tmp_path / 'module.py').write_text(
        '#: Why.\n_GOOD, _ALSO = 1.0, -2\n_BAD = 0.3\n_TEXT = "a"\n'
    )
    page = numbers_page(tmp_path)
    assert ['`_GOOD, _ALSO`', '(1.0, -2)', 'Why.', '`module.py`'] in rows(page)
    assert ['`_BAD`', '0.3', '', '`module.py`'] in rows(page)
    assert '_TEXT' not in page
