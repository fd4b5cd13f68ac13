# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""While a node runs nothing pauses it, and afterwards all is as it was."""

from __future__ import annotations

from collections.abc import Iterator
import gc

from armid_ros.nodes.running.process import steady
import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits


def threads() -> dict[str, int]:
    """Return how many threads each library of linear algebra uses."""
    np.eye(2) @ np.eye(2)
    return {library['filepath']: library['num_threads'] for library in threadpool_info()}


@pytest.fixture
def before() -> Iterator[dict[str, int]]:
    """Use two threads where a library can; one that is loaded later has what it likes."""
    with threadpool_limits(limits=2):
        assert 2 in threads().values()
        yield threads()


def test_linear_algebra_has_one_thread_and_old_objects_are_not_looked_through(before):
    with steady():
        assert all(threads()[path] == 1 for path in before) and gc.get_freeze_count() > 0
    assert before.items() <= threads().items() and gc.get_freeze_count() == 0
