# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from armid_ros.identification.rows.causal import CausalFilter, TripleLag
import numpy as np
import pytest

CUTOFF = 5.0


def stream(t):
    """Return two joints in sinusoidal motion, and torques of other shapes."""
    q = np.stack([0.8 * np.sin(6.0 * t), 0.3 * np.cos(11.0 * t)], axis=1)
    tau = np.stack([np.sign(np.sin(5.0 * t)), np.cos(9.0 * t) ** 3], axis=1)
    return q, tau


def update(causal, t, q, dq, tau):
    """Take in one joint state."""
    signal = causal.signal(t, q, dq, tau)
    return None if signal is None else causal.advance(t, signal)


def run(causal, t, q, tau, dq=None):
    velocity = [None] * len(t) if dq is None else dq
    return [update(causal, *sample) for sample in zip(t, q, velocity, tau, strict=True)]


def table(outputs):
    """Return the stamps and q, dq, ddq, tau of what came out, stacked."""
    kept = [x for x in outputs if x is not None]
    values = np.array([np.concatenate([x.q, x.dq, x.ddq, x.tau]) for x in kept])
    return np.array([x.t for x in kept]), values


def sine_response(pole, frequency, t):
    """Return the settled response of the triple lag to sin, and its first two derivatives."""
    gain = 1.0 / (1.0 + 1j * frequency / pole) ** 3
    wave = gain * np.exp(1j * frequency * t)
    return wave.imag, (1j * frequency * wave).imag, (-(frequency**2) * wave).imag


def test_cutoff_is_where_half_the_power_is_left():
    lag = TripleLag(CUTOFF)
    t = np.arange(0.0, 4.0, 1e-4)
    out = [lag.update(1e-4, np.array([np.sin(2 * np.pi * CUTOFF * s)]))[2, 0] for s in t]
    assert np.max(out[len(out) // 2 :]) == pytest.approx(np.sqrt(0.5), rel=1e-4)


@pytest.mark.parametrize('rate', [50.0, 100.0, 200.0, 1000.0])
def test_a_constant_acceleration_is_what_it_is_at_any_rate(rate):
    """At poles as fast as the samples it was 0.4 % too small, more than deviations of inertias."""
    t = np.arange(round(3.0 * rate)) / rate
    causal = CausalFilter(1, CUTOFF)
    out = [update(causal, s, [0.5 * 7.0 * s**2], None, [0.0]) for s in t]
    assert out[-1].ddq[0] == pytest.approx(7.0, rel=1e-6)
    late = out[-1].t - 3.0 / causal.pole
    assert out[-1].dq[0] == pytest.approx(7.0 * late, rel=5e-5)


@pytest.mark.parametrize('lost', [1, 2, 4])
def test_what_is_missing_has_the_acceleration_of_what_is_around_it(lost):
    """Straight lines across gaps would be off by ten to a hundred times as much."""
    t = np.arange(0.0, 3.0, 0.01)
    q, tau = stream(t)
    whole = CausalFilter(2, CUTOFF)
    gappy = CausalFilter(2, CUTOFF)
    off = np.zeros(2)
    for k, sample in enumerate(zip(t, q, [None] * len(t), np.cos(tau), strict=True)):
        expected = update(whole, *sample)
        if k % 40 < lost:
            continue
        found = update(gappy, *sample)
        if expected is not None and found is not None:
            off = np.maximum(off, np.abs(found.ddq - expected.ddq))
    assert not gappy.restarts
    assert np.all(off / (np.array([0.8, 0.3]) * np.array([6.0, 11.0]) ** 2) < 0.03 * lost**2)


def test_outputs_are_the_filtered_motion_and_its_derivatives():
    """The torque passes the same filter as the positions."""
    causal = CausalFilter(2, CUTOFF)
    t = np.arange(0.0, 3.0, 1e-3)
    q, _ = stream(t)
    stamps, values = table(run(causal, t, q, q))
    np.testing.assert_array_equal(values[:, 6:], values[:, :2])
    late = stamps > 1.0
    for column, expected in enumerate(sine_response(causal.pole, 6.0, stamps)):
        scale = 0.8 * 6.0**column
        np.testing.assert_allclose(
            values[late, 2 * column], 0.8 * expected[late], atol=2e-5 * scale
        )


def test_jitter_of_the_stamps_is_accounted_for():
    """Stamps that vary by a third of the period: as good as regular ones, not as if regular."""
    rng = np.random.default_rng(0)
    regular = np.arange(0.0, 3.0, 1e-3)
    t = regular + rng.uniform(-0.33e-3, 0.33e-3, len(regular))
    causal, ignoring = CausalFilter(2, CUTOFF), CausalFilter(2, CUTOFF)
    stamps, values = table(run(causal, t, *stream(t)))
    _, ignored = table(run(ignoring, regular, *stream(t)))
    late = stamps > 1.0
    expected = -0.8 * 36.0 * np.imag(np.exp(6j * stamps) / (1.0 + 6j / causal.pole) ** 3)
    error = np.abs(values[late, 4] - expected[late]).max() / 28.8
    error_ignoring = np.abs(ignored[-late.sum() :, 4] - expected[late]).max() / 28.8
    assert error < 3e-3
    assert error_ignoring > 20.0 * error


def test_nothing_comes_out_until_the_start_is_forgotten():
    """Only what is independent of the start is given out: it starts with any past."""
    t = np.arange(0.0, 2.0, 1e-3)
    q, tau = stream(t)
    late, early = CausalFilter(2, CUTOFF), CausalFilter(2, CUTOFF)
    stamps, values = table(run(late, t[500:], q[500:], tau[500:]))
    all_stamps, all_values = table(run(early, t, q, tau))
    first = np.searchsorted(all_stamps, stamps[0])
    scale = np.abs(all_values).max(axis=0)
    np.testing.assert_allclose(values / scale, all_values[first:] / scale, atol=2e-5)
    assert 0.05 < stamps[0] - t[500] < 0.2


@pytest.mark.parametrize(
    ('reason', 'spoil'),
    [
        ('not_finite', lambda t, q, tau: (t, q * np.nan, None, tau)),
        ('not_finite', lambda t, q, tau: (t, q, None, [*tau[:1], np.inf])),
        ('not_finite', lambda t, q, tau: (np.nan, q, None, tau)),
        ('wrong_length', lambda t, q, tau: (t, q[:1], None, tau)),
        ('wrong_length', lambda t, q, tau: (t, q, None, [])),
    ],
)
def test_a_bad_sample_is_as_if_it_had_not_come(reason, spoil):
    t = np.arange(0.0, 1.0, 1e-3)
    q, tau = stream(t)
    spoilt, clean = CausalFilter(2, CUTOFF), CausalFilter(2, CUTOFF)
    for k in range(len(t)):
        if k % 100 == 60:
            assert update(spoilt, *spoil(t[k], q[k], tau[k])) is None
            continue
        a, b = update(spoilt, t[k], q[k], None, tau[k]), update(clean, t[k], q[k], None, tau[k])
        assert (a is None) == (b is None)
        if a is not None and b is not None:
            np.testing.assert_array_equal(a.ddq, b.ddq)
            np.testing.assert_array_equal(a.tau, b.tau)
    assert dict(spoilt.rejected) == {reason: 10}
    assert not spoilt.restarts


@pytest.mark.parametrize(('jump', 'reason'), [(0.5, 'dropout'), (-1.5, 'jump_back')])
def test_a_gap_or_a_jump_restarts_and_leaves_no_trace(jump, reason):
    t = np.arange(0.0, 2.0, 1e-3)
    q, tau = stream(t)
    stamps = np.where(t < 1.0, t, t + jump)
    jumped = CausalFilter(2, CUTOFF)
    fresh = CausalFilter(2, CUTOFF)
    run(jumped, stamps[:1000], q[:1000], tau[:1000])
    generation = jumped.generation
    a = table(run(jumped, stamps[1000:], q[1000:] + 1.0, tau[1000:]))
    b = table(run(fresh, stamps[1000:], q[1000:] + 1.0, tau[1000:]))
    np.testing.assert_array_equal(a[0], b[0])
    np.testing.assert_array_equal(a[1], b[1])
    assert dict(jumped.restarts) == {reason: 1}
    assert jumped.generation == generation + 1


def test_measured_velocity_is_differentiated_when_wanted():
    t = np.arange(0.0, 2.0, 1e-3)
    q, tau = stream(t)
    dq = np.stack([4.8 * np.cos(6.0 * t), -3.3 * np.sin(11.0 * t)], axis=1)
    noisy = q + 1e-3 * np.random.default_rng(0).normal(size=q.shape)
    clean = CausalFilter(2, CUTOFF)
    measured = CausalFilter(2, CUTOFF, measured_velocity=True)
    _, expected = table(run(clean, t, q, tau))
    _, values = table(run(measured, t, noisy, tau, dq))
    np.testing.assert_allclose(values[:, 2:6], expected[:, 2:6], atol=2e-3)
    assert update(measured, t[-1] + 1e-3, q[-1], None, tau[-1]) is None
    assert measured.rejected['no_velocity'] == 1


def test_a_new_rate_after_a_dropout_is_learned():
    """From 1 kHz to 50 Hz: every interval would be a dropout at the old rate."""
    causal = CausalFilter(2, CUTOFF)
    t = np.arange(0.0, 1.0, 1e-3)
    run(causal, t, *stream(t))
    slow = np.arange(1.0, 8.0, 0.02)
    outputs = run(causal, slow, *stream(slow))
    assert causal.period == pytest.approx(0.02)
    assert outputs[-1] is not None
    assert causal.restarts['dropout'] == 1
