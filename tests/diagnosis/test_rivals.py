# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is common goes before what is rare, and an effect before itself where it is seldom."""

from types import SimpleNamespace

from armid_ros.diagnosis.search.rivals import rarity
from armid_ros.effects import CATALOGUE
import pytest


def trial(bench, name, joints):
    return SimpleNamespace(group=SimpleNamespace(effect=CATALOGUE[name].on(bench.robot, joints)))


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
