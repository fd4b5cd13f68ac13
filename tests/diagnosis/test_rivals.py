# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is common goes before what is rare, and an effect before itself where it is seldom."""

from dataclasses import dataclass
from types import SimpleNamespace

from armid_ros.diagnosis.search import screening
from armid_ros.diagnosis.search.search_state import beaten, is_redundant, most_plausible, rarity
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import CATALOGUE
from armid_ros.effects.gravity import GravityVector
import numpy as np
import pytest


def trial(bench, name, joints):
    return SimpleNamespace(
        candidate=SimpleNamespace(
            effect=CATALOGUE[name].on(bench.robot, joints), robot=bench.robot
        )
    )


@pytest.mark.parametrize(
    ('first', 'second'),
    [
        (('time_delay', ()), ('torque_lag', ())),
        (('torque_lag', ('elbow',)), ('time_delay', ('elbow',))),
        (('viscous_friction', ('elbow',)), ('torque_lag', ('elbow',))),
        (('payload', ('elbow',)), ('link_inertia', ('elbow',))),
        (('torque_lag', ()), ('gravity_magnitude', ())),
    ],
)
def test_the_common_goes_first(bench, first, second):
    assert rarity(trial(bench, *first)) < rarity(trial(bench, *second))


def test_gravity_of_any_direction_is_as_common_as_a_base_that_leans(bench):
    leaning = trial(bench, 'base_tilt', ())
    leaning.candidate.effect = GravityVector.on(bench.robot)
    assert rarity(leaning) == rarity(trial(bench, 'base_tilt', ()))


class Known:
    """A cause with what it takes of each of some blocks."""

    def __init__(self, bench, name, gains, freedom=1.0):
        self.freedom = freedom
        self.candidate = trial(bench, name, ('elbow',)).candidate
        self.gains = np.asarray(gains, dtype=float)
        self.gain = float(self.gains.sum())


def asked(power, since):
    return SimpleNamespace(currency=power, since=since, settings=DiagnosisSettings())


@pytest.mark.parametrize(
    ('since', 'less', 'wanted'),
    [(False, 0.85, True), (True, 0.85, False), (True, 0.6, True), (False, 0.995, False)],
)
def test_a_link_has_to_take_a_quarter_more_than_what_happens(bench, since, less, wanted):
    """Links do not change from one day to the next; their description may be off on one."""
    gains = 10.0 + np.random.default_rng(0).normal(size=36)
    link, rotor = Known(bench, 'link_inertia', gains), Known(bench, 'rotor_inertia', less * gains)
    assert beaten(rotor, link, asked(400.0, since)) == wanted


def test_a_load_is_at_the_end_of_an_arm_where_it_may_be(bench):
    at_end, inside = Known(bench, 'payload', [9.0]), Known(bench, 'payload', [9.1])
    inside.candidate.effect = CATALOGUE['payload'].on(bench.robot, ('shoulder',))
    here = asked(10.0, True)
    assert most_plausible([inside, at_end], {}, here) is at_end
    assert most_plausible([inside], {}, here) is inside


def test_what_another_cause_excludes_is_in_no_tie_with_it(bench):
    """A load of an inner link has to take more than a gain by far, and one at the end has not."""
    gains = 10.0 + np.random.default_rng(0).normal(size=36)
    gain = Known(bench, 'torque_gain', 0.8 * gains)
    at_end, inside = (Known(bench, 'payload', gains, 9.0) for _ in range(2))
    inside.candidate.effect = CATALOGUE['payload'].on(bench.robot, ('shoulder',))
    here = asked(400.0, True)
    assert not beaten(gain, inside, here) and beaten(gain, at_end, here)
    assert most_plausible([inside, at_end, gain], {}, here) is at_end


@pytest.mark.parametrize(('power', 'wanted'), [(1e4, True), (4e4, False)])
def test_what_the_values_of_the_leading_cause_cost_is_no_lead(bench, power, wanted):
    """Each costs a share of what is to be explained, and a person counts for ten more."""
    gains = 100.0 + np.random.default_rng(0).normal(size=36)
    person = Known(bench, 'human_interaction', 1.4 * gains, 8.0)
    spring = Known(bench, 'joint_spring', gains)
    assert beaten(spring, person, asked(power, True)) == wanted


def test_of_two_that_happen_the_lead_decides(bench):
    gains = 10.0 + np.random.default_rng(0).normal(size=36)
    gain, rotor = Known(bench, 'torque_gain', gains), Known(bench, 'rotor_inertia', 0.85 * gains)
    assert beaten(rotor, gain, asked(400.0, True))


def test_what_never_happens_is_taken_only_alone(bench):
    """A link may say the same with fewer values than a payload, and does not change."""
    link, payload = Known(bench, 'link_inertia', [9.0]), Known(bench, 'payload', [8.0])
    here = asked(10.0, True)
    assert most_plausible([link, payload], {}, here) is payload
    assert most_plausible([link], {}, here) is link


@pytest.mark.parametrize(
    ('ahead', 'noise', 'wanted'),
    [(0.1, 0.1, False), (0.02, 0.1, True), (0.1, 10.0, True), (-0.1, 0.1, True)],
)
def test_a_body_that_contains_an_offset_is_a_rival_where_it_surely_says_more(
    bench, monkeypatch, ahead, noise, wanted
):
    """A load on a link is a constant torque of a small range, and other torque besides."""
    monkeypatch.setattr('armid_ros.diagnosis.search.search_state.contains', lambda *_: True)
    gains = np.full(36, 10.0)
    more = noise * np.random.default_rng(0).normal(size=36)
    offset = Known(bench, 'torque_offset', gains)
    body = Known(bench, 'link_inertia', (1.0 + ahead) * gains + more - more.mean(), freedom=10.0)
    assert is_redundant(body, offset, asked(360.0, False)) == wanted


@dataclass(frozen=True)
class Change:
    """The trial of a change: what it takes, and whether it is there beyond chance."""

    name: str
    cross: float
    square: float
    there: bool = True

    @property
    def gain(self):
        return 2.0 * self.cross - self.square


@pytest.mark.parametrize(('there', 'first'), [(True, 'offset'), (False, 'gain')])
def test_changes_are_compared_one_by_one_where_a_baseline_tells_no_more(monkeypatch, there, first):
    """The order of candidates of which none is significant means nothing."""
    trials = [Change('gain', 7.0, 7.0), Change('offset', 6.8, 6.8)]
    alone = [Change('gain', 6.0, 6.0), Change('offset', 5.0, 5.0)]
    jointly = [Change('gain', 0.1, 0.1, False), Change('offset', 0.5, 0.5, there)]
    monkeypatch.setattr(screening, '_changes', lambda *arguments: jointly)
    monkeypatch.setattr(screening, 'acceptable', lambda change, here: change.there)
    compared = screening._compared(trials, alone, SimpleNamespace(before=object()))
    best = max(compared, key=lambda change: change.gain)
    assert best.name == first
    assert best.gain == pytest.approx(next(t.gain for t in trials if t.name == first))
