# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of a diagnosis tells the story first, and works in a real browser."""

from dataclasses import replace
import re
from types import SimpleNamespace

from armid_ros.diagnosis import diagnose
from armid_ros.diagnosis.search.spans import Span
from armid_ros.effects import CATALOGUE
from armid_ros.identification.assess.verification import simulate_held_out
from armid_ros.identification.rows.signals import conditioning, SignalSettings
from armid_ros.motion import Motion
from armid_ros.report.diagnosis_report import diagnosis_report, Extras, Story, tone_of
from armid_ros.report.notation import (
    DASH,
    digits,
    percent,
    plain,
    short_names,
    with_interval,
    with_names,
)
from armid_ros.report.sections.diagnosed import (
    candidates_section,
    evidence_section,
    gap_section,
    named_section,
    share_bars,
)
from armid_ros.report.sections.fit import forward_section
from armid_ros.report.sections.overlay import overlay_section, whole_overlays
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
        robot='/home/me/two_links.urdf',
        patch='effects:\n- name: <b>x</b>\n',
    )


@pytest.fixture(scope='module')
def quiet():
    """Return the report of an arm that is as its model."""
    bench = Bench()
    recordings = bench.recordings()
    found = diagnose(bench.arm, recordings, rng=np.random.default_rng(0))
    return diagnosis_report(found, {'training': recordings}, robot='two_links')


def test_the_story_comes_first_and_what_was_looked_at_last(html):
    body = html[html.index('class="verdict') :]
    order = [
        body.index(text)
        for text in (
            'Quadratic friction',
            'share of the <abbr',
            '>Measured and modelled<',
            '>In short<',
            '<svg class="arm"',
            '<dt>Where</dt>',
            '<dt>Gap</dt>',
            '>Gap</h2>',
            '>Parameters</h2>',
            '>Where it shows<',
            '>What to do next<',
            '>Candidates<',
            '>Patch</h2>',
        )
    ]
    assert order == sorted(order)
    assert '<b>x</b>' not in html


def test_the_joint_with_the_cause_is_the_one_that_is_drawn_in_colour(html, quiet):
    drawing = html[html.index('<svg class="arm"') : html.index('</svg>')]
    assert re.findall('font-weight="600"[^>]*>([^<]*)<', drawing) == ['elbow']
    assert drawing.count('<circle') == 2
    assert drawing.count('<line') == 1  # to the name
    assert drawing.count('polygon') == 3  # to the shoulder, and two links
    plain = quiet[quiet.index('<svg class="arm"') : quiet.index('</svg>')]
    assert 'var(--predicted)' not in plain


def test_causes_that_are_one_have_one_bar(found):
    (finding,) = found.findings
    twin = replace(finding, name='base_tilt', joints=(), together=(finding.name,))
    both = replace(found, findings=(replace(finding, together=('base_tilt',)), twin))
    rows = share_bars(both).rows
    assert len(rows) == 2
    assert 'quadratic friction' in rows[0][0] and 'base tilt' in rows[0][0]
    assert sum(bar.value for _, bars in rows for bar in bars) == pytest.approx(1.0)


def test_a_gap_of_the_fitted_data_alone_is_said_to_be_one(found):
    (_, before), *_ = Story(found).rows
    quiet_there = replace(found.gap, chi2_before=0.9 * np.ones(2), predicted=True)
    (_, lines), *_ = Story(replace(found, gap=quiet_there)).rows
    assert 'elbow' in lines[0] and 'fitted' in lines[0]
    assert lines != before


def test_what_was_added_to_the_model_is_said(found, recordings, html):
    worse = replace(found, harmful=True)
    page = diagnosis_report(worse, {'training': recordings}, robot='two_links')
    assert '>Patch</h2>' in html and '>Patch</h2>' not in page


def test_what_is_not_checked_is_said_in_short(found):
    nothing = replace(found, verdict='consistent', findings=(), where=(), left=())
    still = [replace(part, unsure=np.array([0.0, np.inf]) + part.unsure) for part in found.data]
    rows = dict(Story(replace(nothing, data=tuple(still))).rows)
    assert 'elbow' in rows['Where'][1]
    assert len(dict(Story(nothing).rows)['Where']) == 1


def test_values_of_a_body_are_in_words_and_those_told_from_zero_come_first(found):
    effect = CATALOGUE['link_inertia'].on(found.arm.robot, ('elbow',))
    names = effect.parameters(found.arm.robot)
    values = tuple(0.5 if name.unit == 'kg m^2' else 0.0 for name in names)
    numbers = {'values': values, 'std': (0.01,) * len(names), 'added_to': ()}
    link = replace(found.findings[0], name='link_inertia', parameters=names, **numbers)
    rows = named_section((link,)).blocks[0].rows
    assert rows[0][1].endswith('of mass') and rows[1][1].endswith('along x')
    values = tuple({'kg': 2.0, 'kg m': 0.5}.get(name.unit, 0.0) for name in names)
    rows = named_section((replace(link, values=values, weighs=True),)).blocks[0].rows
    centres = [row[3] for row in rows if 'centre of mass' in row[1]]
    assert len(centres) == 3 and all(text.startswith('0.25') for text in centres)


def test_a_model_that_simulates_worse_is_not_green(found, recordings, html):
    used = conditioning(recordings, SignalSettings())
    spring = CATALOGUE['joint_spring'].on(found.arm.robot, ('elbow',))
    wrong = found.arm.with_effect(spring, np.array([30.0, 0.0]))
    pairs, *_ = simulate_held_out(found.arm, wrong, used, recordings[:1])
    extras = Extras(forward=pairs)
    page = diagnosis_report(found, {'training': recordings}, robot='arm', extras=extras)
    assert 'elbow' in extras.worse
    assert (tone_of(found), tone_of(found, extras.worse)) == ('good', 'fair')
    assert 'class="verdict fair"' in page and 'class="verdict good"' in html


def test_bad_data_have_no_green_tick():
    bench = Bench()
    turned = [replace(r, tau=-r.tau) for r in bench.recordings()]
    found = diagnose(bench.arm, turned, rng=np.random.default_rng(0))
    assert found.verdict == 'bad_data'
    page = diagnosis_report(found, {'training': turned}, robot='two_links')
    assert 'class="fine"' not in page
    sound = [replace(one, source=f'before {k}') for k, one in enumerate(bench.recordings(seed=1))]
    both = {'training': turned, 'baseline': sound}
    beside = diagnosis_report(found, both, robot='two_links')
    assert beside.count('class="fine"') == len(sound)


def test_recordings_have_names_and_paths_are_left_to_the_provenance(html):
    shown = html[html.index('<h1>') :]
    assert '/data/of' not in shown
    assert 'speed 0.6/run' in shown
    assert '/home/me' not in shown


def test_no_candidate_has_a_value_that_it_cannot_have(found, html):
    ranking = found.explanation.survey.ranking
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


def test_numbers_are_written_as_a_person_reads_them():
    assert with_interval(3.04, 0.0255, 'kg') == '3.040 ± 0.050 kg'
    assert with_interval(0.1, 0.01, 'rad') == '0.100 ± 0.020 rad (5.7 ± 1.1°)'
    assert with_interval(0.1, float('inf'), 'kg m^2') == '0.1 kg m²'
    assert with_interval(float('nan'), 1.0, 'kg') == DASH
    assert with_interval(-1e-6, 0.0007, 'kg') == '0.0000 ± 0.0014 kg'
    assert digits(-0.0) == '0.0'
    assert digits(1e38) == digits(float('inf')) == digits(float('nan')) == DASH
    assert [percent(x) for x in (0.957, 0.004, 0.0)] == ['96 %', '0.4 %', '0 %']


def test_names_of_recordings_are_as_short_as_they_can_be():
    names = short_names(['/a/day_1/run', '/a/day_2/run', 'other', '/b/other.mcap', '/x/y/z'])
    assert list(names.values()) == ['day_1/run', 'day_2/run', 'other', 'other.mcap', 'z']
    assert with_names('/x/y/z: short; other', names) == 'z: short; other'


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


def test_a_joint_whose_rows_tell_nothing_is_drawn_all_the_same(found):
    """A joint that rests in a recording has its torque shown from end to end."""

    def resting(overlay):
        unsure = np.full_like(overlay.trajectory.unsure, np.inf)
        return replace(overlay, trajectory=replace(overlay.trajectory, unsure=unsure))

    gap = replace(found.gap, overlays=tuple(resting(one) for one in found.gap.overlays))
    _, torque, _, _ = overlay_section(found.arm.robot, gap, True, {}).blocks
    shown = gap.overlays
    assert len(torque.x) > 10
    assert any(torque.x[-1] == pytest.approx(one.trajectory.t[-1], abs=0.1) for one in shown)


def test_seconds_of_a_cause_are_marked_in_the_curve_of_the_whole_recording(found, recordings):
    source = found.gap.overlays[0].source
    short = [one for one in found.gap.overlays if one.source == source]
    read = [replace(recordings[0], source=source)]
    some = replace(found, spans=(Span(source, 2.0, 3.0, False),))
    gap = whole_overlays(replace(some, gap=replace(found.gap, overlays=tuple(short))), read)
    (whole,) = gap.overlays
    assert whole.trajectory.t[0] < 2.0 and whole.trajectory.t[-1] > 3.0
    acts = (whole.trajectory.t >= 2.0) & (whole.trajectory.t <= 3.0)
    differs = np.any(whole.after != whole.before, axis=1)
    assert differs[acts].any() and not differs[~acts].any()
    _, torque, residual, _ = overlay_section(found.arm.robot, gap, True, {}, some.spans).blocks
    for chart in (torque, residual):
        assert [mark.x for mark in chart.marks] == [2.0, 3.0]
    assert '2.0 to 3.0 s' in dict(Story(some).rows)['When'][0]


def test_curves_of_where_it_lives_are_without_the_mean_which_is_said(found):
    place = replace(found.where[0], mean=2.0, mean_share=0.9)
    said, panels = evidence_section([place]).blocks[0].blocks
    assert '2.0 N m' in said.text and '90 %' in said.text
    for axis, (caption, _, (chart,)) in zip(place.axes, panels.panels, strict=True):
        np.testing.assert_allclose(chart.series[0].y, axis.means - 2.0)
        share = 100.0 * max(axis.share - 0.9, 0.0) / 0.1
        assert f'{share:.0f} %' in caption or share < 2.0
    assert len(evidence_section([replace(place, mean_share=0.0)]).blocks[0].blocks) == 1


@pytest.mark.parametrize(
    ('before', 'after', 'worst'), [(5.0, 1.0, 'shoulder'), (1.0, 2.0, 'elbow')]
)
def test_the_curve_of_the_forward_validation_is_of_the_joint_that_is_said(
    found, before, after, worst
):
    """The joint that one of both models is off most, not that of the patched model alone."""
    t = np.linspace(0.0, 1.0, 5)
    q = np.zeros((5, 2))
    motion = Motion(found.arm.robot.joints, t, q, q, q)

    def score(errors):
        return SimpleNamespace(
            position_error=np.array(errors),
            torque_error=np.ones(2),
            units=('rad', 'rad'),
            simulated=q + errors,
            motion=motion,
            source='run',
            worst='',
        )

    pair = SimpleNamespace(
        before=score([before, 0.1]), after=score([0.1, after]), comment=lambda: ''
    )
    *_, chart = forward_section(found.arm.robot, [pair]).blocks[1].blocks
    assert chart.ylabel.startswith(f'{worst}: ')


def test_a_joint_of_which_no_row_counts_has_no_error_of_zero(found):
    gap = found.gap
    none = {
        name: np.where([True, False], 0.0, getattr(gap, name))
        for name in ('before', 'after', 'floor')
    }
    bars = gap_section(found.arm.robot, replace(gap, **none), 'noise', True).blocks[1].rows
    assert [bar.text for bar in bars[-1][1]] == ['not judged']  # the worst joint comes first
    assert len(bars[0][1]) == 3


@pytest.mark.parametrize(
    ('value', 'text'),
    [(5.0, '5'), (12.34, '12.3'), (0.0071, '0.0071'), (999.7, '1000'), (3000.0, '3000')],
)
def test_large_numbers_have_no_exponent(value, text):
    assert plain(value) == text
