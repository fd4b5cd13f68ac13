# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The cases are what their lists say: seeds, and errors of the nominal model."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hidden.cases import make_case
from tests.hidden.specification import case_list, SETS

pytestmark = pytest.mark.long


def test_sets_have_nothing_in_common():
    seeds = [{case.seed for case in case_list(name)} for name in SETS]
    assert sum(map(len, seeds)) == len(set().union(*seeds))


@pytest.fixture(scope='module')
def free():
    """Return an arm with friction and without hidden effects."""
    spec = next(case for case in case_list('development') if case.kind == 'free' and not case.bare)
    return make_case(replace(spec, exact=False))


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
