# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The cases are what their lists say: kinds, repetition, errors of the nominal model, order."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hidden.cases import make_case
from tests.hidden.specification import case_list, find_case, SETS

pytestmark = pytest.mark.long


def test_sets_have_nothing_in_common():
    seeds = [{case.seed for case in case_list(name)} for name in SETS]
    assert sum(map(len, seeds)) == len(set().union(*seeds))


@pytest.fixture(scope='module')
def free():
    """Return an arm with friction and without hidden effects."""
    spec = next(case for case in case_list('development') if case.kind == 'free' and not case.bare)
    return make_case(replace(spec, exact=False))


def test_effects_repeat_or_do_not():
    for name, changing in (('torque_offset', False), ('torque_drift', True)):
        case = make_case(find_case(f'development/{name}/20-0'))
        j = case.robot.index(case.effects[0].joints[0])
        assert case.effects[0].repeats is not changing
        for bag in case.bags:
            first, second = (
                np.searchsorted(bag.clean.t, start - 1e-9) for start, _ in bag.periods
            )
            count = len(bag.clean) - second
            tau = bag.clean.tau[:, j]
            period = slice(first, first + count), slice(second, second + count)
            difference = np.median(np.abs(tau[period[1]] - tau[period[0]]))
            level = 0.1 * abs(case.effects[0].parameters[0].value)
            assert bool(difference > level) is changing


def test_nominal_model_is_off_where_it_is_not_exact(free):
    mass = free.robot.rigid_parameters[::10] / free.true_robot.rigid_parameters[::10]
    assert np.all(np.abs(mass - 1.0) > 0.029)
    for known in free.known:
        ratio = known.values / free.true_known[known.name]
        assert np.all((np.abs(ratio - 1.0) > 0.029) & (np.abs(ratio - 1.0) < 0.101))
    exact = make_case(replace(free.spec, exact=True))
    np.testing.assert_array_equal(exact.robot.rigid_parameters, exact.true_robot.rigid_parameters)


def test_a_case_is_the_same_every_time(free):
    again = make_case(free.spec)
    for one, other in zip(free.bags, again.bags, strict=True):
        np.testing.assert_array_equal(one.recording.q, other.recording.q)
        np.testing.assert_array_equal(one.recording.tau, other.recording.tau)
