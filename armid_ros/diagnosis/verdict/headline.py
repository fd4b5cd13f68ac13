# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which names are the headline: those that other data do not deny, and that take enough."""

from __future__ import annotations

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.search.explanation import (
    Explanation,
    in_model_as_given,
)
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.diagnosis.verdict.attribution import attribute, Attribution
from armid_ros.identification.fitting.identifiability import excludes_zero
import numpy as np

#: Recordings hardly show what takes less than this share of the share it takes of others.
_HARDLY = 0.1


def headline(
    explanation: Explanation, unseen: Evidence | None, settings: DiagnosisSettings, least: float
) -> tuple[Explanation, Attribution]:
    """
    Drop names that other data deny, leave small ones to the small print, share out the gap.

    The gap is shared out on those data, or on the data left out one by one where those hardly show
    what was named.

    """
    shares, denied = shares_of(explanation, unseen)
    gone = denied[0] if denied else smallest(explanation, shares, settings, least)
    if gone is None:
        return explanation, shares
    return headline(explanation.without(gone), unseen, settings, least)


def smallest(
    explanation: Explanation, shares: Attribution, settings: DiagnosisSettings, least: float
) -> int | None:
    """
    Return the name that takes least, if it is small print; None if every name is a headline.

    A name is small print whose values may all be zero, or that takes less than a share and leaves
    no gap open where it is missing.

    """
    for k in sorted(range(len(explanation.steps)), key=lambda k: shares.share([k])):
        if may_be_nothing(explanation, k):
            return k
        small = shares.share([k]) < least
        if small and not _opens(explanation.without(k), explanation, settings):
            return k
    return None


def _opens(fewer: Explanation, explanation: Explanation, settings: DiagnosisSettings) -> bool:
    """Return whether a gap is open in a joint without a name, and closed with it."""
    if explanation.prior is not None:
        fewer, explanation = in_model_as_given(fewer), in_model_as_given(explanation)
    limits = explanation.evidence.limits(explanation.fitted.residual, settings)
    return bool(np.any((fewer.chi2_per_row > limits) & (explanation.chi2_per_row <= limits)))


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


def may_be_nothing(explanation: Explanation, name: int) -> bool:
    """
    Return whether the 95 % interval of every value of a name holds zero.

    Shapes are none of them: they say how it acts, and not whether. Values are asked at the shapes
    that were found, as a drift may be slow and large or fast and small and still be there.

    """
    fitted = explanation.fitted
    values, shapes = fitted.places[name]
    span = np.arange(values.start, shapes.stop)
    variance = np.diag(fitted.estimate.covariance)
    known = span[np.isfinite(variance[span])]
    precision = np.linalg.pinv(fitted.estimate.covariance[np.ix_(known, known)], hermitian=True)
    asked = known < values.stop
    at_shapes = np.linalg.pinv(precision[np.ix_(asked, asked)], hermitian=True)
    deviation = np.sqrt(np.diag(at_shapes))
    return not np.any(excludes_zero(fitted.estimate.values[known[asked]], deviation))
