# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is in a recording, and what is wrong with it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, TYPE_CHECKING

from armid_ros.api.arguments import (
    generator,
    RecordingLike,
    recordings_of,
    Rng,
    robot_of,
    RobotLike,
)
from armid_ros.api.table import Shown, Summary
from armid_ros.files import json_text, staged, write_file
from armid_ros.inspection import inspect as look
from armid_ros.inspection import Inspection, inspection_document
from armid_ros.recording import Recording
from armid_ros.recording.anything import read_anything
from armid_ros.recording.contents import bag_contents, TopicContent
from armid_ros.recording.ros1 import is_ros1
from armid_ros.recording.tables import ColumnSettings, is_table, measured, open_table, plan

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, repr=False, eq=False)
class InspectionResult(Shown):
    """
    What a recording holds.

    Attributes
    ----------
    core : Inspection
        Everything that was found.

    Examples
    --------
    >>> import armid_ros as ar
    >>> found = ar.inspect('monday', 'my_arm.urdf')
    >>> found.report('inspection.html').name
    'inspection.html'

    """

    core: Inspection

    @property
    def remarks(self) -> tuple[str, ...]:
        """Return what a person should know, the worst first."""
        return tuple(remark.text for remark in self.core.remarks)

    @property
    def recording(self) -> Recording:
        """Return what was read."""
        return self.core.recording

    def to_dataframe(self) -> pandas.DataFrame:
        """Return ranges, speeds and efforts of the joints as a pandas table."""
        from pandas import DataFrame

        return DataFrame(self.core.joints)

    def document(self) -> dict[str, Any]:
        """Return what ``armid inspect --json`` prints."""
        return inspection_document(self.core)

    def report(self, path: str | Path = 'inspection.html') -> Path:
        """Write the page with all curves; return where it is."""
        from armid_ros.report.inspection_report import inspection_report

        write_file(Path(path), inspection_report(self.core))
        return Path(path)

    def save(self, folder: str | Path) -> Path:
        """Write inspection.json and inspection.html."""
        with staged(Path(folder)) as result:
            text = json_text(self.document(), indent=1)
            write_file(result.folder / 'inspection.json', text)
            self.report(result.folder / 'inspection.html')
            result.keep()
        return result.out

    def summary(self) -> Summary:
        """Return the joints, and the worst of what was remarked."""
        from armid_ros.report.notation import plain
        from armid_ros.report.sections.inspection import joint_heads, joint_rows

        sampling = self.core.sampling
        return Summary(
            f'{self.core.recording.source}: {sampling.duration:.1f} s at '
            f'{plain(sampling.rate_hz, 4)} Hz. {self.core.verdict}',
            heads=_without_detail(joint_heads(self.core)),
            rows=[_without_detail(row) for row in joint_rows(self.core)],
            lines=self.remarks,
        )


def _without_detail(row: tuple[str, ...]) -> tuple[str, ...]:
    """Leave out speed, share of motion and steps of the encoder."""
    return row[:3] + row[6:]


def inspect(
    recording: RecordingLike, robot: RobotLike | None = None, *, rng: Rng = 0
) -> InspectionResult:
    """
    Look at a recording: rate, gaps, ranges, units that look wrong, whether identify takes it.

    Parameters
    ----------
    recording : Recording or path
        A bag or a table.
    robot : model, robot, name or path, optional
        With it limits and units are checked, and an identification is tried.
    rng : int or Generator
        Seed, or source of randomness.

    Returns
    -------
    InspectionResult
        Prints as a table; ``remarks``, ``report``.

    Raises
    ------
    ArmidError
        The file or the description cannot be read; the message names it and what to do.

    Examples
    --------
    >>> import armid_ros as ar
    >>> ar.inspect('monday', 'my_arm.urdf').remarks
    ()

    """
    described = None if robot is None else robot_of(robot)
    topics: tuple[TopicContent, ...] = ()
    if described is not None:
        (read,) = recordings_of(recording, described)
    elif isinstance(recording, Recording):
        read = recording
    else:
        path = Path(recording)
        if is_table(path):
            read = measured(plan(open_table(path), ColumnSettings()))
        else:
            topics = () if is_ros1(path) else bag_contents(path)
            most = max(topics, key=lambda one: (len(one.joints) > 0, one.count))
            read = read_anything(path, joints=most.joints, topic=most.name)
    return InspectionResult(look(read, described, topics=topics, rng=generator(rng)))
