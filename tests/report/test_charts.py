# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Charts and drawings are small, true to the data, and cannot break out of their script."""

from base64 import b64decode
from io import BytesIO
import json
import re

from armid_ros.inspection import inspect
from armid_ros.recording import Recording
from armid_ros.report.arm_drawing import draw_arm
from armid_ros.report.blocks import Bar, BarChart
from armid_ros.report.charts import (
    Chart,
    image_data,
    rounded,
    Series,
    thinned,
)
from armid_ros.report.inspection_report import inspection_report
from armid_ros.robots import robot_from_urdf
from matplotlib.image import imread
import numpy as np
import pytest

from tests.serial_arm import serial_arm


def data_of(html):
    """Return the data that a chart holds."""
    return json.loads(re.search(r'<script type="application/json">(.*?)</script>', html)[1])


def test_thinning_keeps_every_peak_and_break():
    rng = np.random.default_rng(2)
    y = rng.standard_normal(200_000)
    y[123_456] = 40.0
    y[7_890] = -35.0
    kept = thinned(y, most=2000)
    assert len(kept) <= 2002
    assert {123_456, 7_890, 0, len(y) - 1} <= set(kept)
    assert np.all(np.diff(kept) > 0)
    for samples in np.array_split(np.arange(len(y)), 500):
        inside = y[kept[np.isin(kept, samples)]]
        assert (inside.min(), inside.max()) == (y[samples].min(), y[samples].max())
    y[30_000] = np.nan
    assert 30_000 in thinned(y, most=500)


def test_rounding_is_far_below_a_pixel():
    values = 1e-4 * np.random.default_rng(3).standard_normal(1000) + 7.0
    error = np.abs(np.array(rounded(values)) - values).max()
    assert error < 1e-4 * np.ptp(values)
    assert rounded([np.nan, np.inf, 0.0]) == [None, None, 0.0]
    assert rounded([]) == []


def test_a_name_cannot_end_the_script_of_a_chart():
    name = '</script><script>alert("&")</script>\u2028'
    chart = Chart(np.arange(3.0), [Series(name, np.arange(3.0))], 'x', name)
    html = str(chart.html())
    assert html.count('<script') == html.count('</script>') == 1
    assert data_of(html)['series'][0]['label'] == name
    assert data_of(html)['ylabel'] == name


def test_bars_are_as_long_as_their_values():
    short, long = [Bar(1.0, 'before', 'one'), Bar(0.25, 'after', '1/4')], [Bar(2.0, 'before', 'b')]
    chart = BarChart([('a', short), ('b', long)])
    widths = re.findall(r'width: ([0-9.]+)%', chart.html())
    assert [float(width) for width in widths] == [50.0, 12.5, 100.0]
    assert '>1/4<' in chart.html()


def test_an_image_is_a_png_of_its_pixels():
    colour = np.array([[[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    data = image_data(colour, np.array([[1.0, -0.5]]))
    kind, _, content = data.partition(',')
    assert kind == 'data:image/png;base64'
    pixels = imread(BytesIO(b64decode(content)), format='png')
    np.testing.assert_allclose(pixels, [[[1, 0, 0, 1], [0, 0, 1, 0.5]]], atol=1 / 255)


ENDLESS = serial_arm(
    'turn continuous 0,0,1 0,0,0.2', 'lift revolute 0,1,0 0.3,0,0', centre='0 0 0'
)
ENDLESS = ENDLESS.replace('lower="-2"', 'lower="-1"')


def test_a_joint_without_end_is_drawn_at_zero_and_others_in_the_middle_of_their_range():
    robot = robot_from_urdf(ENDLESS)
    drawn = draw_arm(robot, ['turn'])
    assert drawn == draw_arm(robot, ['turn'], np.array([[0.0, 0.5]]))
    assert {name for *_, name in drawn.dots} == {'turn', 'lift'}


def test_an_arm_on_a_ceiling_hangs():
    """What the base carries is at the bottom; without gravity it is drawn as described."""
    below = {}
    for up in (-9.81, 9.81, 0.0):
        drawn = draw_arm(robot_from_urdf(ENDLESS, gravity=(0.0, 0.0, up)), [])
        corners = [float(p.split(',')[1]) for body, _ in drawn.bodies for p in body.split()]
        below[up] = max(corners) - next(y for _, y, _, name in drawn.dots if name == 'lift')
        assert drawn.gravity == bool(up)
    assert 0.0 < below[9.81] < 0.2 * below[-9.81]
    assert below[0.0] == below[-9.81]


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
