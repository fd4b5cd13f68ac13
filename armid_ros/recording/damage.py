# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with a file, in the order it was found."""

from __future__ import annotations

#: Problems said one by one; a file that is damaged all over is not described byte by byte.
_SAID = 8


class Damage:
    """A list of what is wrong; the same is said once."""

    def __init__(self) -> None:
        self._problems: dict[str, None] = {}

    def __bool__(self) -> bool:
        """Return whether something is wrong."""
        return bool(self._problems)

    def __str__(self) -> str:
        """Return what is wrong; empty when nothing is."""
        said = list(self._problems)[:_SAID]
        more = len(self._problems) - len(said)
        return '; '.join([*said, *([f'and {more} more'] if more else [])])

    def add(self, problem: str) -> None:
        """Note a problem."""
        self._problems[problem] = None
