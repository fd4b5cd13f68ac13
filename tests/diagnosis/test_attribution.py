# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What data that a name was not fitted to say of it: they show it, deny it, or are silent."""

from armid_ros.diagnosis.verdict.attribution import Attribution
import numpy as np
import pytest

BLOCKS = 40


def attribution(predicted, left):
    """Return the shares of a name that predicts some rows of what was left, block by block."""
    taken = np.sum(left**2 - (left - predicted) ** 2, axis=1)
    made = np.sum(predicted**2, axis=1)
    return Attribution((0,), np.sum(left**2, axis=1), taken[np.newaxis], made[np.newaxis])


@pytest.fixture
def rows():
    """Return what a cause makes of every row, and noise, each of shape (B, 50)."""
    rng = np.random.default_rng(0)
    return rng.normal(size=(BLOCKS, 50)), rng.normal(size=(BLOCKS, 50))


def test_a_cause_that_is_there_is_not_denied_and_takes_its_share(rows):
    cause, noise = rows
    found = attribution(cause, cause + noise)
    assert not found.denied(0)
    assert found.share([0]) == pytest.approx(0.5, abs=0.05)


def test_a_cause_that_is_not_there_is_denied(rows):
    cause, noise = rows
    assert attribution(cause, noise).denied(0)


def test_data_in_which_a_cause_does_nothing_do_not_deny_it(rows):
    cause, noise = rows
    assert not attribution(0.0 * cause, noise).denied(0)
    assert not attribution(1e-4 * cause, noise).denied(0)


def test_data_in_which_a_cause_makes_as_much_as_noise_do_not_deny_it():
    """A tilt makes little of a motion that hardly turns the axis that feels it."""
    cause = np.zeros((BLOCKS, 50))
    cause[:2, 0] = 1.3
    left = np.zeros_like(cause)
    left[:2, 0] = [0.5, 0.6]
    assert not attribution(cause, left).denied(0)
    assert attribution(10.0 * cause, left).denied(0)
