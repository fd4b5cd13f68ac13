# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The diagrams on the page Architecture show the calls in the code."""

from pathlib import Path

import pytest

from docsite.architecture import architecture_page, JOBS, steps

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
