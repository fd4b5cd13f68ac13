# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Time spans in which a cause acts, such as a payload that is picked up and put down.

Every cause is fitted with columns that are zero outside a span of each recording. In one
recording after the other, the pair of change points with the largest evidence is searched.

"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, pairwise
from pathlib import Path
from typing import TypeAlias

from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.odds import CauseInformation, OWN_SPREADS, posteriors
from armid_ros.diagnosis.search.trial import Look, Ranked
from armid_ros.diagnosis.settings import Thresholds
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Time between candidate change points [s], and the shortest span [s].
_STEP, _SHORTEST = 0.25, 3.0
#: Number of candidate change points of the first pass, in each recording.
_COARSE = 9
#: First and last change point of the span of each recording.
Spans: TypeAlias = Mapping[int, tuple[int, int]]


@dataclass(frozen=True)
class Span:
    """
    Time span of a recording in which a cause acts.

    Attributes
    ----------
    source : str
        The recording.
    start, stop : float
        Beginning and end of the span [s]; equal if the cause does not act in this recording.
    whole : bool
        Whether the cause acts throughout.

    """

    source: str
    start: float
    stop: float
    whole: bool


@dataclass(frozen=True)
class _Timed:
    """A cause with candidate change points (edges) in each recording of the diagnosed day."""

    ranked: Ranked
    look: Look

    @cached_property
    def times(self) -> dict[int, FloatArray]:
        """Time of the rows of each recording [s]."""
        rows = self.look.nuisance.rows
        return {
            k: np.concatenate([part.t for part in rows.data if part.fold == k])
            for k in np.flatnonzero(rows.today).tolist()
        }

    @cached_property
    def edges(self) -> dict[int, npt.NDArray[np.intp]]:
        """Rows of each recording at which a span may begin or end."""
        found = {}
        for k, t in self.times.items():
            points = np.linspace(t[0], t[-1], max(int((t[-1] - t[0]) / _STEP), 1) + 1)
            points[-1] = np.inf
            found[k] = np.searchsorted(t, points)
        return found

    @cached_property
    def _sums(self) -> dict[int, list[FloatArray]]:
        """Products with nuisance columns, columns and residual, summed up to each edge."""
        nuisance, cause = self.look.nuisance, self.ranked.cause
        joints = list(cause.joints)
        found = dict[int, list[FloatArray]]()
        for k, edges in self.edges.items():
            z, x, y = cause.columns[k], nuisance.columns[k][joints], nuisance.residual[k][joints]
            factors = ('jmq,jmp->qp', x), ('jmq,jmp->qp', z), ('jm,jmp->p', y)
            found[k] = []
            for product, other in factors:
                parts = [
                    np.einsum(product, other[:, a:b], z[:, a:b])
                    for a, b in pairwise(edges.tolist())
                ]
                found[k].append(np.cumsum([np.zeros_like(parts[0]), *parts], axis=0))
        return found

    def within(self, tried: Sequence[Spans]) -> list[Ranked]:
        """Return the cause that acts between two edges of each recording, for several spans."""
        nuisance, cause = self.look.nuisance, self.ranked.cause
        causes, choices = list[Cause](), list[float]()
        for spans in tried:
            products, own, aim = (x.copy() for x in (cause.products, cause.own, cause.aim))
            choices.append(0.0)  # log of the number of possible spans
            for k, (a, b) in spans.items():
                products[k], own[k], aim[k] = (x[b] - x[a] for x in self._sums[k])
                count = len(self.edges[k])
                if b - a < count - 1:
                    choices[-1] += float(np.log(0.5 * count * (count - 1)))
            causes.append(replace(cause, products=products, own=own, aim=aim))
        # Earlier values act throughout, so that all spans are compared with the same null model.
        known = CauseInformation.of(causes, nuisance, self.ranked.under, by_day=True)
        fits = posteriors(causes, nuisance, known.of_day(today=True))
        return [
            replace(self.ranked, cause=timed, fit=fit, data=fit.factor - choice)
            for timed, choice, fit in zip(causes, choices, fits, strict=True)
        ]

    @cached_property
    def throughout(self) -> Ranked:
        """The cause that acts throughout."""
        return self.within([self._whole])[0]

    @property
    def _whole(self) -> Spans:
        return {k: (0, len(edges) - 1) for k, edges in self.edges.items()}

    def coarse(self) -> tuple[Ranked, Spans]:
        """Return the likeliest spans on a coarse grid of edges."""
        found, spans = self.throughout, self._whole
        for k, edges in self.edges.items():
            coarse = np.unique(np.linspace(0, len(edges) - 1, _COARSE).astype(int)).tolist()
            tried = [(0, 0), *combinations(coarse, 2)]
            found, spans = self._likeliest_span(found, spans, k, tried)
        return found, spans

    def refined(self, found: Ranked, spans: Spans) -> tuple[Ranked, Spans]:
        """Return spans after each edge is moved twice to the likeliest change point."""
        for _ in range(2):
            for k, edges in self.edges.items():
                near = (len(edges) - 1) // (_COARSE - 1)
                for end in (0, 1):
                    first, last = spans[k]
                    moves = range(-near, near + 1)
                    tried = [(first, last + x) if end else (first + x, last) for x in moves]
                    found, spans = self._likeliest_span(found, spans, k, tried)
        return found, spans

    def _likeliest_span(
        self,
        found: Ranked,
        spans: Spans,
        recording: int,
        tried: Iterable[tuple[int, int]],
    ) -> tuple[Ranked, Spans]:
        """Return the likeliest candidate span of one recording."""
        last, least = len(self.edges[recording]) - 1, round(_SHORTEST / _STEP)
        others = [
            {**spans, recording: (a, b)}
            for a, b in tried
            if 0 <= a <= b <= last and (b - a >= least or a == b == 0)
        ]
        ranked = self.within(others) if others else []
        pairs: list[tuple[Ranked, Spans]] = [(found, spans), *zip(ranked, others, strict=True)]
        return max(pairs, key=lambda one: one[0].worth)


def acting_spans(look: Look, thresholds: Thresholds) -> tuple[Span, ...]:
    """
    Return the time spans in which the likeliest cause acts.

    Parameters
    ----------
    look : Look
        Comparison of causes that act throughout.
    thresholds : Thresholds
        Log odds (`alarm`) required over causes that act throughout, and over mere differences of
        values between recordings.

    Returns
    -------
    tuple of Span
        One for each recording of the diagnosed day; empty if no span reaches these odds.

    """
    if not look.ranking:
        return ()
    timed = [_Timed(one, look) for one in look.ranking]
    coarse = sorted(((*one.coarse(), one) for one in timed), key=lambda one: -one[0].worth)
    found = [(*own.refined(one, near), own) for one, near, own in coarse[:3]]
    best, spans, own = max(found, key=lambda one: one[0].worth)
    throughout = max((one.throughout for one in timed), key=lambda one: one.worth)
    nuisance = look.nuisance
    known = CauseInformation.of([best.cause], nuisance, best.under).of_day(today=True)
    (there,) = posteriors([best.cause], nuisance, known, look.usual, OWN_SPREADS)
    lead = best.ahead(throughout, thresholds)
    if min(lead, there.factor) <= thresholds.alarm:
        return ()
    rows, result = nuisance.rows, []
    for number, (k, (a, b)) in enumerate(spans.items()):
        edges, t = own.edges[k], own.times[k]
        name = Path(next(part.source for part in rows.data if part.fold == k)).name
        whole = b - a == len(edges) - 1
        start, stop = (float(t[min(edges[x], len(t) - 1)]) for x in (a, b))
        result.append(Span(name or f'recording {number + 1}', start, stop, whole))
    return tuple(result)
