# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of elastic joints shows what was measured beside what was found."""

from armid_ros.papers.elastic.identification import identify_two_inertia
from armid_ros.papers.elastic.plant.run import ElasticSensors, run_all
from armid_ros.papers.elastic.plant.signals import (
    EXCITATION_RMS,
    resonance_experiments,
    step_experiments,
    STEP_POSES,
    STEPS,
    WEAK,
)
from armid_ros.papers.elastic.report.page import elastic_report
from armid_ros.robots.two_link import two_link_set
from armid_ros.simulation.elastic.two_link import two_link_loop, two_link_plant
import numpy as np
import pytest

SHIPPED = two_link_set('after')


@pytest.fixture(scope='module')
def result():
    """Identify the shipped arm from three experiments and four steps."""
    rng = np.random.default_rng(0)
    plant, loop = two_link_plant(SHIPPED.parameters), two_link_loop(SHIPPED)
    noise = ElasticSensors(motor_velocity=0.002, link_velocity=0.002, link_acceleration=0.1)
    plans = (
        (two_link_loop(SHIPPED, WEAK), resonance_experiments(3, rms=EXCITATION_RMS, rng=rng)),
        (loop, step_experiments(STEP_POSES, STEPS, duration=0.3)),
    )
    runs, steps = (
        [noise.measure(run, rng) for run in run_all(plant, control, plan)]
        for control, plan in plans
    )
    begin = two_link_set('before').parameters
    return identify_two_inertia(runs, SHIPPED.parameters, steps=steps, loop=loop, start=begin)


@pytest.fixture(scope='module')
def html(result):
    """Return the report, with a hostile name."""
    return elastic_report(
        result, 'two <b>links</b>', known=SHIPPED.parameters, source='the printed table'
    )


def test_the_verdict_comes_first_then_responses_steps_and_parameters(html):
    body = html[html.index('class="verdict') :]
    order = [
        body.index(text)
        for text in (
            'The springs have',
            '>Frequency responses<',
            '>Step responses<',
            '>Parameters<',
            'the printed table',
            '>Rigid arm<',
            '>Provenance<',
        )
    ]
    assert order == sorted(order)
    assert '<b>links</b>' not in html


def test_without_steps_there_are_no_intervals_and_the_report_says_so(result):
    from dataclasses import replace

    page = elastic_report(replace(result, tuning=None), 'two_link_elastic')
    assert 'no intervals' in page
    assert 'Step responses</h2>' not in page
    assert '± 95 %</th><th class="number wide">' not in page


def test_a_browser_draws_it_without_complaint(browser, charts_drawn, html):
    assert charts_drawn(html, 390, dark=False) == 6 + 8
    shown = browser.run('document.body.innerText')
    for text in ('antiresonance', 'resonance', 'dB rms', 'N m/rad', 'gear²', 'Difference'):
        assert text.lower() in shown.lower()


def test_frequencies_are_drawn_on_a_logarithmic_axis(browser, tmp_path, html):
    """Two places one octave apart are as far from each other wherever they are."""
    path = tmp_path / 'report.html'
    path.write_text(html, encoding='utf-8')
    browser.open(path, 1200)
    axis = """(() => {
      const over = document.querySelector('.u-over'), box = over.getBoundingClientRect();
      const at = (share) => {
        over.dispatchEvent(new MouseEvent('mousemove', {clientX: box.left + share * box.width,
          clientY: box.top + 5, bubbles: true}));
        return new Promise((done) => requestAnimationFrame(() => done(
          Number(document.querySelector('.u-legend .u-value').textContent))));
      };
      over.dispatchEvent(new MouseEvent('mouseenter', {clientX: box.left, clientY: box.top}));
      return at(0.25).then((a) => at(0.5).then((b) => at(0.75).then((c) => [a, b, c])));
    })()"""
    low, middle, high = browser.run(axis)
    assert middle / low == pytest.approx(high / middle, rel=0.05)
