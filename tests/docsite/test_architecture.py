# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The generated pages show the calls in the code and the numbers of the diagnosis."""

from dataclasses import fields
from pathlib import Path

from armid_ros.diagnosis.settings import Thresholds
import pytest

from docsite.architecture import architecture_page, JOBS, steps
from docsite.numbers import numbers_page

PACKAGE = Path(__file__).parents[2] / 'armid_ros'


@pytest.mark.parametrize('job', JOBS)
def test_a_job_leads_from_its_command_to_its_result(job):
    found = steps(PACKAGE, *JOBS[job])
    names = [one.name for one in found]
    assert len(found) <= 60  # one sheet
    assert any(one.room == 'api' and one.name == JOBS[job][1] for one in found) or job == 'excite'
    assert all(one.summary for one in found)
    if job == 'identify':
        order = ['conditioning', 'regressions', 'fit_values', 'halves_error', 'save_model']
        assert sorted(order, key=names.index) == order


def test_every_job_has_a_diagram():
    page = architecture_page(PACKAGE)
    assert page.count('<svg ') == page.count('</svg>') == len(JOBS)


def rows(page):
    """Return the cells of all table rows of a page."""
    lines = [line for line in page.splitlines() if line.startswith('| `')]
    return [[cell.strip() for cell in line.strip('|').split(' | ')] for line in lines]


def test_each_has_a_value_and_a_reason():
    page = numbers_page(PACKAGE / 'diagnosis')
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
