# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Linear problem of a recording that may be larger than the memory, in pieces.

Pieces overlap, so that effects of the filters at their ends have decayed. A piece begins at the
time of a decimated sample of the previous piece. All decimated samples therefore equal those of
the recording in one piece, and each comes from one piece. Two values differ between pieces: the
even time base of jittering stamps, and the top speed that defines a joint at rest.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from armid_ros.arm import ArmModel
from armid_ros.identification.rows.damage import without_damage
from armid_ros.identification.rows.regression import Regression, regressions
from armid_ros.identification.rows.signals import Conditioning, EDGE_PERIODS
from armid_ros.identification.rows.stamps import check_recordings
from armid_ros.recording import ReadSettings, Recording
from armid_ros.recording.reader import read_pieces
from armid_ros.recording.recording import GAP_PERIODS
import numpy as np
import numpy.typing as npt


def _cuts(piece: Recording, used: Conditioning) -> tuple[int, int]:
    """Return the start times of a recording's next piece and of its decimated samples [ns]."""
    # after 16 periods, the start of a filter of order 4 has decayed to exp(-38)
    periods = (EDGE_PERIODS + 16.0) * used.rate_hz / used.cutoff_hz
    margin = int(np.ceil(periods)) + len(used.taps)
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
    Read a bag in pieces; yield the repaired recording and the linear problem of each piece.

    Parameters
    ----------
    path : str or Path
        The bag.
    arm : ArmModel
        Rigid body and effects.
    columns : ndarray of int, shape (r,)
        Indices of the columns to keep, as in ``arm.parameters``.
    choose : callable
        Function that returns the filters for the first piece.
    samples : int
        Largest number of new samples in a piece.
    topic, settings
        See ``read_recording``.

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
        check_recordings([piece])
        (repaired,), _ = without_damage([piece], used)
        stop = np.inf if last else float(_cuts(piece, used)[1])
        owned = []
        for rows in regressions(arm, columns, [repaired], used):
            t = 1e9 * rows.motion.t
            inside = (t >= start - piece.start_ns) & (t < stop - piece.start_ns)
            if inside.any():
                owned.append(rows if inside.all() else rows.select(np.flatnonzero(inside)))
        yield repaired, owned
        start = stop
