# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""No sample of a stream waits for what takes long, and nothing of it is left out."""

from __future__ import annotations

from collections.abc import Iterator
import time

from armid_ros.identification.online import identifier as online_identifier
from armid_ros.identification.online.background import Background
from armid_ros.nodes.running.process import steady
import numpy as np
import pytest

from benchmarks import changes

from ..conftest import Foreground

#: Of the samples [Hz], and when the arm picks something up [s].
RATE, BEFORE = 200.0, 25.0


def steps(name: str, count: int, done: list[str]) -> Iterator[None]:
    """Note every piece of a job."""
    for number in range(count):
        done.append(f'{name}{number}')
        yield


def test_an_urgent_job_goes_first_and_each_is_finished_before_the_next():
    work, done = Background(), []
    work.begin(steps('a', 2, done))
    work.begin(steps('u', 2, done), urgent=True)
    work.begin(steps('b', 1, done))
    work.advance(2)
    assert done == ['u0', 'u1']
    work.finish()
    assert done == ['u0', 'u1', 'a0', 'a1', 'b0'] and not work.busy


def test_a_job_that_fails_is_given_up_and_the_others_go_on():
    def failing() -> Iterator[None]:
        yield
        raise ZeroDivisionError

    work, done = Background(), []
    work.begin(failing())
    work.begin(steps('a', 1, done))
    work.advance()
    with pytest.raises(ZeroDivisionError):
        work.advance()
    work.finish()
    assert done == ['a0']


@pytest.fixture(scope='module')
def samples():
    """Return samples of an arm that picks something up in mid-motion."""
    return list(changes.changing('payload:' + changes.ball(0.3), 0, BEFORE, 3.0, RATE))


@pytest.mark.long
@pytest.mark.slow
def test_pieces_of_work_change_nothing_of_what_is_learned(samples, monkeypatch):
    pieces = changes.watch(iter(samples))
    monkeypatch.setattr(online_identifier, 'Background', Foreground)
    whole = changes.watch(iter(samples))
    (found,), (expected,) = pieces.changes, whole.changes
    assert (found.candidate.label, found.t) == (expected.candidate.label, expected.t)
    np.testing.assert_allclose(found.size.values, expected.size.values, rtol=1e-6)
    assert pieces.samples == whole.samples
    np.testing.assert_allclose(pieces.estimate().std, whole.estimate().std, rtol=0.2)
    np.testing.assert_allclose(
        pieces.estimate().values, whole.estimate().values, rtol=1e-5, atol=1e-7
    )


@pytest.mark.long
def test_no_update_takes_much_longer_than_others(samples):
    """Nor when blocks end, windows are full, a change is judged and rows are learned again."""
    times = []
    with steady():
        for _ in range(3):  # the same work each time: the least is free of what disturbs it
            online, elapsed = changes.identifier(), []
            for t, q, tau in samples:
                begun = time.thread_time()
                online.update(t, q, None, tau)
                elapsed.append(time.thread_time() - begun)
            times.append(elapsed)
    assert online.changes
    least = np.min(times, axis=0)
    longest, usual = np.percentile(least, (99.9, 50))
    assert longest < 10.0 * usual  # 30 where all is done at once
