# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How bags are read: what is checked, and how much memory they may take."""

from __future__ import annotations

from dataclasses import dataclass, field

from armid_ros.errors import RecordingError
from armid_ros.files import default_memory_limit, size_text


@dataclass(frozen=True)
class ReadSettings:
    """
    How a bag is read.

    Attributes
    ----------
    check_crc : bool
        Whether checksums are compared, and what is damaged is left out. Reading takes about a
        tenth longer than without.
    memory_limit : int
        What the messages of one bag, one chunk or one file that has to be unpacked may take
        [bytes]; by default a quarter of the memory.

    """

    check_crc: bool = True
    memory_limit: int = field(default_factory=default_memory_limit)

    def __post_init__(self) -> None:
        """Check the limit."""
        if self.memory_limit <= 0:
            raise RecordingError(f'memory_limit has to be positive, not {self.memory_limit}')

    def require(self, size: int, what: str) -> None:
        """
        Refuse what takes more memory than allowed.

        Parameters
        ----------
        size : int
            What it takes [bytes].
        what : str
            What it is, to begin the message with.

        Raises
        ------
        RecordingError
            It takes more than the limit.

        """
        if size > self.memory_limit:
            raise RecordingError(
                f'{what} takes {size_text(size)}, more than the memory_limit of '
                f'{size_text(self.memory_limit)}; raise it if the file is to be trusted'
            )


DEFAULT = ReadSettings()
