# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Headings of pages are names, wherever the files are."""

import re

from armid_ros.report import identification_report
from armid_ros.report.notation import robot_label
import pytest


@pytest.mark.parametrize(
    ('source', 'label'),
    [
        ('humanoid_arm', 'humanoid_arm'),
        ('/a/long path/arm.urdf', 'arm.urdf'),
        ('../arm.xacro tool:=true side:=/left', 'arm.xacro tool:=true side:=/left'),
        ('-', '-'),
    ],
)
def test_a_robot_is_called_as_its_file(source, label):
    assert robot_label(source) == label


def test_no_heading_is_a_path(case):
    page = identification_report(
        case.result,
        description=case.description,
        robot='/a/long path/arm.urdf',
        recordings=case.recordings[:1],
        validation={},
    )
    (title,) = re.findall('<h1>(.*?)</h1>', page)
    (subtitle,) = re.findall('class="subtitle">(.*?)</p>', page)
    assert '/' not in title and '/a/long' not in subtitle
