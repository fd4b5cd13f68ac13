# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which names are the headline: those that other data do not deny, and that take enough."""

from __future__ import annotations

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.search.explain import Explanation
from armid_ros.diagnosis.verdict.attribution import attribute, Attribution

#: Recordings hardly show what takes less than this share of the share it takes of others.
_HARDLY = 0.1


def headline(
    explanation: Explanation, unseen: Evidence | None, least: float
) -> tuple[Explanation, Attribution]:
    """
    Drop names that other data deny, leave small ones to the small print, share out the gap.

    It is shared out on those data, or on the data left out one by one where those hardly show
    what was named.

    """
    shares, denied = shares_of(explanation, unseen)
    small = [k for k in range(len(explanation.steps)) if shares.share([k]) < least]
    gone = denied or sorted(small, key=lambda k: shares.share([k]))
    if gone:
        return headline(explanation.without(gone[0]), unseen, least)
    return explanation, shares


def shares_of(explanation: Explanation, unseen: Evidence | None) -> tuple[Attribution, list[int]]:
    """Share out the gap, and return the names that other data deny, the least first."""
    left_out = attribute(explanation, None)
    if unseen is None:
        return left_out, []
    names = range(len(explanation.steps))
    seen = attribute(explanation, unseen)
    denied = [k for k in reversed(seen.order) if seen.denied(k)]
    shown = seen.share(names) > _HARDLY * left_out.share(names)
    return (seen if shown else left_out), denied
