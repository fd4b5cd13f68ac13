# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The story of the demo: what is hidden is drawn fairly, found, and revealed only in the end."""

from armid_ros.arm import ArmModel
from armid_ros.cli.demo.story import draw_hidden, show_story, ToldStory
from armid_ros.diagnosis import diagnose
from armid_ros.effects import CATALOGUE
from armid_ros.errors import ModelError
import numpy as np
import pytest

from tests.diagnosis.conftest import Bench


@pytest.fixture(scope='module')
def arm():
    return ArmModel(Bench().robot)


@pytest.fixture(scope='module')
def motion():
    return Bench().motion(1.6, 4.0, 0)


@pytest.mark.parametrize(
    'name', [name for name, kind in CATALOGUE.items() if kind.traits.familiar]
)
def test_what_is_hidden_shows_in_the_torque_and_is_possible(arm, motion, name):
    hidden = draw_hidden(arm, motion, np.random.default_rng(0), f'{name}@elbow')
    lower, upper = hidden.effect.bounds()
    assert hidden.effect.joints == ('elbow',)
    assert np.all((hidden.values >= lower) & (hidden.values <= upper))
    changed = arm.with_effect(hidden.effect, hidden.values)
    difference = changed.torque(motion) - arm.torque(motion)
    share = np.sqrt(np.mean(difference**2, axis=0) / np.mean(arm.torque(motion) ** 2, axis=0))
    assert 0.05 < share[1] < 2.0


def test_draws_differ_and_what_is_asked_for_is_kept(arm, motion):
    drawn = {
        (one.effect.name, one.effect.joints)
        for one in (draw_hidden(arm, motion, np.random.default_rng(seed)) for seed in range(20))
    }
    assert len(drawn) > 5
    joints = {
        draw_hidden(arm, motion, np.random.default_rng(seed), 'torque_gain').effect.joints
        for seed in range(20)
    }
    assert joints == {('shoulder',), ('elbow',)}
    asked = 'stribeck_friction@elbow:stribeck_torque=0.1'
    hidden = draw_hidden(arm, motion, np.random.default_rng(0), asked)
    assert hidden.values.tolist() == [0.1]
    with pytest.raises(ModelError, match='wrist'):
        draw_hidden(arm, motion, np.random.default_rng(0), 'torque_gain@wrist')


def test_a_payload_that_is_hidden_is_a_body(arm, motion):
    values = draw_hidden(arm, motion, np.random.default_rng(3), 'payload@elbow').values
    mass, moment = values[0], values[1:4]
    rows = values[[4, 5, 7, 5, 6, 8, 7, 8, 9]].reshape(3, 3)
    about_centre = rows - mass * (
        moment @ moment / mass**2 * np.eye(3) - np.outer(moment, moment) / mass**2
    )
    assert mass > 0.0
    np.testing.assert_allclose(about_centre, 0.0, atol=1e-12)


def test_it_is_revealed_in_the_end(motion, capsys):
    bench = Bench()
    hidden = draw_hidden(bench.arm, motion, np.random.default_rng(1), 'payload@elbow')
    changed = bench.arm.with_effect(hidden.effect, hidden.values)

    def weight(motion, _):
        return changed.torque(motion) - bench.arm.torque(motion)

    recordings = bench.recordings(weight)
    found = diagnose(
        bench.arm,
        recordings[:2],
        validate=recordings[2:],
        baseline=bench.recordings(seed=3),
        rng=np.random.default_rng(0),
    )
    told = ToldStory(hidden, found)
    show_story(told)
    lines = capsys.readouterr().out.splitlines()
    assert told.found
    assert 'payload in elbow' in lines[-1] and 'found it' in lines[-1]
    assert not any('payload in elbow (' in line for line in lines[:-1])
    gap = told.document()['gap']
    assert gap['after']['elbow'] < 0.2 * gap['before']['elbow']
