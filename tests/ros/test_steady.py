# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""While a node runs nothing pauses it, and afterwards all is as it was."""

from __future__ import annotations

import gc

from armid_ros.nodes.lockstep import Stage
from armid_ros.nodes.running.domains import private_context
from armid_ros.nodes.running.steady import steady
import numpy as np
from threadpoolctl import threadpool_info, threadpool_limits


def threads() -> list[int]:
    """Return how many threads each library of linear algebra uses."""
    np.eye(2) @ np.eye(2)
    return [library['num_threads'] for library in threadpool_info()]


def test_linear_algebra_has_one_thread_and_old_objects_are_not_looked_through():
    with threadpool_limits(limits=2):
        before = threads()
        with steady():
            assert set(threads()) == {1} and gc.get_freeze_count() > 0
        assert threads() == before and gc.get_freeze_count() == 0


def test_nodes_in_lock_step_are_steady():
    with threadpool_limits(limits=2):
        with private_context() as context, Stage(context.get_domain_id()):
            assert set(threads()) == {1}
        assert set(threads()) == {2}
