# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Names count when questions agree on them; a person has the last word."""

from types import SimpleNamespace

from armid_ros.errors import IdentificationError
from armid_ros.nodes.live import Answer, LiveDiagnosis, LiveSettings
from armid_ros.nodes.live.request import WAITING
import numpy as np
import pytest


class Named:
    """As much of a finding as the schedule reads."""

    def __init__(self, name, *joints):
        self.name, self.joints = name, joints


def said(arm, verdict, *findings, duration=8.0, end=0.0, changed=False):
    window = SimpleNamespace(duration=duration)
    return Answer(verdict, verdict, arm, window, end, 0.0, changed, findings)


@pytest.fixture
def live(known_arm):
    return LiveDiagnosis(known_arm, LiveSettings(learning=0.0))


@pytest.fixture
def patched(known_arm):
    return known_arm.with_theta(known_arm.theta)


FRICTION, SPRING = Named('viscous_friction', 'elbow'), Named('joint_spring', 'elbow')


def test_names_that_do_not_agree_do_not_count(live, known_arm, patched):
    for finding in (FRICTION, SPRING, FRICTION, SPRING):
        live.take(said(patched, 'named', finding))
    assert live.model is known_arm


@pytest.mark.parametrize('between', ['consistent', 'unknown', 'bad_data', WAITING])
def test_what_names_nothing_begins_the_count_anew(live, known_arm, patched, between):
    for answer in (
        said(patched, 'named', FRICTION),
        said(known_arm, between),
        said(patched, 'named', FRICTION),
    ):
        live.take(answer)
    assert live.proposed is None


def test_what_was_rejected_is_not_proposed_again(live, known_arm, patched):
    for _ in range(2):
        live.take(said(patched, 'named', FRICTION))
    live.reject()
    assert live.model is known_arm
    for _ in range(3):
        live.take(said(patched, 'named', FRICTION))
    assert live.model is known_arm
    for _ in range(2):
        live.take(said(patched, 'named', SPRING))
    assert live.model is patched


@pytest.mark.parametrize('said_by_a_person', [LiveDiagnosis.accept, LiveDiagnosis.reject])
def test_an_answer_about_the_arm_before_is_dropped(live, patched, said_by_a_person):
    for _ in range(2):
        live.take(said(patched, 'named', FRICTION))
    stream(live, 9.0)
    latest = live.latest
    said_by_a_person(live)
    live.take(said(patched, 'named', SPRING))
    assert live.latest is latest
    late = said(patched, 'named', SPRING)
    live.take(late)
    assert live.latest is late


def test_with_nothing_proposed_there_is_nothing_to_accept_or_reject(live):
    for service in (live.accept, live.reject):
        with pytest.raises(IdentificationError):
            service()


def test_a_name_counts_the_second_time_until_it_is_gone_or_accepted(live, known_arm, patched):
    for _ in range(2):
        assert live.model is known_arm
        counts = live.take(said(patched, 'named', FRICTION))
    assert counts and live.model is patched
    assert live.take(said(known_arm, 'consistent'))
    assert live.model is known_arm
    for _ in range(2):
        live.take(said(patched, 'named', FRICTION))
    live.accept()
    assert live.accepted is live.request().arm is patched


def stream(live, duration, begin=0.0):
    asked = []
    for t in np.arange(begin, begin + duration, 0.005):
        live.add(t, np.full(6, np.sin(t)), np.zeros(6), np.zeros(6))
        if live.due:
            asked.append(round(t, 1))
            live.request()
    return asked


def test_it_asks_after_every_so_many_seconds_of_motion(live):
    asked = stream(live, 30.0)
    assert asked[0] == pytest.approx(8.0, abs=0.5)
    np.testing.assert_allclose(np.diff(asked), 4.0, atol=0.5)


def test_after_a_change_it_asks_as_soon_as_enough_motion_came(live, known_arm):
    stream(live, 8.1)
    live.take(said(known_arm, WAITING, duration=5.5))
    assert stream(live, 4.0, begin=8.1)[0] == pytest.approx(8.1 + 2.5, abs=0.2)


def test_what_came_before_a_change_is_not_looked_at_again(live, known_arm):
    stream(live, 8.1)
    live.take(said(known_arm, WAITING, duration=5.0, end=8.1, changed=True))
    stream(live, 6.0, begin=8.1)
    assert live.request().window.duration == pytest.approx(11.0, abs=0.1)
    stream(live, 10.0, begin=100.0)
    assert live.request().window.duration == pytest.approx(10.0, abs=0.1)


def test_an_answer_from_before_time_jumped_back_is_dropped(live, known_arm):
    """As where a bag is played again and again."""
    stream(live, 9.0, begin=90.0)
    stream(live, 1.0)
    live.take(said(known_arm, WAITING, duration=2.0, end=98.2, changed=True))
    assert stream(live, 9.0, begin=1.0)
    assert live.request().window.duration == pytest.approx(10.0, abs=0.1)


def test_another_change_is_looked_for_once_the_model_is_right(live, known_arm, patched):
    stream(live, 8.1)
    assert not live.request().of_one_arm
    live.take(said(known_arm, WAITING, duration=5.0, end=8.1, changed=True))
    live.take(said(patched, 'unknown'))
    assert live.request().of_one_arm
    live.take(said(patched, 'consistent'))
    assert not live.request().of_one_arm


def test_the_misfit_is_learned_first_of_the_arm_as_it_was_then(known_arm, patched):
    live = LiveDiagnosis(known_arm, LiveSettings(learning=10.0))
    assert live.learning
    asked = stream(live, 15.0)
    assert not live.learning
    assert asked[0] == pytest.approx(14.0, abs=0.5)
    for _ in range(2):
        live.take(said(patched, 'named', FRICTION))
    live.accept()
    request = live.request()
    assert request.arm is patched
    assert request.healthy[0] is known_arm
    assert request.healthy[1].duration == pytest.approx(10.0, abs=0.1)
