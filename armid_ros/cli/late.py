# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Work that is imported when a command is run: its help, and completion, do not wait for it."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from importlib import import_module
from typing import Any


def done_by(module: str) -> Callable[[Callable[[], None]], Callable[..., Any]]:
    """
    Let a command be done by the function of its name in another module.

    It stands below the options, next to the function, which has the help and no body.

    Parameters
    ----------
    module : str
        Below `armid_ros.cli`, or of a plug-in, by its full name; imported when the command is run.

    """

    def decorate(command: Callable[[], None]) -> Callable[..., Any]:
        home = module if module.startswith('armid_ros.') else f'armid_ros.cli.{module}'

        def work() -> Callable[..., Any]:
            found: Callable[..., Any] = getattr(import_module(home), command.__name__)
            return found

        @wraps(command)
        def call(**values: Any) -> Any:
            return work()(**values)

        call.work = work  # type: ignore[attr-defined]
        return call

    return decorate
