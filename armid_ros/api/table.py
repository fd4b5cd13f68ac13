# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Display of results: text in a terminal, the report in a notebook."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, TYPE_CHECKING

from armid_ros.api.arguments import source_of
from armid_ros.arm import ArmModel
from armid_ros.arm.export import arm_urdf
from armid_ros.errors import ArmidError
from armid_ros.files import json_text, result_folder, staged, write_file
from armid_ros.motion import FloatArray
from armid_ros.report.provenance import DEFAULT_ORIGIN, ResultOrigin
from armid_ros.robots import Robot
from markupsafe import escape
import numpy as np

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Summary:
    """
    Text that a command prints about its result.

    Attributes
    ----------
    title : str
        Kind of the result, with the number that matters most.
    badge : str
        Verdict or grade in one word; empty if none.
    heads : sequence of str
        Headings of the columns.
    rows : sequence of sequence of str
        Cells; the first is a name.
    lines : sequence of str
        Lines below the table.
    steps : sequence of str
        Next steps for the user.
    then : str
        Name of the command of the next step; empty for none.

    """

    title: str
    badge: str = ''
    heads: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    lines: Sequence[str] = ()
    steps: Sequence[str] = ()
    then: str = ''

    def text(self, *below: str) -> list[str]:
        """Return the lines of the summary; the lines `below` are put before the next steps."""
        headline = f'{self.badge.upper()}: {self.title}' if self.badge else self.title
        steps = [f'next: {step}' for step in self.steps]
        table = aligned(self.heads, self.rows)
        return [headline, *table, *filter(None, self.lines), *below, *steps]


#: Source of a recording, times [s] and residual torques [N m or N], shapes (M,) and (M, n).
ResidualPart = tuple[str, FloatArray, FloatArray]


def data_frame(rows: Any) -> pandas.DataFrame:
    """Convert rows to a pandas table; ArmidError if pandas is not installed."""
    try:
        from pandas import DataFrame
    except ModuleNotFoundError:
        raise ArmidError('to_dataframe() needs pandas: pip install pandas') from None
    return DataFrame(rows)


class Shown(ABC):
    """
    Base class of results: printed as a summary, saved as the files of the command.

    Attributes
    ----------
    schema : str
        Schema of its document.

    """

    schema: ClassVar[str]

    @property
    @abstractmethod
    def files(self) -> Sequence[str]:
        """Names of the result's files: the JSON document first, then the page."""

    @abstractmethod
    def summary(self) -> Summary:
        """Return the terminal summary of the result."""

    def with_step(self, origin: ResultOrigin, robot: Robot | None = None) -> ResultOrigin:
        """Return the provenance with the next command and, if given, the name of the robot."""
        shown, known = self.summary(), origin if robot is None else origin.of(source_of(robot))
        step = origin.step or ''.join(shown.steps[:1]) or f'armid {shown.then}'
        return replace(known, step=step)

    @abstractmethod
    def document(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> dict[str, Any]:
        """Return the content of the result's JSON file, with the given provenance."""

    def to_dict(self) -> dict[str, Any]:
        """Return the content of the result's JSON file."""
        return self.document()

    @abstractmethod
    def page(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> str:
        """Return the report as the text of a single HTML file."""

    def report(self, path: str | Path = 'report.html') -> Path:
        """Write the report as an HTML file; return its path."""
        write_file(Path(path), self.page())
        return Path(path)

    def fill(self, folder: Path, origin: ResultOrigin = DEFAULT_ORIGIN) -> dict[str, Any]:
        """Write all files of the result into an existing folder; return the JSON document."""
        document = self.document(origin)
        write_file(folder / self.files[1], self.page(origin))
        write_file(folder / self.files[0], json_text(document, indent=1))
        return document

    def save(self, folder: str | Path) -> Path:
        """Write the result's files to a folder; OutputError if the folder has other files."""
        with staged(Path(folder)) as result:
            self.fill(result.folder)
            with result_folder(Path(folder), self.schema):
                result.keep()
        return result.out

    def __repr__(self) -> str:
        """Return the summary as text."""
        return '\n'.join(self.summary().text())

    def _repr_html_(self) -> str:
        """Return HTML for a notebook: the report in a frame, or the summary without a report."""
        try:
            page = self.page()
        except ArmidError:  # a design without a trajectory has no page
            return f'<pre>{escape(repr(self))}</pre>'
        return f'<iframe srcdoc="{escape(page)}" width="100%" height="640"></iframe>'


class ShownModel(Shown):
    """Base class of results with an arm model and residual torques."""

    @abstractmethod
    def _residuals(self) -> Sequence[ResidualPart]:
        """Return source, times [s] and residual torques [N m or N] of each recorded section."""

    def residual_table(self) -> pandas.DataFrame:
        """
        Return a pandas table of residual torques [N m or N], held-out data last.

        Columns are recording, t [s], and every joint.

        Raises
        ------
        IdentificationError
            If the data of a diagnosis were refused, so that there is no residual.

        """
        names, times, residuals = zip(*self._residuals(), strict=True)
        columns = dict(zip(self.arm.robot.joints, np.concatenate(residuals).T, strict=True))
        sources = np.repeat(names, [len(t) for t in times])
        return data_frame({'recording': sources, 't': np.concatenate(times), **columns})

    @property
    @abstractmethod
    def arm(self) -> ArmModel:
        """Model of the arm."""

    def urdf(self, path: str | Path | None = None) -> str:
        """Return a URDF with the identified values; also write it to a file if a path is given."""
        text = arm_urdf(self.arm).text
        if path is not None:
            write_file(path, text)
        return text


def aligned(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a text table: first column aligned left, other columns right."""
    if not heads:
        return []
    table = [tuple(heads), *(tuple(row) for row in rows)]
    full = [row for row in table if len(row) == len(heads)]
    first, *widths = (max(len(row[k]) for row in full) for k in range(len(heads)))
    lines = []
    for name, *cells in table:
        rest = (cell.rjust(width) for cell, width in zip(cells, widths, strict=False))
        lines.append('  '.join(['', name.ljust(first) if cells else name, *rest]).rstrip())
    return lines
