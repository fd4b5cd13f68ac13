# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of an inspection shows every curve, escapes names, and fits a phone."""

from armid_ros.inspection import inspect
from armid_ros.recording import Recording
from armid_ros.report.inspection_report import inspection_report
import numpy as np
import pytest

JOINTS = ('shoulder', '<b>elbow</b>')


@pytest.fixture(scope='module')
def html():
    """Return the page of a recording of two joints with a gap, without velocities."""
    t = np.delete(np.arange(0.0, 20.0, 0.01), slice(500, 600))
    q = np.column_stack([np.sin(t), np.cos(1.3 * t)])
    recording = Recording(joints=JOINTS, t=t, q=q, tau=3 * q, source='<i>run</i>.mcap')
    return inspection_report(inspect(recording))


def test_a_browser_draws_every_curve_within_the_window(charts_drawn, html):
    assert charts_drawn(html, 400, dark=False) == 2 * 2 + 1
