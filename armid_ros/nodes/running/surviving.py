# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Callbacks that no message ends: what cannot be used is counted, said once, and left out."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

from armid_ros.errors import ArmidError, RecordingEnded
from armid_ros.nodes.complaints import Complaints

#: What is no matter of a message: a disk that is full ends a recorder, and should.
FATAL = (OSError, MemoryError, RecordingEnded)


def surviving(
    callback: Callable[..., Any],
    what: str,
    complaints: Callable[[], Complaints],
    running: Callable[[], bool],
) -> Callable[..., Any]:
    """
    Return a callback that complains where another one would raise.

    Parameters
    ----------
    callback : callable
        Of a subscription or a timer.
    what : str
        What calls it, such as a topic.
    complaints : callable
        Returns where to complain.
    running : callable
        Returns whether ROS runs; while it shuts down exceptions are its way to say so.

    """

    @wraps(callback)
    def survive(*args: Any) -> Any:
        try:
            return callback(*args)
        except FATAL:
            raise
        except ArmidError as error:
            complaints().say(what, f'{what}: {error}')
        except Exception as error:
            if not running():
                raise
            complaints().defect(what, error)
        return None

    return survive
