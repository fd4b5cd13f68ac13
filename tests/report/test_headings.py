# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Headings of pages are names, wherever the files are."""

import re

import armid_ros as ar
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


def test_no_heading_is_a_path(request, tmp_path):
    urdf = request.config.rootpath / 'examples' / 'arm.urdf'
    plan = ar.design_excitation(urdf, duration=6.0, starts=1, iterations=1, candidates=5)
    model, later = (
        ar.identify(urdf, ar.simulate(urdf, plan, torque_noise=0.05, rng=day)) for day in (0, 1)
    )
    pages = [
        model.report(tmp_path / 'model.html'),
        ar.compare(model, later).report(tmp_path / 'comparison.html'),
        ar.inspect(model.recordings[0], urdf).report(tmp_path / 'inspection.html'),
    ]
    for page in pages:
        text = page.read_text()
        (title,) = re.findall('<h1>(.*?)</h1>', text)
        (subtitle,) = re.findall('class="subtitle">(.*?)</p>', text)
        assert '/' not in title, page.name
        assert str(urdf.parent) not in subtitle, page.name
