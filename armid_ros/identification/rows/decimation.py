# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decimations that leave too few samples, and the largest one that leaves enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import math

from armid_ros.errors import IdentificationError
from armid_ros.identification.rows.signals import Conditioning, decimated_samples, segments
from armid_ros.recording import Recording


def check_decimation(recordings: Sequence[Recording], used: Conditioning, least: int) -> None:
    """
    Refuse recordings of which the decimation leaves too few samples, and a smaller one enough.

    Parameters
    ----------
    recordings : sequence of Recording
        Data with torques.
    used : Conditioning
        Filters.
    least : int
        Samples that are needed, of all recordings together.

    Raises
    ------
    IdentificationError
        Naming the largest decimation that works, and how long to record where nobody asked for
        one.

    """

    def left(decimation: int) -> int:
        one = replace(used, decimation=decimation)
        parts = (part for recording in recordings for part in segments(recording, one))
        return sum(len(decimated_samples(len(part), one)) for part in parts)

    count = left(used.decimation)
    if count >= least:
        return
    # the largest decimation that leaves enough; zero where none does
    largest, fails = 0, min(used.decimation, max(len(one) for one in recordings))
    while fails - largest > 1:
        middle = (largest + fails) // 2
        if left(middle) >= least:
            largest = middle
        else:
            fails = middle
    if largest and 'decimation' not in used.given:
        duration = sum(one.duration for one in recordings)
        needed = duration + (least - count) * used.decimation / used.rate_hz
        raise IdentificationError(
            f'{recordings[0].source}: {duration:.2f} s are too short, {count} samples are left '
            f'behind the filters and {least} or more are needed: record '
            f'{math.ceil(10 * needed) / 10:g} s or more, or ask for --decimation {largest}'
        )
    if largest:
        raise IdentificationError(
            f'{recordings[0].source}: --decimation {used.decimation} leaves {count} samples, '
            f'{least} or more are needed: --decimation {largest} is the largest that works'
        )
