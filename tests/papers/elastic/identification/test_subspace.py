# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Subspace identification against systems that are known, and against python-control."""

from armid_ros.errors import IdentificationError
from armid_ros.papers.elastic.identification.interaction import measured_response
from armid_ros.papers.elastic.identification.subspace import identify_subspace, Signals
import control
import numpy as np
import pytest
import scipy.signal

DT = 1e-3
A = np.array([[-3.0, 200.0, 0.0], [-200.0, -20.0, 5.0], [0.0, 1.0, -8.0]])
B = np.array([[1.0, 0.0], [0.5, 2.0], [3.0, -1.0]])
C = np.array([[1.0, 0.0, 2.0], [0.0, 1.0, -1.0]])


def experiment(rng, count=3000, noise=0.0):
    """Simulate with one held and one smooth input, from a random state."""
    t = DT * np.arange(count)
    held = rng.standard_normal(count)
    smooth = np.sum(
        [np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in np.arange(1.0, 90.0, 2.0)], axis=0
    )
    start = 3.0 * rng.standard_normal(3)
    a, b, *_ = scipy.signal.cont2discrete((A, B, C, np.zeros((2, 2))), DT, 'zoh')
    first = scipy.signal.cont2discrete((A, B, C, np.zeros((2, 2))), DT, 'foh')
    x, table = start, np.empty((count, 2))
    states = scipy.signal.dlsim(first, np.column_stack([0 * smooth, smooth]))[1]
    for k in range(count):
        table[k] = C @ x
        x = a @ x + b[:, 0] * held[k]
    y = table + states
    return Signals(np.column_stack([held, smooth]), y + noise * rng.standard_normal(y.shape))


@pytest.fixture(scope='module')
def clean():
    """Return four experiments without noise."""
    rng = np.random.default_rng(0)
    return [experiment(rng) for _ in range(4)]


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


def test_spectra_agree_without_a_model(clean) -> None:
    frequency, found = measured_response(clean, DT, window=1.5)
    band = (frequency >= 10.0) & (frequency <= 80.0)
    s = 2j * np.pi * frequency[band]
    wanted = C @ np.linalg.solve(s[:, np.newaxis, np.newaxis] * np.eye(3) - A, B)
    error = np.abs(found[band, 0, 0] / wanted[:, 0, 0] - 1.0)
    assert np.median(error) < 0.05


def test_too_little_data_is_refused(clean) -> None:
    short = [Signals(e.u[:60], e.y[:60]) for e in clean]
    with pytest.raises(IdentificationError, match='too short'):
        identify_subspace(short, DT, 3, ('zero', 'first'))


def test_an_input_that_does_nothing_is_refused(clean) -> None:
    dead = [Signals(e.u * [1.0, 0.0], e.y) for e in clean]
    with pytest.raises(IdentificationError, match='zero in all samples'):
        identify_subspace(dead, DT, 3, ('zero', 'first'))
