# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings that are given more than once."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.errors import RecordingError
from armid_ros.recording.recording import Recording
import numpy as np


def given_twice(fitted: Sequence[Recording], held_out: Sequence[Recording] = ()) -> str:
    """
    Say which recordings are among those that are fitted already.

    What is fitted twice counts twice, and what is fitted is not held out. Two runs of a simulated
    trajectory have the same positions; only the same torques as well make them one.

    Parameters
    ----------
    fitted, held_out : sequence of Recording
        What a model is fitted to, and what it is only to predict.

    Returns
    -------
    str
        Their names, and those of what they are the same as; empty if there are none.

    """
    again = [
        a.source if a.source == b.source else f'{a.source} (is {b.source})'
        for k, a in enumerate([*fitted, *held_out])
        for b in fitted[:k]
        if _same(a, b)
    ]
    return f'given twice, or in two roles: {", ".join(dict.fromkeys(again))}' if again else ''


def require_once(fitted: Sequence[Recording], held_out: Sequence[Recording] = ()) -> None:
    """Raise a RecordingError that names the recordings that are given twice."""
    said = given_twice(fitted, held_out)
    if said:
        raise RecordingError(f'{said}; give each recording once')


def _same(a: Recording, b: Recording) -> bool:
    if a.tau is None or b.tau is None:
        return a.tau is b.tau and np.array_equal(a.q, b.q)
    return np.array_equal(a.q, b.q) and np.array_equal(a.tau, b.tau)
