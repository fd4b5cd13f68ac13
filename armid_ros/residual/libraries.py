# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The libraries that only learning needs."""

from __future__ import annotations

from contextlib import AbstractContextManager
from importlib import import_module
from typing import Any

from armid_ros.errors import IdentificationError

#: Parts of scikit-learn that have threads of their own.
_COMPUTES = ('sklearn.cluster', 'sklearn.gaussian_process', 'sklearn.linear_model')


def imported(library: str) -> Any:
    """Import a library; IdentificationError says how to install it."""
    try:
        return import_module(library)
    except ImportError:
        raise IdentificationError(
            'learning a residual needs scikit-learn, which is not installed: '
            "pip install 'armid_ros[residual]'"
        ) from None


def one_thread() -> AbstractContextManager[object]:
    """
    Return a context in which linear algebra has one thread.

    Learning solves thousands of systems of a hundred rows. Two threads wait for each other
    fifteen times as long as they compute.

    Raises
    ------
    IdentificationError
        If the library is not installed.

    """
    for library in _COMPUTES:
        imported(library)  # only the threads of what is loaded can be limited
    limits: AbstractContextManager[object] = imported('threadpoolctl').threadpool_limits(1)
    return limits


def require_libraries() -> None:
    """
    Check that they are installed, before minutes of work.

    Raises
    ------
    IdentificationError
        If one is not; the message says how to install it.

    """
    imported('sklearn')
