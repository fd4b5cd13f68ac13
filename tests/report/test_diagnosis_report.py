# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of a diagnosis tells the story first, and works in a real browser."""

from dataclasses import replace
import re

from armid_ros.diagnosis import diagnose
from armid_ros.diagnosis.next_run.steps import next_steps
from armid_ros.diagnosis.search.spans import Span
from armid_ros.effects import CATALOGUE
from armid_ros.identification.assess.verification import simulate_held_out
from armid_ros.identification.rows.signals import conditioning, SignalSettings
from armid_ros.report.diagnosis_report import (
    diagnosis_report,
    overlay_section,
    Story,
    whole_overlays,
)
from armid_ros.report.notation import (
    DASH,
    digits,
    percent,
    plain,
    with_interval,
)
from armid_ros.report.provenance import ResultOrigin
from armid_ros.report.sections.diagnosed import (
    candidates_section,
    evidence_section,
    share_bars,
)
import numpy as np
import pytest

from tests.diagnosis.conftest import Bench


def hidden_drag(motion, tau):
    """Return drag of the elbow."""
    return np.outer(motion.dq[:, 1] * np.abs(motion.dq[:, 1]), [0.0, 0.08])


@pytest.fixture(scope='module')
def recordings():
    """Return recordings of an arm with drag in its elbow, in folders with long names."""
    found = Bench().recordings(hidden_drag)
    return [replace(r, source=f'/data/of/{r.source}/run') for r in found]


@pytest.fixture(scope='module')
def found(recordings):
    """Return the diagnosis of an arm with drag in its elbow."""
    bench = Bench()
    return diagnose(
        bench.arm,
        recordings[:3],
        validate=bench.recordings(hidden_drag, seed=7)[1:2],
        rng=np.random.default_rng(0),
    )


@pytest.fixture(scope='module')
def html(found, recordings):
    """Return the report."""
    return diagnosis_report(
        found,
        {'training': recordings},
        steps=next_steps(found),
        origin=ResultOrigin('/home/me/two_links.urdf'),
    )


@pytest.fixture(scope='module')
def quiet():
    """Return the report of an arm that is as its model."""
    bench = Bench()
    recordings = bench.recordings()
    found = diagnose(bench.arm, recordings, rng=np.random.default_rng(0))
    return diagnosis_report(found, {'training': recordings}, origin=ResultOrigin('two_links'))


def test_the_story_comes_first_and_what_was_looked_at_last(html):
    body = html[html.index('class="verdict') :]
    order = [
        body.index(text)
        for text in (
            'Quadratic friction',
            'Next:',
            'share of the difference',
            '>Measured and modelled<',
            '>Arm and model<',
            '<svg class="arm"',
            '<dt>Model</dt>',
            '>Error of each joint</h2>',
            '>Parameters</h2>',
            '>Residual by variable<',
            '>What to do next<',
            '>Candidates<',
        )
    ]
    assert order == sorted(order)


def test_the_joint_with_the_cause_is_the_one_that_is_drawn_in_colour(html, quiet):
    drawing = html[html.index('<svg class="arm"') : html.index('</svg>')]
    assert re.findall(r'fill="var\(--predicted\)"[^>]*><title>([^<]*)<', drawing) == ['elbow']
    assert re.findall('font-weight="600"[^>]*>([^<]*)<', drawing) == ['elbow']
    assert drawing.count('<circle') == 2
    assert drawing.count('<line') == 1  # to the name
    assert drawing.count('polygon') == 3  # to the shoulder, and two links
    plain = quiet[quiet.index('<svg class="arm"') : quiet.index('</svg>')]
    assert 'var(--predicted)' not in plain
    assert 'class="verdict fair"' in html  # amber
    assert 'class="verdict good"' in quiet and 'bar role-before' not in quiet


def test_causes_that_are_one_have_one_bar(found):
    (finding,) = found.findings
    twin = replace(finding, name='base_tilt', joints=(), together=(finding.name,))
    both = replace(found, findings=(replace(finding, together=('base_tilt',)), twin))
    rows = share_bars(both).rows
    assert len(rows) == 2
    assert 'quadratic friction' in rows[0][0] and 'base tilt' in rows[0][0]
    assert sum(bar.value for _, bars in rows for bar in bars) == pytest.approx(1.0)


def test_what_is_not_checked_is_said_in_short(found):
    nothing = replace(found, verdict='consistent', findings=(), where=(), left=())
    still = [replace(part, unsure=np.array([0.0, np.inf]) + part.unsure) for part in found.data]
    assert dict(Story(replace(nothing, data=tuple(still))).rows)['Not checked'] == ['elbow']
    assert 'Not checked' not in dict(Story(nothing).rows)


def test_a_model_that_simulates_worse_has_a_limitation(found, recordings, html):
    used = conditioning(recordings, SignalSettings())
    spring = CATALOGUE['joint_spring'].on(found.arm.robot, ('elbow',))
    wrong = found.arm.with_effect(spring, np.array([30.0, 0.0]))
    pairs, *_ = simulate_held_out(found.arm, wrong, used, recordings[:1])
    page = diagnosis_report(
        found, {'training': recordings}, origin=ResultOrigin('arm'), forward=pairs
    )
    worse = [joint for pair in pairs for joint in pair.worse]
    assert 'elbow' in worse
    assert 'class="beware"' in page and 'class="beware"' not in html


def test_bad_data_have_no_green_tick():
    bench = Bench()
    turned = [replace(r, tau=-r.tau) for r in bench.recordings()]
    found = diagnose(bench.arm, turned, rng=np.random.default_rng(0))
    assert found.verdict == 'bad_data'
    page = diagnosis_report(found, {'training': turned}, origin=ResultOrigin('two_links'))
    assert 'class="fine"' not in page
    sources = 'before', 'speed 1', f'{turned[0].source}5'  # the last two begin as those at fault
    sound = [
        replace(one, source=source)
        for source, one in zip(sources, bench.recordings(seed=1), strict=True)
    ]
    both = {'training': turned, 'baseline': sound}
    beside = diagnosis_report(found, both, origin=ResultOrigin('two_links'))
    assert beside.count('class="fine"') == len(sound)


def test_no_candidate_has_a_value_that_it_cannot_have(found, html):
    ranking = found.explanation.candidates
    rows = candidates_section(found).blocks[0].blocks[1].rows
    assert rows[0][0].kind == 'changed'
    assert all(float(row[2].rstrip(' %')) <= 100.0 for row in rows)
    negative = [
        row
        for row, trial in zip(rows, ranking, strict=False)
        if np.all(trial.effect.bounds()[0] >= 0.0) and row[4].startswith('-')
    ]
    assert not negative
    shown = re.sub('<[^>]*>', '', re.sub('<script.*?</script>', '', html[html.index('<main>') :]))
    assert not re.search(r'\de\+\d\d|\binf\b|\bnan\b', shown)


def test_a_browser_draws_it_without_complaint(browser, charts_drawn, html):
    assert charts_drawn(html, 390, dark=False) >= 4
    shown = browser.run('document.querySelector(".verdict").innerText')
    assert 'Quadratic friction' in shown
    arm, chart = (
        f'document.querySelector("{what}").getBoundingClientRect()'
        for what in ('svg.arm', '.u-over')
    )
    assert browser.run(f'{arm}.width') > 200
    assert browser.run(f'{chart}.top') < 800  # the torque is above the fold


def test_seconds_of_a_cause_are_marked_in_the_curve_of_the_whole_recording(found, recordings):
    source = found.gap.overlays[0].trajectory.source
    short = [one for one in found.gap.overlays if one.trajectory.source == source]
    read = [replace(recordings[0], source=source)]
    some = replace(found, spans=(Span(source, 2.0, 3.0, False),))
    gap = whole_overlays(replace(some, gap=replace(found.gap, overlays=tuple(short))), read)
    (whole,) = gap.overlays
    assert whole.trajectory.t[0] < 2.0 and whole.trajectory.t[-1] > 3.0
    acts = (whole.trajectory.t >= 2.0) & (whole.trajectory.t <= 3.0)
    differs = np.any(whole.after != whole.before, axis=1)
    assert differs[acts].any() and not differs[~acts].any()
    _, torque, residual, _ = overlay_section(some, gap).blocks
    for chart in (torque, residual):
        assert [x for x, *_ in chart.marks] == [2.0, 3.0]
    assert {'2.0', '3.0'} <= set(dict(Story(some).rows)['When'][0].split())


def test_curves_of_where_it_lives_are_without_the_mean_which_is_said(found):
    place = replace(found.where[0], mean=2.0, mean_share=0.9)
    said, panels = evidence_section(replace(found, where=(place,))).blocks[0].blocks
    assert '2.0 N' in said.text and '90 %' in said.text
    for axis, (caption, _, (chart,)) in zip(place.axes, panels.panels, strict=True):
        np.testing.assert_allclose(chart.series[0].y, axis.means - 2.0)
        share = 100.0 * max(axis.share - 0.9, 0.0) / 0.1
        assert f'{share:.0f} %' in caption or share < 2.0
    still = replace(found, where=(replace(place, mean_share=0.0),))
    assert len(evidence_section(still).blocks[0].blocks) == 1


@pytest.mark.parametrize(
    ('value', 'std', 'unit', 'text'),
    [
        (3.04, 0.0255, 'kg', '3.040 ± 0.050 kg'),
        (0.1, 0.01, 'rad', '0.100 ± 0.020 rad (5.7 ± 1.1°)'),
        (0.1, np.inf, 'kg m^2', '0.1 kg m²'),
        (np.nan, 1.0, 'kg', DASH),
        (-1e-6, 0.0007, 'kg', '0.0000 ± 0.0014 kg'),
    ],
)
def test_a_value_has_as_many_digits_as_its_interval(value, std, unit, text):
    assert with_interval(value, std, unit) == text


def test_numbers_without_an_interval_have_three_digits():
    assert digits(-0.0) == '0.0'
    assert {digits(x) for x in (1e38, np.inf, np.nan)} == {DASH}
    assert [percent(x).rstrip(' %') for x in (0.957, 0.004, 0.0)] == ['96', '0.4', '0']
    assert [plain(x) for x in (12.34, 0.0071, 3000.0)] == ['12.3', '0.0071', '3000']
