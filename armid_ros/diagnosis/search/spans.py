# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Time spans in which a cause acts, such as a payload that is picked up and put down.

Each cause is fitted with columns that are zero outside one span of each recording. The start and
end with the largest Bayes factor are searched, for one recording after the other.

"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, pairwise
from typing import TypeAlias

from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.odds import CauseInformation, fit_causes, OWN_SPREADS
from armid_ros.diagnosis.search.ranking import RankedCause, Ranking
from armid_ros.diagnosis.settings import Thresholds
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Time between candidate change points [s], and the shortest span [s].
_STEP, _SHORTEST = 0.25, 3.0
#: Number of candidate change points of the first pass, in each recording.
_COARSE = 9
#: Indices of the first and last change point of the span in each recording.
Spans: TypeAlias = Mapping[int, tuple[int, int]]


@dataclass(frozen=True)
class Span:
    """
    Time interval of a recording in which a cause acts.

    Attributes
    ----------
    source : str
        Name of the recording.
    start, stop : float
        Start and end of the span [s]; equal if the cause does not act in this recording.
    whole : bool
        Whether the cause acts throughout the recording.

    """

    source: str
    start: float
    stop: float
    whole: bool


@dataclass(frozen=True)
class _TimedCause:
    """Cause with candidate start and end times (edges) in each diagnosed recording."""

    ranked: RankedCause
    ranking: Ranking

    @cached_property
    def times(self) -> dict[int, FloatArray]:
        """Times of the rows of each diagnosed recording [s]."""
        rows = self.ranking.nuisance.rows
        return {
            k: np.concatenate([part.t for part in rows.data if part.fold == k])
            for k in np.flatnonzero(rows.diagnosed).tolist()
        }

    @cached_property
    def edges(self) -> dict[int, npt.NDArray[np.intp]]:
        """Row indices at which a time interval may start or end, in each recording."""
        found = {}
        for k, t in self.times.items():
            points = np.linspace(t[0], t[-1], max(int((t[-1] - t[0]) / _STEP), 1) + 1)
            points[-1] = np.inf
            found[k] = np.searchsorted(t, points)
        return found

    @cached_property
    def _sums(self) -> dict[int, list[FloatArray]]:
        """Cumulative sums of `products`, `own` and `aim` of the cause, up to each edge."""
        nuisance, cause = self.ranking.nuisance, self.ranked.cause
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

    def within(self, tried: Sequence[Spans]) -> list[RankedCause]:
        """Return the cause with columns set to zero outside the intervals, for each set."""
        nuisance, cause = self.ranking.nuisance, self.ranked.cause
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
        information = CauseInformation.of(causes, nuisance, self.ranked.posterior, pooled=True)
        fits = fit_causes(causes, nuisance, information.only(diagnosed=True))
        return [
            replace(self.ranked, cause=timed, fit=fit, log_bayes_factor=fit.factor - choice)
            for timed, choice, fit in zip(causes, choices, fits, strict=True)
        ]

    @cached_property
    def throughout(self) -> RankedCause:
        """The cause, assumed to act throughout all diagnosed recordings."""
        return self.within([self._whole])[0]

    @property
    def _whole(self) -> Spans:
        return {k: (0, len(edges) - 1) for k, edges in self.edges.items()}

    def coarse(self) -> tuple[RankedCause, Spans]:
        """Return the cause with its likeliest time intervals on a coarse grid."""
        found, spans = self.throughout, self._whole
        for k, edges in self.edges.items():
            coarse = np.unique(np.linspace(0, len(edges) - 1, _COARSE).astype(int)).tolist()
            tried = [(0, 0), *combinations(coarse, 2)]
            found, spans = self._likeliest_span(found, spans, k, tried)
        return found, spans

    def refined(self, found: RankedCause, spans: Spans) -> tuple[RankedCause, Spans]:
        """Move the ends of each time interval to their likeliest places; return the cause."""
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
        found: RankedCause,
        spans: Spans,
        recording: int,
        tried: Iterable[tuple[int, int]],
    ) -> tuple[RankedCause, Spans]:
        """Return the cause with the likeliest of several time intervals in one recording."""
        last, least = len(self.edges[recording]) - 1, round(_SHORTEST / _STEP)
        others = [
            {**spans, recording: (a, b)}
            for a, b in tried
            if 0 <= a <= b <= last and (b - a >= least or a == b == 0)
        ]
        ranked = self.within(others) if others else []
        pairs: list[tuple[RankedCause, Spans]] = [
            (found, spans),
            *zip(ranked, others, strict=True),
        ]
        return max(pairs, key=lambda one: one[0].log_posterior)


def acting_spans(ranking: Ranking, thresholds: Thresholds) -> tuple[Span, ...]:
    """
    Return the time intervals in which the likeliest cause acts.

    Parameters
    ----------
    ranking : Ranking
        Ranking of causes that act throughout.
    thresholds : Thresholds
        Log odds (`alarm`) required over causes that act throughout, and over mere differences of
        values between recordings.

    Returns
    -------
    tuple of Span
        One for each diagnosed recording; empty if no span reaches these odds.

    """
    if not ranking.ranked:
        return ()
    timed = [_TimedCause(one, ranking) for one in ranking.ranked]
    coarse = sorted(((*one.coarse(), one) for one in timed), key=lambda one: -one[0].log_posterior)
    found = [(*own.refined(one, near), own) for one, near, own in coarse[:3]]
    best, spans, own = max(found, key=lambda one: one[0].log_posterior)
    throughout = max((one.throughout for one in timed), key=lambda one: one.log_posterior)
    nuisance = ranking.nuisance
    every = CauseInformation.of([best.cause], nuisance, best.posterior)
    information, spread = every.only(diagnosed=True), ranking.typical_spread
    (there,) = fit_causes([best.cause], nuisance, information, spread, OWN_SPREADS)
    lead = best.log_odds_over(throughout, thresholds)
    if min(lead, there.factor) <= thresholds.alarm:
        return ()
    rows, result = nuisance.rows, []
    for number, (k, (a, b)) in enumerate(spans.items()):
        edges, t = own.edges[k], own.times[k]
        name = next(part.source for part in rows.data if part.fold == k)
        start, stop = (float(t[min(edges[x], len(t) - 1)]) for x in (a, b))
        name, whole = name or f'recording {number + 1}', b - a == len(edges) - 1
        result.append(Span(name, start, stop, whole))
    return tuple(result)
