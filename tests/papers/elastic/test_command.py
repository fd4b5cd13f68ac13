# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid elastic`, from simulated bags to parameters."""

from __future__ import annotations

import json

from armid_ros.cli.record import simulate
from armid_ros.errors import RecordingError, RobotError
from armid_ros.excitation import Excitation, FourierTrajectory, save_excitation
from armid_ros.papers.elastic.command import elastic
from armid_ros.papers.elastic.identification.files import read_runs
from armid_ros.robots import load_robot
from armid_ros.robots.two_link import two_link_set
from click.testing import CliRunner
import numpy as np
import pytest

from docsite.schemas import faults
from tests.cli.conftest import armid

pytestmark = pytest.mark.slow


def stiffness(document):
    """Return both spring stiffnesses of a document [N m/rad]."""
    return [row['value'] for row in document['parameters'] if row['name'] == 'kg']


def test_demo_finds_the_springs(demo) -> None:
    document = json.loads((demo / 'elastic.json').read_text())
    wanted = two_link_set('after').parameters.stiffness.tolist()
    assert document['schema'] == 'armid/elastic/1'
    assert faults('elastic', document) == []
    assert stiffness(document) == pytest.approx(wanted, rel=0.02)
    assert 'Table 1 of the source' in (demo / 'report.html').read_text(encoding='utf-8')


def test_demo_tells_the_story_of_the_tuning(demo) -> None:
    """From the printed set before tuning to that after it, of which the arm is made."""
    story = json.loads((demo / 'elastic.json').read_text())['story']
    assert story['main_parameters_percent_before'] > 50.0
    assert story['main_parameters_percent_after'] < 0.5
    assert story['factor'] > 150.0


def test_bags_give_the_same_again_and_no_steps_leave_out_the_tuning(demo, tmp_path) -> None:
    arguments = [str(demo / 'resonances'), '--out', str(tmp_path / 'again')]
    result = CliRunner().invoke(elastic, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    assert 'antiresonance' in result.stdout
    again = json.loads((tmp_path / 'again' / 'elastic.json').read_text())
    assert 'tuning' not in again
    page = (tmp_path / 'again' / 'report.html').read_text(encoding='utf-8')
    assert 'Step responses</h2>' not in page
    assert faults('elastic', again) == []
    assert again['untuned'] == json.loads((demo / 'elastic.json').read_text())['untuned']


def test_a_simulated_arm_on_springs_is_recorded_on_both_sides(tmp_path) -> None:
    trajectory = tmp_path / 'swing.yaml'
    swing = FourierTrajectory(
        ('joint1', 'joint2'), 1.0, np.zeros(2), np.full((2, 1), 0.5), np.zeros((2, 1))
    )
    save_excitation(Excitation(swing, 1, 0.5), trajectory)
    arguments = ['--robot', 'two_link_elastic', '--trajectory', str(trajectory), '--out']
    result = CliRunner().invoke(simulate, [*arguments, str(tmp_path / 'bag')])
    assert result.exit_code == 0 and 'both sides' in result.stdout
    robot, radius = load_robot('two_link_elastic'), [0.4, 0.4]
    (run,) = read_runs(tmp_path / 'bag', robot, radius)
    parameters = two_link_set('after').parameters
    spring = parameters.stiffness * (run.motor.q - run.link.q)
    spring += parameters.spring_damping * (run.motor.dq - run.link.dq)
    inertia = np.array([parameters.mass_matrix(angle) for angle in run.link.q[:, 1]])
    load = np.einsum('nij,nj->ni', inertia, run.link.ddq) + parameters.link_damping * run.link.dq
    still = np.abs(run.link.dq).max(axis=1) < 0.05  # where nothing is centrifugal
    assert np.count_nonzero(still) > 10
    np.testing.assert_allclose(spring[still], load[still], atol=0.02 * np.abs(load).max())


def test_an_arm_that_is_not_the_shipped_one_is_not_compared_with_its_table(demo, tmp_path) -> None:
    urdf = tmp_path / 'mine.urdf'
    text = load_robot('two_link_elastic').urdf
    urdf.write_text(text.replace('name="two_link_elastic"', 'name="mine"'), encoding='utf-8')
    arguments = [str(demo / 'resonances'), '--robot', str(urdf), '--out', str(tmp_path / 'out')]
    result = CliRunner().invoke(elastic, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    assert 'Table 1' not in (tmp_path / 'out' / 'report.html').read_text(encoding='utf-8')


@pytest.mark.parametrize(
    'arguments, error, message',
    [
        ([], RecordingError, 'no bag is named'),
        (['missing'], RecordingError, 'there is no such bag'),
        (['x', '--robot', 'humanoid_arm'], RecordingError, 'there is no such bag'),
        (['--demo', '--robot', 'humanoid_arm'], RobotError, 'joint by joint'),
        (['x', '--model', 'model.yaml'], RobotError, 'which find the inertias'),
        (['x', '--gear', '50'], RobotError, '--gear takes two positive numbers'),
    ],
)
def test_bad_input_is_said(arguments, error, message, tmp_path) -> None:
    result = CliRunner().invoke(elastic, [*arguments, '--out', str(tmp_path / 'out')])
    assert isinstance(result.exception, error)
    assert message in str(result.exception)


@pytest.mark.parametrize(('kind', 'experiments'), [('multisine', 1), ('steps', 2)])
def test_what_shows_springs_is_followed_by_the_elastic_arm(tmp_path, kind, experiments):
    robot, rng = load_robot('two_link_elastic'), ('--seed', 1)
    plan, run = tmp_path / 'plan', tmp_path / 'run'
    armid('excite', '--robot', robot.name, '--kind', kind, '--duration', 7, *rng, '--out', plan)
    armid('simulate', '--robot', robot.name, '--trajectory', plan / 'trajectory', '--out', run)
    runs = read_runs(run, robot, [0.4, 0.4])
    assert len(runs) == experiments
    if kind == 'multisine':
        assert np.all(runs[0].motor.tau.std(axis=0) > 0.05 * robot.torque_limit)


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
