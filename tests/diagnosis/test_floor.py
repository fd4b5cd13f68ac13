# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The noise floor comes from repeated periods, encoder noise included, of each trajectory."""

from dataclasses import replace

from armid_ros.diagnosis.data.evidence import _in_informative_rows, noise_floor
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.settings import Thresholds
from armid_ros.identification.rows.signals import conditioning, SignalSettings
import numpy as np
from scipy.signal import lfilter

ONE_PERIOD = Thresholds().one_period


def cut(recordings):
    return trajectories(recordings, conditioning(recordings, SignalSettings()))


def test_noise_of_the_encoders_is_inside(bench):
    quiet = [noise_floor(part, bench.arm) for part in cut(bench.recordings(noise=0.1))]
    noisy = bench.recordings(noise=0.1)
    rng = np.random.default_rng(5)
    shaken = [replace(r, q=r.q + 3e-4 * rng.normal(size=r.q.shape)) for r in noisy]
    loud = [noise_floor(part, bench.arm) for part in cut(shaken)]
    for a, b in zip(quiet, loud, strict=True):
        assert np.all(b.sigma > 2.0 * a.sigma)


def test_what_depends_on_the_motion_alone_cancels(bench):
    hidden = bench.recordings(lambda m, tau: 0.5 * np.sin(3.0 * m.q))
    plain = [noise_floor(part, bench.arm).sigma for part in cut(bench.recordings())]
    with_effect = [noise_floor(part, bench.arm).sigma for part in cut(hidden)]
    np.testing.assert_allclose(np.array(with_effect), np.array(plain), rtol=0.3)


def test_the_assumed_floor_is_that_of_the_periods_or_a_little_more(bench):
    recordings = bench.recordings()
    used = conditioning(recordings, SignalSettings())
    whole = trajectories(recordings, used)
    pieces = trajectories([r.select(slice(0, 700)) for r in recordings], used)
    for known, assumed in zip(whole, pieces, strict=True):
        ratio = noise_floor(assumed, bench.arm).sigma / noise_floor(known, bench.arm).sigma
        assert np.all((ratio > 0.9) & (ratio < 2.0))


def test_friction_at_reversals_is_not_taken_for_noise(bench):
    """Where nothing repeats, jumps of friction that a model lacks are in all frequencies."""

    def once(recordings):
        return [r.select(slice(0, 700)) for r in recordings]

    jump = 3.0
    hidden = bench.recordings(lambda m, tau: jump * np.sign(m.dq), noise=0.1)
    plain = [noise_floor(part, bench.arm) for part in cut(once(bench.recordings(noise=0.1)))]
    jumping = [noise_floor(part, bench.arm) for part in cut(once(hidden))]
    for a, b in zip(plain, jumping, strict=True):
        assert a.period is b.period is None
        assert np.all(b.sigma - a.sigma < 0.02 * jump)


def test_no_torque_is_known_to_more_than_its_resolution(bench):
    for part in cut(bench.recordings(noise=0.0)):
        size = np.sqrt(np.mean(part.motion.tau**2, axis=0))
        floor = noise_floor(part, bench.arm)
        assert np.all(floor.sigma >= 0.99e-4 * size)
        assert np.all(floor.structure < ONE_PERIOD)


def test_each_trajectory_has_a_floor_of_its_own(bench):
    recordings = bench.recordings(noise=0.3)
    rng = np.random.default_rng(1)
    slow, middle, fast = recordings
    fast = replace(fast, tau=fast.tau + 0.3 * rng.normal(size=fast.q.shape))
    floors = [noise_floor(part, bench.arm).sigma for part in cut([slow, middle, fast])]
    assert np.all(floors[2] > 3.0 * floors[0])


def test_coloured_noise_repeats_and_a_machine_nearby_does_not(bench):
    """Noise of torques that is strong below 10 Hz is noise; a slow sweep in one bag is not."""
    rng = np.random.default_rng(3)

    def shaken(recording, sweep):
        white = rng.normal(size=(len(recording.t) + 200, 2))
        coloured = lfilter([0.6], [1.0, -0.8], white, axis=0)[200:]
        hum = np.sin(2.0 * np.pi * (0.5 + 0.1 * recording.t) * recording.t)
        tau = recording.tau + 0.1 * coloured + sweep * hum[:, np.newaxis] * [0.0, 1.0]
        return replace(recording, tau=tau)

    quiet, swept = (
        [
            noise_floor(part, bench.arm)
            for part in cut([shaken(r, size) for r in bench.recordings()])
        ]
        for size in (0.0, 0.8)
    )
    assert all(np.all(floor.structure < ONE_PERIOD) for floor in quiet)
    assert max(floor.structure.max() for floor in quiet) < 4.0
    assert min(floor.structure[1] for floor in swept) > 4.0
    assert swept[0].structure[1] >= ONE_PERIOD
    assert all(floor.structure[0] < ONE_PERIOD for floor in swept)


def test_a_sample_is_as_informative_as_the_row_nearest_to_it(bench):
    part = cut(bench.recordings())[1]
    samples = np.arange(part.rows[0], part.rows[-1])
    nearest = np.argmin(np.abs(samples[:, np.newaxis] - part.rows), axis=1)
    found = _in_informative_rows(part, samples, 0)
    assert not found.all()
    np.testing.assert_array_equal(found, part.informative[nearest, 0])
