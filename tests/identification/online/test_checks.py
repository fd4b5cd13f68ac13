# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a stream lacks is counted by the stamps of what came."""

from armid_ros.identification.online.checks import MissingSamples
import numpy as np
import pytest

PERIOD = 0.001


def missing(stamps):
    samples = MissingSamples()
    for t in stamps:
        samples.take(t, PERIOD)
    return samples.count


@pytest.mark.parametrize('lost', [(), (7,), (7, 8, 9), (5, 50, 51, 90)])
def test_every_sample_that_did_not_come_is_counted(lost):
    rng = np.random.default_rng(0)
    stamps = PERIOD * (np.arange(100) + 0.2 * rng.uniform(-1.0, 1.0, 100))
    assert missing(np.delete(stamps, lost)) == len(lost)


@pytest.mark.parametrize('late', [0.7, 3.8])
def test_a_sender_that_pauses_and_catches_up_has_lost_nothing(late):
    index = np.arange(40.0)
    stamps = PERIOD * np.where(index < 20, index, np.maximum(index, 20.0 + late))
    stamps = stamps + 1e-6 * index  # no two are alike
    assert missing(stamps) == 0


def test_a_pause_and_a_clock_that_is_set_are_no_loss():
    assert missing([0.0, 0.001, 3600.0, 3600.001, 1.0, 1.001]) == 0


def test_what_comes_out_of_order_does_not_count_twice():
    stamps = list(PERIOD * np.arange(20.0))
    assert missing([*stamps[:10], stamps[6], *stamps[10:]]) == 0
    assert missing([*stamps[:6], stamps[7], stamps[6], *stamps[8:]]) == 0
