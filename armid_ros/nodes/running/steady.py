# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What keeps a process from pausing in the middle of a stream."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import gc

from threadpoolctl import threadpool_limits


@contextmanager
def steady() -> Iterator[None]:
    """
    Use one thread of linear algebra, and search no object for garbage that is there already.

    Matrices of a hundred rows are done sooner than threads have met; where another process has
    the second core, they wait for each other, and 0.2 ms become 20. Objects of the libraries stay
    for good, but a collection that looks through them stops the process for 70 ms.

    """
    gc.collect()
    gc.freeze()
    try:
        with threadpool_limits(limits=1):
            yield
    finally:
        gc.unfreeze()
