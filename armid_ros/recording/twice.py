# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Check that no recording is given more than once."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.errors import RecordingError
from armid_ros.recording.recording import Recording
import numpy as np


def given_twice(fitted: Sequence[Recording], held_out: Sequence[Recording] = ()) -> str:
    """
    Return a text that names the recordings that are given twice.

    A recording that is fitted twice has twice the weight, and a fitted recording is not held out.
    Two recordings are the same if positions and torques agree: two simulated runs may share their
    positions.

    Parameters
    ----------
    fitted, held_out : sequence of Recording
        Recordings that the model is fitted to, and held-out recordings.

    Returns
    -------
    str
        Names of the repeated recordings and of their originals; empty if there are none.

    """

    def same(a: Recording, b: Recording) -> bool:
        if a.tau is None or b.tau is None:
            return a.tau is b.tau and np.array_equal(a.q, b.q)
        return np.array_equal(a.q, b.q) and np.array_equal(a.tau, b.tau)

    again = [
        a.source if a.source == b.source else f'{a.source} (is {b.source})'
        for k, a in enumerate([*fitted, *held_out])
        for b in fitted[:k]
        if same(a, b)
    ]
    return f'given twice, or in two roles: {", ".join(dict.fromkeys(again))}' if again else ''


def require_once(fitted: Sequence[Recording], held_out: Sequence[Recording] = ()) -> None:
    """Raise a RecordingError if recordings are given twice."""
    said = given_twice(fitted, held_out)
    if said:
        raise RecordingError(f'{said}; give each recording once')
