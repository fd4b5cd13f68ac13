# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is common goes before what is rare, and an effect before itself where it is seldom."""

from types import SimpleNamespace

from armid_ros.diagnosis.search.search_state import rarity
from armid_ros.effects import CATALOGUE
from armid_ros.effects.gravity import GravityVector
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
