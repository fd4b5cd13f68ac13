# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Makes a recording whole whose writer was killed."""

from __future__ import annotations

from dataclasses import dataclass
import os
from pathlib import Path

from armid_ros.errors import RecordingError
from armid_ros.files import reading
from armid_ros.recording.mcap.source import McapSource
from armid_ros.recording.settings import DEFAULT, ReadSettings
from armid_ros.recording.source import Topic
from armid_ros.recording.writer import whole_bag


@dataclass(frozen=True)
class RecoveryReport:
    """
    What was recovered.

    Attributes
    ----------
    source : Path
        The damaged file, which is as it was.
    bag : Path
        The bag made of it.
    topics : tuple of Topic
        Its topics, with the number of messages saved.
    damage : str
        What was wrong with the file; empty for a whole one.
    duration : float
        Time from the first to the last message [s].

    """

    source: Path
    bag: Path
    topics: tuple[Topic, ...]
    damage: str
    duration: float

    @property
    def messages(self) -> int:
        """Return the number of messages saved."""
        return sum(topic.count for topic in self.topics)

    def describe(self) -> str:
        """Return the report as a few sentences."""
        listed = ', '.join(f'{topic.name} ({topic.count})' for topic in self.topics)
        return (
            f'{self.source}: {self.damage or "the file is whole"}. {self.messages} messages over '
            f'{self.duration:.3f} s are in {self.bag}: {listed}.'
        )


def recover(file: str | Path, out: str | Path, settings: ReadSettings = DEFAULT) -> RecoveryReport:
    """
    Copy what can be read of an MCAP file into a complete bag, with index and metadata.yaml.

    Complete chunks are taken over when their checksum is right; of a chunk the file ends in, the
    messages before the end are.

    Parameters
    ----------
    file : str or Path
        The file, which is not changed; a directory with a single .mcap file stands for that.
    out : str or Path
        The bag directory to be made; it must not exist.
    settings : ReadSettings
        Whether checksums are compared, and how much memory to take.

    Returns
    -------
    RecoveryReport
        What was saved.

    Raises
    ------
    RecordingError
        It is no MCAP file, or there is no message in it, or ``out`` exists.

    """
    path = _only_file(Path(file))
    with reading(path, RecordingError):
        return _copied(path, out, settings)


def _copied(path: Path, out: str | Path, settings: ReadSettings) -> RecoveryReport:
    """Copy what can be read of a file."""
    source = McapSource(path, settings)
    try:
        if next(source.messages(), None) is None:
            raise RecordingError(
                f'{path}: there is no message to recover; {source.damage or "the file is whole"}'
            )
        with whole_bag(out) as writer:
            writer.copy(source)
        damage = source.damage
    finally:
        source.close()
    start, end = writer.time_range
    return RecoveryReport(path, writer.path, writer.topics, damage, (end - start) * 1e-9)


def _only_file(path: Path) -> Path:
    """Return the file meant."""
    if not path.is_dir():
        if not os.path.lexists(path):
            raise RecordingError(f'{path}: there is no such file')
        return path
    files = sorted(path.glob('*.mcap'))
    if len(files) != 1:
        listed = ', '.join(file.name for file in files) or 'none'
        raise RecordingError(
            f'{path}: a directory stands for its only .mcap file, but it has {listed}; '
            'recover files one by one'
        )
    return files[0]
