# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where a search for the order of a ripple starts."""

from armid_ros.effects.unexplained import wave_gains
import numpy as np
import pytest


@pytest.mark.parametrize('order', [4.3, 9.0, 21.7])
def test_a_wave_of_few_cycles_takes_all_at_its_order_alone(order):
    """Three stretches far from each other show a part of a cycle each: all orders look alike."""
    stretches = [np.linspace(a, a + 0.2, 200) for a in (-2.1, 1.9, 2.8)]
    angle = np.concatenate(stretches)
    weight = np.repeat([1.0, 2.0, 0.5], 200)
    wave = weight * np.sin(order * angle + 0.4)
    orders = np.arange(3.0, 30.0, 0.1)
    gain = wave_gains(angle, wave, weight, orders)
    assert orders[np.argmax(gain)] == pytest.approx(order, abs=0.051)
    assert wave_gains(angle, wave, weight, np.array([order]))[0] == pytest.approx(np.sum(wave**2))


def test_gains_are_those_of_least_squares():
    rng = np.random.default_rng(0)
    angle, rest, weight = rng.uniform(-1.0, 1.0, 300), rng.normal(size=300), rng.uniform(size=300)
    columns = weight[:, np.newaxis] * np.column_stack([np.cos(7.0 * angle), np.sin(7.0 * angle)])
    fit = columns @ np.linalg.lstsq(columns, rest, rcond=None)[0]
    assert wave_gains(angle, rest, weight, np.array([7.0]))[0] == pytest.approx(np.sum(fit**2))
