# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Subspace identification against systems that are known, and against python-control."""

from __future__ import annotations

from armid_ros.errors import IdentificationError
from armid_ros.papers.elastic.identification.interaction import measured_response
from armid_ros.papers.elastic.identification.subspace import identify_subspace, Signals
import control
import numpy as np
import pytest

DT = 1e-3
A = np.array([[-3.0, 200.0, 0.0], [-200.0, -20.0, 5.0], [0.0, 1.0, -8.0]])
B = np.array([[1.0, 0.0], [0.5, 2.0], [3.0, -1.0]])
C = np.array([[1.0, 0.0, 2.0], [0.0, 1.0, -1.0]])


def experiment(rng, count=3000, noise=0.0):
    """Simulate with one held and one smooth input, from a random state."""
    import scipy.signal

    t = DT * np.arange(count)
    held = rng.standard_normal(count)
    smooth = np.sum(
        [np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in np.arange(1.0, 90.0, 2.0)], axis=0
    )
    start = 3.0 * rng.standard_normal(3)
    zero = scipy.signal.cont2discrete((A, B, C, np.zeros((2, 2))), DT, 'zoh')
    a, b = zero[0], zero[1][:, 0]
    fine = 20
    small = scipy.signal.cont2discrete((A, B, C, np.zeros((2, 2))), DT / fine, 'foh')
    x, table = start, np.empty((count, 2))
    course = np.interp(DT / fine * np.arange(count * fine), t, smooth)
    states = scipy.signal.dlsim((*small[:4], DT / fine), np.column_stack([0 * course, course]))[1]
    for k in range(count):
        table[k] = C @ x
        x = a @ x + b * held[k]
    y = table + states[::fine][:count]
    return Signals(np.column_stack([held, smooth]), y + noise * rng.standard_normal(y.shape))


@pytest.fixture(scope='module')
def clean():
    """Return four experiments without noise."""
    rng = np.random.default_rng(0)
    return [experiment(rng) for _ in range(4)]


def test_poles_are_found(clean) -> None:
    system = identify_subspace(clean, DT, 3, ('zero', 'first'))
    wanted = np.sort_complex(np.linalg.eigvals(A))
    np.testing.assert_allclose(np.sort_complex(system.poles), wanted, rtol=1e-4, atol=1e-2)


def test_bode_plot_is_that_of_python_control(clean) -> None:
    """A tenth of a line's width: 0.01 dB and 0.1 degrees on all four responses."""
    frequency = np.geomspace(1.0, 100.0, 60)
    system = identify_subspace(clean, DT, 3, ('zero', 'first'))
    found = system.response(frequency)
    theirs = control.frequency_response(
        control.ss(A, B, C, np.zeros((2, 2))), 2 * np.pi * frequency
    )
    wanted = np.moveaxis(np.asarray(theirs.complex), 2, 0)
    ratio = found / wanted
    assert np.abs(20.0 * np.log10(np.abs(ratio))).max() < 0.01
    assert np.abs(np.degrees(np.angle(ratio))).max() < 0.1


@pytest.mark.long
def test_noise_of_the_outputs_does_not_bias(clean) -> None:
    rng = np.random.default_rng(1)
    noisy = [experiment(rng, noise=0.02 * np.std(e.y)) for e in clean for _ in range(2)]
    frequency = np.geomspace(2.0, 80.0, 50)
    system = identify_subspace(noisy, DT, 3, ('zero', 'first'))
    wanted = C @ np.linalg.solve(
        2j * np.pi * frequency[:, np.newaxis, np.newaxis] * np.eye(3) - A, B
    )
    error = 20.0 * np.log10(np.abs(system.response(frequency) / wanted))
    assert np.sqrt(np.mean(error[:, :, 0] ** 2)) < 0.1


def test_spectra_agree_without_a_model(clean) -> None:
    frequency, found = measured_response(clean, DT, window=1.5)
    band = (frequency >= 10.0) & (frequency <= 80.0)
    s = 2j * np.pi * frequency[band]
    wanted = C @ np.linalg.solve(s[:, np.newaxis, np.newaxis] * np.eye(3) - A, B)
    error = np.abs(found[band, 0, 0] / wanted[:, 0, 0] - 1.0)
    assert np.median(error) < 0.05


def test_too_little_data_is_refused(clean) -> None:
    short = [Signals(e.u[:60], e.y[:60]) for e in clean]
    with pytest.raises(IdentificationError, match='too few'):
        identify_subspace(short, DT, 3, ('zero', 'first'))


def test_an_input_that_does_nothing_is_refused(clean) -> None:
    dead = [Signals(e.u * [1.0, 0.0], e.y) for e in clean]
    with pytest.raises(IdentificationError, match='always zero'):
        identify_subspace(dead, DT, 3, ('zero', 'first'))
