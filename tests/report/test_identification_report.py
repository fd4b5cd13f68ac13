# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report is one file that is safe to open, complete, and works in a real browser."""

from base64 import b64decode
from dataclasses import replace
from html.parser import HTMLParser
import re
from urllib.parse import unquote
from xml.sax.saxutils import quoteattr

from armid_ros.files.output import hash_files
from armid_ros.identification import (
    grade,
    IdentificationSettings,
    identify,
    PhysicalSettings,
    verify,
)
from armid_ros.motion import Motion
from armid_ros.report.identification_report import identification_report, parameter_sections
from armid_ros.report.judgement import judge
from armid_ros.report.provenance import Provenance, ResultOrigin, versions
from armid_ros.report.sections.data_quality import repeatability
from armid_ros.report.sections.fit import fit_section
import numpy as np
import pytest

from tests.diagnosis.conftest import Bench, URDF

HOSTILE = '<script>alert(1)</script>'
TITLES = [
    'Torque',
    'Residual by variable',
    'Parameters',
    'Whiteness',
    'Data quality',
    'Input',
    'Provenance',
]


class Reader(HTMLParser):
    """Collects what tags load, headings and visible text; tags have to nest."""

    def __init__(self, html):
        super().__init__()
        self.loads, self.open, self.text, self.headings = [], [], '', []
        self.feed(html)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        """Note what a tag loads."""
        if tag not in ('meta', 'link', 'img', 'input', 'br', 'i'):
            self.open.append(tag)
        for name, value in attributes:
            if name in ('src', 'href', 'srcset', 'data', 'action') and not value.startswith('#'):
                self.loads.append(value)

    def handle_endtag(self, tag):
        """Leave a tag."""
        if tag != 'i':
            assert self.open.pop() == tag

    def handle_data(self, data):
        """Collect the text."""
        if self.open and self.open[-1] not in ('script', 'style'):
            self.text += data
            if self.open[-1] == 'h2':
                self.headings.append(data)


def report_of(case, **changes):
    """Return the report of a case, or of one with something changed."""
    files = hash_files([recording.source for recording in case.recordings])
    made = Provenance(files, versions(), seed=5)
    given = {
        'description': case.description,
        'recordings': case.recordings,
        'validation': case.validation,
        'origin': ResultOrigin('humanoid_arm', provenance=made),
        **changes,
    }
    result = given.pop('result', case.result)
    training, held_out = case.recordings[:1], case.recordings[1:]
    given['parameters'] = parameter_sections(
        result, given['description'], given.pop('exports', None)
    )
    graded = grade(result, given['description'], training, given['validation'], held_out)
    return identification_report(result, graded, **given)


@pytest.fixture(scope='module')
def html(case):
    return report_of(case)


@pytest.fixture(scope='module')
def page(html):
    return Reader(html)


@pytest.fixture(scope='module')
def whole(case):
    """Return the report of a fit among bodies that was put to every test."""
    settings = IdentificationSettings(physical=PhysicalSettings())
    rng = np.random.default_rng(0)
    training, held_out = case.recordings[:1], case.recordings[1:]
    result = identify(case.description, training, settings, rng=rng)
    return report_of(
        case,
        result=result,
        verification=verify(result, case.description, training, held_out, rng=rng),
        exports={'identified.urdf': ('torque_offset: torque_offset of elbow = 0.1 N m',) * 3},
    )


@pytest.fixture(scope='module')
def hostile():
    """Return the report of a robot with a joint and a bag that are named like a script."""
    bench = Bench(URDF.replace('"elbow"', quoteattr(HOSTILE)))
    run, held_out = (replace(one, source=HOSTILE) for one in bench.recordings()[:2])
    result = identify(bench.named_friction(), [run], rng=np.random.default_rng(0))
    made = Provenance(settings={HOSTILE: HOSTILE}, command=HOSTILE)
    described, validation = bench.named_friction(), {HOSTILE: result.predict([held_out])}
    return identification_report(
        result,
        grade(result, described, [run], validation, [held_out]),
        description=described,
        recordings=[run, held_out],
        validation=validation,
        parameters=parameter_sections(result, described),
        origin=ResultOrigin(HOSTILE, provenance=made),
    )


def test_everything_asked_for_is_there_in_order(case, page):
    assert page.headings == TITLES
    for joint in case.result.arm.robot.joints:
        assert joint in page.text
    for parameter in case.result.estimate.parameters:
        assert parameter.name in page.text or parameter.joint in page.text
    for *_, digest in hash_files([case.recordings[0].source]):
        assert digest in page.text
    assert case.recordings[0].report.describe() in page.text
    assert f'{case.result.condition_number:.3g}' in page.text


def test_values_that_contradict_the_urdf_and_their_check_are_in_the_verdict(case):
    wrong = case.description.with_theta(1.5 * case.description.theta)
    command = 'armid check arm.urdf run.mcap'
    page = report_of(case, description=wrong, origin=ResultOrigin('arm.urdf', step=command))
    verdict = Reader(page).text.partition('Limitations')[0]
    assert 'rigid-body parameters of the URDF' in verdict and command in verdict
    joints = case.result.arm.robot.joints
    assert any(joint in verdict.partition('95 % intervals, at ')[2] for joint in joints)


def test_what_was_put_to_a_test_has_a_section(case, whole):
    reader = Reader(whole)
    added = {'Forward validation', 'Physical consistency', 'Encoder noise'}
    assert set(reader.headings) - set(TITLES) == added
    assert [title for title in reader.headings if title not in added] == TITLES
    for link in case.result.arm.robot.links:
        assert link in reader.text
    assert 'identified.urdf' in reader.text and '(3 values)' in reader.text


def test_periods_show_what_of_the_residual_repeats(case):
    """Noise that differs between two periods of 8 s does not repeat; a bias does."""
    ((_, (fit, *_)),) = case.validation.items()
    motion, rng = fit.motion, np.random.default_rng(0)
    noise = 0.1 * rng.normal(size=(2, *fit.predicted.shape))
    step = motion.t[1] - motion.t[0]
    twice = Motion(
        motion.joints,
        step * np.arange(2 * len(motion)),
        *(np.concatenate([x, x]) for x in (motion.q, motion.dq, motion.ddq, motion.tau)),
    )
    noise[:, :, 0] += 0.3
    repeated = replace(
        fit,
        motion=twice,
        predicted=twice.tau - noise.reshape(len(twice), -1),
        informative=np.ones(twice.q.shape, dtype=bool),
    )
    period, varying, residual = repeatability([repeated])
    assert period == pytest.approx(step * len(motion), abs=2 * step)
    np.testing.assert_allclose(varying, 0.1, rtol=0.3)
    np.testing.assert_allclose(residual, [0.3, *5 * [0.1]], rtol=0.3)
    assert repeatability([fit]) is None


@pytest.mark.parametrize(('share', 'noisier', 'warned'), [(0.3, 1.0, False), (0.3, 2.0, True)])
def test_a_residual_is_no_larger_for_a_weaker_torque(case, share, noisier, warned):
    fits = case.result.training
    weaker = [
        replace(
            fit,
            motion=replace(fit.motion, tau=share * fit.predicted + noisier * fit.residual),
            predicted=share * fit.predicted,
        )
        for fit in fits
    ]
    beware, _ = judge(case.result, {'weaker': weaker}, [])
    assert warned == any('overfits' in text for text in beware)


def test_nothing_is_loaded(page, html):
    assert {value.split(':')[0] for value in page.loads} == {'data'}
    assert '@import' not in html
    assert not re.search(r'url\(', html)
    assert "default-src 'none'" in html


@pytest.mark.long
def test_report_of_an_hour_is_below_the_limit(case):
    ((source, fits),) = case.validation.items()
    fit = fits[0]
    copies = 3600 // int(fit.motion.t[-1])
    long = tuple(
        replace(fit, motion=replace(fit.motion, t=fit.motion.t + 20.0 * k)) for k in range(copies)
    )
    text = report_of(case, validation={source: long})
    assert len(text.encode()) < 5_000_000


def test_names_that_are_scripts_stay_names(hostile):
    assert HOSTILE in Reader(hostile).text
    assert HOSTILE not in hostile


def test_residual_at_rest_is_drawn_apart(case):
    ((source, fits),) = case.validation.items()
    informative = fits[0].informative.copy()
    informative[10:20, 2] = False
    resting = replace(fits[0], informative=informative)
    section = fit_section(case.result.arm.robot, {}, {source: (resting,)}, np.zeros(6))
    name = case.result.arm.robot.joints[2]
    worst, _, first, hint, others, _ = section.blocks
    (panels,) = others.blocks
    charts = {joint: charts[1] for joint, _, charts in panels.panels}
    assert len(charts) == 5
    drawn = first if worst.text.startswith(name) else charts[name]
    still, moving = drawn.series
    residual = resting.residual[:, 2]
    np.testing.assert_array_equal(still.y[10:20], residual[10:20])
    assert np.isnan(moving.y[10:20]).all() and np.isnan(still.y).sum() == len(residual) - 10
    assert 'static friction' in hint.text


def test_browser_draws_every_chart_on_a_phone_without_complaint(
    charts_drawn, html, whole, hostile
):
    for text in (html, whole, hostile):
        charts = text.count('<figure class="chart"')
        assert charts > 5
        assert charts_drawn(text, 390, dark=True) == charts


FRAMES = 'new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))'
BUTTONS = 'document.querySelectorAll("#torque > figure .reset")'
HIDDEN = f'[...{BUTTONS}].map(button => button.hidden)'


@pytest.fixture
def first_plot(browser, tmp_path, html):
    """Open the report at a width and return where its first plot is: left, middle, width."""

    def opened(width):
        path = tmp_path / 'report.html'
        path.write_text(html, encoding='utf-8')
        browser.open(path, width)
        browser.run('document.querySelector("#torque figure.chart").scrollIntoView()')
        return browser.run(
            '(() => { const over = document.querySelector("#torque .u-over");'
            ' const box = over.getBoundingClientRect();'
            ' return [box.left, box.top + box.height / 2, box.width]; })()'
        )

    return opened


def test_dragging_zooms_torque_and_residual_and_the_button_undoes_it(browser, first_plot):
    left, middle, width = first_plot(1280)
    assert browser.run(HIDDEN) == [True, True]
    drag = (('Moved', 0.3), ('Pressed', 0.3), ('Moved', 0.5), ('Moved', 0.6), ('Released', 0.6))
    for kind, share in drag:
        browser.call(
            'Input.dispatchMouseEvent',
            type=f'mouse{kind}',
            x=left + share * width,
            y=middle,
            button='left',
            clickCount=1,
        )
    browser.run(FRAMES)
    assert browser.run(HIDDEN) == [False, False]
    browser.run(f'{BUTTONS}[1].click()')
    browser.run(FRAMES)
    assert browser.run(HIDDEN) == [True, True]
    assert browser.complaints == []


def test_two_fingers_zoom_and_a_double_tap_undoes_it(browser, first_plot):
    left, middle, width = first_plot(390)

    def touch(kind, *shares):
        points = [
            {'x': left + share * width, 'y': middle, 'id': number}
            for number, share in enumerate(shares)
        ]
        browser.call('Input.dispatchTouchEvent', type=f'touch{kind}', touchPoints=points)

    touch('Start', 0.45)
    touch('Start', 0.45, 0.55)
    touch('Move', 0.3, 0.7)
    touch('Move', 0.2, 0.8)
    touch('End')
    browser.run(FRAMES)
    assert browser.run(HIDDEN) == [False, False]
    for _ in range(2):
        touch('Start', 0.5)
        touch('End')
    browser.run(FRAMES)
    assert browser.run(HIDDEN) == [True, True]
    assert browser.complaints == []


def test_a_print_of_six_joints_has_at_most_two_pages(browser, first_plot):
    first_plot(1280)
    sheet = b64decode(browser.call('Page.printToPDF', preferCSSPageSize=True)['data'])
    pages = re.findall(rb'/Type\s*/Page\b(?!s)', sheet)
    assert 1 <= len(pages) <= 2
    assert len(sheet) > 75_000
    assert browser.complaints == []


def test_parameters_are_filtered_and_tables_are_copied(browser, first_plot):
    first_plot(1280)
    rows = '[...document.querySelectorAll("#parameters tbody tr")].filter(row => !row.hidden)'
    everything = browser.run(f'{rows}.length')
    browser.run(
        'const field = document.querySelector("#parameters input"); field.value = "ELBOW";'
        'field.dispatchEvent(new Event("input"))'
    )
    text = 'row.closest("details").textContent'
    shown = browser.run(f'{rows}.map(row => {text})')
    assert 0 < len(shown) < everything
    assert all('elbow' in text for text in shown)
    known = 'document.querySelector("#parameters button[aria-pressed]").click()'
    browser.run(f'field.value = ""; {known}')
    known = browser.run(f'{rows}.map(row => row.innerText)')
    assert 0 < len(known) < everything and not any('includes 0' in text for text in known)
    tables, buttons = (
        browser.run(f'document.querySelectorAll(".scroll {place}").length')
        for place in ('> table', '+ button.tool')
    )
    assert tables == buttons
    browser.run(
        'Object.defineProperty(navigator, "clipboard", '
        '{value: {writeText: text => { window.copied = text; }}});'
        'document.querySelector("#data-quality button.tool").click()'
    )
    assert browser.run('window.copied').startswith('"Recording","Used for"')
    browser.run(
        'HTMLAnchorElement.prototype.click = function () { window.saved = this.href; };'
        'document.querySelectorAll("figure.chart .tool")[1].click()'
    )
    table = unquote(browser.run('window.saved')).partition(',')[2].splitlines()
    assert table[0].startswith('"time [s]","measured: torque')
    assert len(table) > 100 and len(table[1].split(',')) == len(table[0].split('","'))
