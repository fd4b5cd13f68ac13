# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Count unusable inputs of a node, and log each message about them once."""

from __future__ import annotations

from collections import Counter
import traceback

from armid_ros.errors import RecordingEnded
from rclpy.impl.rcutils_logger import RcutilsLogger

#: Errors that end a node, such as a full disk during recording.
FATAL = (OSError, MemoryError, RecordingEnded)


class Complaints:
    """
    Counts of the inputs that a node rejected, by kind, and the logged messages.

    Attributes
    ----------
    counts : Counter of str
        Number of rejections of each kind.
    latest : str
        Message about the last rejected input; empty before the first one.
    fresh : bool
        Whether an input was rejected since the last diagnostics.
    defects : int
        Number of rejections by unexpected exceptions.

    """

    def __init__(self, logger: RcutilsLogger) -> None:
        """Use the logger of a node for messages on rejected inputs."""
        self._logger = logger
        self.counts: Counter[str] = Counter()
        self._logged: dict[str, set[str]] = {}
        self.latest = ''
        self.fresh = False
        self.defects = 0

    def add(self, kind: str, text: str) -> None:
        """Count a rejected input; log the message unless it was logged before."""
        self.counts[kind] += 1
        self.latest = text
        self.fresh = True
        logged = self._logged.setdefault(kind, set())
        if text not in logged and len(logged) < 10:  # limits the size of the log
            logged.add(text)
            self._logger.warning(text)

    def has_logged(self, text: str) -> bool:
        """Return whether the message `text` on a rejected input was logged before."""
        return any(text in logged for logged in self._logged.values())

    def add_exception(self, kind: str, error: Exception) -> None:
        """Count an input that raised an unexpected exception, and log the exception."""
        self.defects += 1
        self.add(kind, f'{kind}: skipped, as it cannot be used ({type(error).__name__}: {error})')
        self._logger.debug(''.join(traceback.format_exception(error)))
