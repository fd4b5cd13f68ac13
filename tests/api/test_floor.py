# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A plan of Python keeps clear of the same floor and surroundings as one of the command."""

import armid_ros as ar
from armid_ros.errors import TrajectoryError
import pytest

QUICK = {'duration': 6.0, 'starts': 1, 'iterations': 1, 'candidates': 5}


def test_a_plan_is_checked_against_floor_and_environment(tmp_path):
    plan = ar.design_excitation('humanoid_arm', **QUICK)
    assert plan.scene.floor.height is not None
    assert [o.kind for o in plan.scene.obstacles] == ['plane']
    box = tmp_path / 'box.yaml'
    box.write_text('- {name: crate, kind: box, size: [9, 9, 0.1], position: [0, 0, -2]}\n')
    plan = ar.design_excitation('humanoid_arm', floor='none', environment=box, **QUICK)
    assert [o.name for o in plan.scene.obstacles] == ['crate']


@pytest.mark.parametrize('floor', [5.0, 'high'])
def test_a_floor_that_cannot_be_is_refused(floor):
    with pytest.raises(TrajectoryError, match='floor'):
        ar.design_excitation('humanoid_arm', floor=floor, **QUICK)
