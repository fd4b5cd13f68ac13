# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Comparison of two identifications."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, TYPE_CHECKING

from armid_ros.api.identification import IdentificationResult
from armid_ros.api.table import data_frame, Shown, Summary
from armid_ros.identification.assess.compare import compare as run
from armid_ros.identification.assess.comparison import Comparison, SCHEMA
from armid_ros.identification.parameters_file import ParameterFile, parameters_of, read_parameters
from armid_ros.report.compare_report import (
    change_rows,
    change_sentences,
    compare_report,
    HEADS,
    next_step,
    verdict,
)
from armid_ros.report.provenance import DEFAULT_ORIGIN, ResultOrigin

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, repr=False, eq=False)
class ComparisonResult(Shown):
    """
    Result of the comparison of two identifications.

    Attributes
    ----------
    core : Comparison
        Everything that the comparison found.

    Examples
    --------
    >>> import armid_ros as ar
    >>> changed = ar.compare('monday_result', 'friday_result')
    >>> changed.anything, round(changed.load, 1)  # [kg]
    (True, 0.4)

    """

    schema = SCHEMA

    core: Comparison

    files = ('comparison.json', 'report.html')

    @property
    def anything(self) -> bool:
        """Whether any parameter or residual changed significantly."""
        return self.core.anything

    @property
    def load(self) -> float | None:
        """Mass added to a link [kg]; None if no load explains the parameter changes."""
        return None if self.core.load is None else float(self.core.load.mass)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a pandas table of all parameters with their values in both identifications."""
        return data_frame(self.document()['parameters'])

    def document(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> dict[str, Any]:
        """Return the content of comparison.json."""
        return self.core.document()

    def page(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> str:
        """Return the text of report.html, with the changed parameters and residuals."""
        return compare_report(self.core, origin)

    def summary(self) -> Summary:
        """Return the terminal summary of the changes, the most significant first."""
        rows = change_rows(self.core)
        first, *more = change_sentences(self.core)
        then = 'diagnose' if self.anything or self.core.unusable else 'identify'
        heads = HEADS if rows else ()
        steps = [next_step(self.core)]
        return Summary(first, verdict(self.core)[0], heads, rows, more, steps, then)


def compare(
    before: IdentificationResult | str | Path, after: IdentificationResult | str | Path
) -> ComparisonResult:
    """
    Compare two identifications of one robot.

    Parameters
    ----------
    before, after : IdentificationResult, or path
        Results of ``identify``, or the folders of such results.

    Returns
    -------
    ComparisonResult
        Prints the changes; ``report``, ``save``, ``to_dataframe``.

    Raises
    ------
    ArmidError
        If a folder has no result, both results are equal, or their robots differ.

    Examples
    --------
    >>> import armid_ros as ar
    >>> print(ar.compare('monday_result', 'friday_result'))
    CHANGED: A load of 0.39... kg was added to the link of elbow...

    """
    return ComparisonResult(run(_parameters('before', before), _parameters('after', after)))


def _parameters(name: str, one: IdentificationResult | str | Path) -> ParameterFile:
    if isinstance(one, IdentificationResult):
        return parameters_of(name, one.document())
    return read_parameters(one)
