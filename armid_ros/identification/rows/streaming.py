# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Rows of a recording that may be larger than the memory, piece by piece.

Pieces overlap by what the filters need to forget their ends, and a piece begins where a row of the
one before would sit, so rows are those of the whole recording; each comes from one piece alone.
Where stamps jitter each piece has an even time base of its own, and a joint counts as at rest by
its top speed within the piece.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from armid_ros.arm import ArmModel
from armid_ros.identification.rows.damage import without_damage
from armid_ros.identification.rows.regression import Regression, regressions
from armid_ros.identification.rows.signals import (
    Conditioning,
    EDGE_PERIODS,
    SignalSettings,
)
from armid_ros.recording import ReadSettings, Recording
from armid_ros.recording.reader import read_pieces
from armid_ros.recording.recording import GAP_PERIODS
import numpy as np
import numpy.typing as npt


def _cuts(piece: Recording, used: Conditioning) -> tuple[int, int]:
    """Return the stamps that the next piece begins with, and where its own rows begin [ns]."""
    # after 16 periods a filter of order 4 has forgotten where it began: exp(-38)
    periods = (EDGE_PERIODS + 16.0) * used.rate_hz / used.cutoff_hz
    margin = int(np.ceil(periods)) + len(used.taps())
    longest = GAP_PERIODS * max(1.0 / used.rate_hz, piece.period)
    gaps = np.flatnonzero(np.diff(piece.t) > longest)
    origin = int(gaps[-1]) + 1 if len(gaps) else 0
    first = max(len(piece) - 2 * margin, origin)
    row = first
    if first > origin:
        first -= (first - origin) % used.decimation
        row = first + margin
    keep, own = (piece.start_ns + round(1e9 * float(piece.t[k])) for k in (first, row))
    return keep, own - round(0.5e9 / used.rate_hz)


def streamed(
    path: str | Path,
    arm: ArmModel,
    columns: npt.NDArray[np.intp],
    choose: Callable[[Recording], Conditioning],
    samples: int,
    *,
    topic: str | None = None,
    settings: ReadSettings,
) -> Iterator[tuple[Recording, Sequence[Regression]]]:
    """
    Yield pieces of a recording without damaged samples, with the rows that each has to itself.

    Parameters
    ----------
    path : str or Path
        The bag.
    arm : ArmModel
        Rigid body and effects.
    columns : ndarray of int, shape (r,)
        Which of ``arm.parameters`` to keep.
    choose : callable
        Returns the filters, given the first piece.
    samples : int
        New samples a piece has at most.
    topic, settings
        As of ``read_recording``.

    """
    chosen: list[Conditioning] = []  # with the first piece, before any cut
    start = -np.inf
    for piece, last in read_pieces(
        path,
        joints=arm.robot.joints,
        topic=topic,
        samples=samples,
        keep=lambda piece: _cuts(piece, chosen[0])[0],
        settings=settings,
    ):
        if not chosen:
            chosen.append(choose(piece))
        used = chosen[0]
        (repaired,), _ = without_damage([piece], SignalSettings(used.cutoff_hz, used.decimation))
        stop = np.inf if last else float(_cuts(piece, used)[1])
        owned = []
        for rows in regressions(arm, columns, [repaired], used):
            t = 1e9 * rows.motion.t
            inside = (t >= start - piece.start_ns) & (t < stop - piece.start_ns)
            if inside.any():
                owned.append(rows if inside.all() else rows.select(np.flatnonzero(inside)))
        yield repaired, owned
        start = stop
