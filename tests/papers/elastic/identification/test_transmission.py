# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A spring and free play between two encoders: told apart where the load changes flanks."""

from armid_ros.errors import IdentificationError
from armid_ros.papers.elastic.identification.joints import fit_transmission
import numpy as np
import pytest

STIFFNESS, BACKLASH = 5e5, 4e-4


def recording(rng, *, play=BACKLASH, weight=0.0, delay=0.0):
    """Return a joint whose load is inertia, with or without a weight that never changes sides."""
    dt = 4e-3
    t = dt * np.arange(2500)
    phases = rng.uniform(0.0, 6.0, 3)
    w = 2.0 * np.pi * np.array([0.3, 0.5, 0.8])
    q = np.sum(0.2 * np.sin(np.outer(t, w) + phases), axis=1)
    velocity = np.sum(0.2 * w * np.cos(np.outer(t, w) + phases), axis=1)
    acceleration = -np.sum(0.2 * w**2 * np.sin(np.outer(t, w) + phases), axis=1)
    load = 100.0 * acceleration + 60.0 * np.cos(2.0 * q) * np.sin(5.0 * t) + weight
    twist = load / STIFFNESS + 0.5 * play * np.tanh(load / 5.0) + delay * velocity
    noise = 2e-6 * rng.standard_normal((2, len(t)))
    return dt, q + twist + noise[0] + 0.01, q + noise[1], load


def holds(interval, value, slack=0.0):
    """Return whether an interval, widened by a share of the value, holds it."""
    return interval[1] - slack * value <= value <= interval[2] + slack * value


def test_spring_and_free_play_are_found_and_told_apart() -> None:
    rng = np.random.default_rng(0)
    fit = fit_transmission([recording(rng) for _ in range(3)], rng)
    assert holds(fit.stiffness, STIFFNESS, slack=0.1)
    assert holds(fit.backlash, BACKLASH, slack=0.15)
    assert fit.backlash_seen


def test_without_free_play_none_is_seen() -> None:
    rng = np.random.default_rng(1)
    fit = fit_transmission([recording(rng, play=0.0) for _ in range(3)], rng)
    assert holds(fit.stiffness, STIFFNESS, slack=0.05)
    assert fit.backlash[0] < 0.05 * BACKLASH


def test_free_play_under_a_weight_is_an_offset() -> None:
    rng = np.random.default_rng(2)
    fit = fit_transmission([recording(rng, weight=5000.0) for _ in range(3)], rng)
    assert fit.reversals == 0
    assert np.isnan(fit.backlash[0])
    assert not fit.backlash_seen
    assert holds(fit.stiffness, STIFFNESS, slack=0.1)


def test_a_late_encoder_is_not_taken_for_a_spring() -> None:
    rng = np.random.default_rng(3)
    fit = fit_transmission([recording(rng, delay=3e-3) for _ in range(3)], rng)
    assert fit.delay[0] == pytest.approx(3e-3, rel=0.05)
    assert holds(fit.stiffness, STIFFNESS, slack=0.1)


def test_a_joint_that_stands_is_refused() -> None:
    still = 4e-3, np.zeros(200), np.zeros(200), np.ones(200)
    with pytest.raises(IdentificationError, match='hardly moves'):
        fit_transmission([still], np.random.default_rng(0))
