# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Settings for reading bags: checks and memory limit."""

from __future__ import annotations

from dataclasses import dataclass, field

from armid_ros.errors import RecordingError
from armid_ros.files import default_memory_limit, size_text


@dataclass(frozen=True)
class ReadSettings:
    """
    Settings for reading a bag.

    Attributes
    ----------
    check_crc : bool
        Whether checksums are compared and damaged parts are skipped. Reading takes about a tenth
        longer.
    memory_limit : int
        Memory limit for the messages of one bag, one chunk, or one unpacked file [bytes]; by
        default a quarter of the memory.

    """

    check_crc: bool = True
    memory_limit: int = field(default_factory=default_memory_limit)

    def __post_init__(self) -> None:
        """Check the limit."""
        if self.memory_limit <= 0:
            raise RecordingError(f'memory_limit has to be positive, not {self.memory_limit}')

    def require(self, size: int, what: str) -> None:
        """
        Raise a RecordingError if an object exceeds the memory limit.

        Parameters
        ----------
        size : int
            Size of the object [bytes].
        what : str
            Name of the object, the beginning of the error message.

        Raises
        ------
        RecordingError
            If the size exceeds the limit.

        """
        if size > self.memory_limit:
            raise RecordingError(
                f'{what} takes {size_text(size)}, more than the memory_limit of '
                f'{size_text(self.memory_limit)}; raise it if the file is to be trusted'
            )


DEFAULT = ReadSettings()
