# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of elastic joints shows what was measured beside what was found."""

import pytest


@pytest.fixture(scope='module')
def html(demo):
    """Return the report of the demo."""
    return (demo / 'report.html').read_text(encoding='utf-8')


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
