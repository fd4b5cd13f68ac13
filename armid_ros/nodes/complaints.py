# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Input that cannot be used is logged once, counted always, and ends no callback."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import wraps
import traceback
from typing import Any

from armid_ros.errors import ArmidError, RecordingEnded
from rclpy.impl.rcutils_logger import RcutilsLogger

#: Different texts said of one kind; a sender of random rubbish must not fill the log.
_TEXTS_PER_KIND = 10
#: What is no matter of a message: a disk that is full ends a recorder, and should.
FATAL = (OSError, MemoryError, RecordingEnded)


class Complaints:
    """
    What a node rejected, by kind.

    Attributes
    ----------
    counts : Counter of str
        How often each kind was rejected.
    latest : str
        Text of the last complaint; empty when there was none.
    fresh : bool
        Whether something was rejected since the last `settle`.
    defects : int
        Rejections that nobody had foreseen.

    """

    def __init__(self, logger: RcutilsLogger) -> None:
        """Say things on the logger of a node, which is also /rosout."""
        self._logger = logger
        self.counts: Counter[str] = Counter()
        self._said: dict[str, set[str]] = {}
        self.latest = ''
        self.fresh = False
        self.defects = 0

    def say(self, kind: str, text: str) -> None:
        """Count a rejected input, and log it unless the same was said before."""
        self.counts[kind] += 1
        self.latest = text
        self.fresh = True
        said = self._said.setdefault(kind, set())
        if text not in said and len(said) < _TEXTS_PER_KIND:
            said.add(text)
            self._logger.warning(text)

    def has_logged(self, text: str) -> bool:
        """Whether a text is in the log."""
        return any(text in said for said in self._said.values())

    def defect(self, kind: str, error: Exception) -> None:
        """Count an input that led to an error which nobody had foreseen, and say where."""
        self.defects += 1
        self.say(kind, f'{kind}: left out, as it cannot be used ({type(error).__name__}: {error})')
        self._logger.debug(''.join(traceback.format_exception(error)))

    def settle(self) -> None:
        """Begin a new period of reporting."""
        self.fresh = False


def surviving(callback: Callable[..., Any], what: str, node: Any) -> Callable[..., Any]:
    """
    Return a callback that complains where another one would raise.

    Parameters
    ----------
    callback : callable
        Of a subscription or a timer.
    what : str
        What calls it, such as a topic.
    node : ArmidNode
        Takes the complaints; while ROS shuts down exceptions are its way to say so.

    """

    @wraps(callback)
    def survive(*args: Any) -> Any:
        try:
            return callback(*args)
        except FATAL:
            raise
        except ArmidError as error:
            node.complaints.say(what, f'{what}: {error}')
        except Exception as error:
            if not node.context.ok():
                raise
            node.complaints.defect(what, error)
        return None

    return survive
