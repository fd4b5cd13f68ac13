# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium, and an identification for reports."""

from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.excitation import Excitation, Limits, random_feasible
from armid_ros.identification import Fit, Identification, identify
from armid_ros.recording import read_recording, Recording, write_recording
from armid_ros.robots import load_robot
from armid_ros.simulation import Sensors, simulate
import numpy as np
import pytest

from tests.report.browser import Browser, BROWSERS, find_browser

RATE = 100.0


@pytest.fixture(scope='session')
def browser(tmp_path_factory):
    """Start a headless Chromium; skip the test if none is installed."""
    command = find_browser()
    if command is None:
        pytest.skip(f'no browser to look at reports with: none of {", ".join(BROWSERS)}')
    browser = Browser(command, tmp_path_factory.mktemp('profile'))
    yield browser
    browser.close()


DRAWN = (
    '[...document.querySelectorAll("figure.chart canvas")].filter(canvas => '
    'new Set(canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height)'
    '.data).size > 8).length'
)


@pytest.fixture
def charts_drawn(browser, tmp_path):
    """Return a function that opens a page with all its details, and counts drawn charts."""

    def count(html, width, dark):
        path = tmp_path / 'report.html'
        path.write_text(html, encoding='utf-8')
        browser.open(path, width, dark=dark)
        browser.run('document.querySelectorAll("details").forEach(d => { d.open = true; })')
        browser.run(
            'new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))'
        )
        assert browser.complaints == []
        assert all(url.startswith(('file:', 'data:')) for url in browser.requested)
        assert browser.run('document.documentElement.scrollWidth') <= width
        return browser.run(DRAWN)

    return count


@dataclass(frozen=True)
class Case:
    """An identification with its true arm, description, motion and recordings."""

    truth: ArmModel
    description: ArmModel
    excitation: Excitation
    recordings: tuple[Recording, ...]
    result: Identification
    validation: dict[str, tuple[Fit, ...]]


@pytest.fixture(scope='session')
def case(tmp_path_factory):
    """Identify the simulated humanoid arm on the moon from one run; another one is held out."""
    rng = np.random.default_rng(5)
    robot = load_robot('humanoid_arm', gravity='moon')
    truth = description = ArmModel(robot)
    for name, share in (('viscous_friction', 0.004), ('coulomb_friction', 0.01)):
        effect = make_effect(name, robot)
        truth = truth.with_effect(effect, share * robot.torque_limit)
        description = description.with_effect(effect)
    sensors = Sensors(torque_noise=0.003 * robot.torque_limit, position_noise=2e-5)
    recordings = []
    for name in ('train', 'held_out'):
        trajectory = random_feasible(truth, Limits.of(robot), 8.0, 5, rng)
        excitation = Excitation(trajectory, 1, 1.0)
        run = simulate(truth, excitation.motion(RATE), rng=rng, rate=RATE, sensors=sensors)
        bag = tmp_path_factory.mktemp('bags') / name
        write_recording(bag, run)
        recordings.append(read_recording(bag, joints=robot.joints))
    result = identify(description, recordings[:1], rng=rng)
    validation = {recordings[1].source: result.predict(recordings[1:])}
    return Case(truth, description, excitation, tuple(recordings), result, validation)
