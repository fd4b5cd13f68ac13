# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Estimators side by side on the same data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.identification.estimators.names import IN_WORDS
from armid_ros.identification.estimators.side_by_side import MethodScore
from armid_ros.report.page import Section


@dataclass(frozen=True)
class Methods(Section):
    """
    What each estimator makes of the recordings.

    Attributes
    ----------
    scores : sequence of MethodScore
        One a method.

    """

    title: ClassVar[str] = 'Methods side by side'
    template: ClassVar[str] = 'methods.html'

    scores: Sequence[MethodScore]

    @property
    def rows(self) -> list[tuple[str, str, list[tuple[str, bool]]]]:
        """Name, what it is, and its cells, with whether each is the least of its column."""
        table = [
            (s.training, s.held_out, s.position_error, s.bias, s.scatter, s.seconds)
            for s in self.scores
        ]
        known = [[x for x in column if x is not None] for column in zip(*table, strict=True)]
        least = [min(column, default=None) for column in known]
        return [
            (
                score.method,
                IN_WORDS[score.method],
                [
                    ('-' if x is None else f'{x:.3g}', x is not None and x == best)
                    for x, best in zip(cells, least, strict=True)
                ],
            )
            for score, cells in zip(self.scores, table, strict=True)
        ]

    @property
    def notes(self) -> list[tuple[str, str]]:
        """Method and note of those that have one."""
        return [(score.method, score.note) for score in self.scores if score.note]
