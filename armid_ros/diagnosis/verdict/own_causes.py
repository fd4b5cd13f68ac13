# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Causes of the arm itself before a person or a strap.

Whoever pushes may push anywhere and in any way, and takes a little more of what a wrong model gets
wrong of any cause, or of two together.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from armid_ros.diagnosis.search.choice import at_floor, Chosen, freedom
from armid_ros.diagnosis.search.explain import Explanation
from armid_ros.diagnosis.search.held_out import Trial
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.diagnosis.verdict.attribution import attribute
from armid_ros.effects import CATALOGUE

#: Explains the gap by what a library has.
Explain = Callable[[DiagnosisSettings], Chosen]


def own_causes_first(explain: Explain, settings: DiagnosisSettings) -> Chosen:
    """
    Explain the gap, by the arm's own causes where they do as well as others from outside.

    They do if they leave no gap, have fewer values, and take as much of data left out; what acts
    from outside is the rival of the first of them then.

    """
    found = explain(settings)
    outside = [s for s in found.explanation.steps if s.trial.group.effect.external]
    if not outside:
        return found
    own = tuple(name for name in settings.library if not CATALOGUE[name].external)
    inside = explain(replace(settings, library=own))
    if not _as_good(inside.explanation, found.explanation, settings):
        return found
    rivals = tuple(step.trial for step in outside)
    rest = None if inside.rest is None else _with_rivals(inside.rest, rivals)
    return replace(inside, explanation=_with_rivals(inside.explanation, rivals), rest=rest)


def _as_good(inside: Explanation, found: Explanation, settings: DiagnosisSettings) -> bool:
    if not inside.steps or not at_floor(inside, settings):
        return False
    if freedom(inside, settings) > freedom(found, settings):
        return False
    return _left_out(inside) >= _left_out(found) - settings.thresholds.tie


def _left_out(explanation: Explanation) -> float:
    """Return the share of the gap that names take of each part of the data left out."""
    return attribute(explanation, None).share(range(len(explanation.steps)))


def _with_rivals(explanation: Explanation, rivals: tuple[Trial, ...]) -> Explanation:
    """Return an explanation whose first name may be something else as well."""
    first, *others = explanation.steps
    first = replace(first, rivals=(*first.rivals, *rivals))
    return replace(explanation, steps=(first, *others))
