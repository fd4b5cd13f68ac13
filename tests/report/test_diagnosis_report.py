# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of a diagnosis says the verdict first, and works in a real browser."""

from armid_ros.diagnosis import diagnose
from armid_ros.report.diagnosis_report import diagnosis_report
import numpy as np
import pytest

from tests.diagnosis.conftest import Bench


def hidden_drag(motion, tau):
    """Return drag of the elbow."""
    return np.outer(motion.dq[:, 1] * np.abs(motion.dq[:, 1]), [0.0, 0.08])


@pytest.fixture(scope='module')
def html():
    """Return the report of an arm with drag in its elbow."""
    bench = Bench()
    recordings = bench.recordings(hidden_drag)
    found = diagnose(
        bench.arm,
        recordings[:3],
        validate=bench.recordings(hidden_drag, seed=7)[1:2],
        rng=np.random.default_rng(0),
    )
    return diagnosis_report(
        found, robot='two_links', recordings=recordings, patch='effects:\n- name: <b>x</b>\n'
    )


def test_the_verdict_comes_first_and_the_patch_last(html):
    body = html[html.index('class="verdict') :]
    order = [
        body.index(text)
        for text in (
            'quadratic friction',
            '>Measured and modelled<',
            '>Where it lives<',
            '>Candidates<',
            '>Step by step<',
            '>What to do next<',
            '>Patch<',
        )
    ]
    assert order == sorted(order)
    assert '<b>x</b>' not in html


def test_nothing_is_loaded_from_elsewhere(html):
    assert 'https://' not in html.split('</style>')[-1].split('<script')[0]
    assert '<script src' not in html
    assert 'href="http' not in html


@pytest.mark.parametrize('width', [390, 1280])
def test_a_browser_draws_it_without_complaint(browser, tmp_path, html, width):
    path = tmp_path / 'report.html'
    path.write_text(html, encoding='utf-8')
    browser.open(path, width)
    browser.run('document.querySelectorAll("details").forEach(d => { d.open = true; })')
    browser.run('new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))')
    assert browser.complaints == []
    assert browser.run('document.documentElement.scrollWidth') <= width
    assert browser.run('document.querySelectorAll(".u-over").length') >= 4
    shown = browser.run('document.querySelector(".verdict").innerText')
    assert 'quadratic friction' in shown
