# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Log each kind of unusable input once, and count every occurrence."""

from __future__ import annotations

from collections import Counter
import traceback

from armid_ros.errors import RecordingEnded
from rclpy.impl.rcutils_logger import RcutilsLogger

#: Errors that end a node, such as a full disk during recording.
FATAL = (OSError, MemoryError, RecordingEnded)


class Complaints:
    """
    Counts and log messages of the inputs that a node rejected, by kind.

    Attributes
    ----------
    counts : Counter of str
        Number of rejections of each kind.
    latest : str
        Text of the last complaint; empty before the first one.
    fresh : bool
        Whether an input was rejected since the last `settle`.
    defects : int
        Number of rejections by unexpected exceptions.

    """

    def __init__(self, logger: RcutilsLogger) -> None:
        """Log complaints with the logger of a node."""
        self._logger = logger
        self.counts: Counter[str] = Counter()
        self._logged: dict[str, set[str]] = {}
        self.latest = ''
        self.fresh = False
        self.defects = 0

    def say(self, kind: str, text: str) -> None:
        """Count a rejected input, and log the text unless it was logged before."""
        self.counts[kind] += 1
        self.latest = text
        self.fresh = True
        logged = self._logged.setdefault(kind, set())
        if text not in logged and len(logged) < 10:  # limits the size of the log
            logged.add(text)
            self._logger.warning(text)

    def has_logged(self, text: str) -> bool:
        """Return whether a text was logged."""
        return any(text in logged for logged in self._logged.values())

    def defect(self, kind: str, error: Exception) -> None:
        """Count and log an input that caused an unexpected exception."""
        self.defects += 1
        self.say(kind, f'{kind}: skipped, as it cannot be used ({type(error).__name__}: {error})')
        self._logger.debug(''.join(traceback.format_exception(error)))

    def settle(self) -> None:
        """Begin a new reporting period, with `fresh` reset."""
        self.fresh = False
