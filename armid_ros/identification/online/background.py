# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Background computations in small pieces, between the samples of a stream.

A sample of the stream must not wait. Computations that take longer than one sample are therefore
generators, which yield after every piece of bounded size. With each sample, a few pieces run.
Their order depends on the samples alone, so results do not depend on the speed of the computer.

"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator
from typing import TypeVar

Result = TypeVar('Result')

#: Background computation without a result: a generator that yields after every piece of work.
Job = Generator[None, None, None]
#: Background computation that returns a result.
Pieces = Generator[None, None, Result]


def at_once(work: Pieces[Result]) -> Result:
    """Run a background computation to its end without pauses; return its result."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            result: Result = end.value
            return result


class Background:
    """Queue of computations that run in short pieces between the samples of a stream."""

    def __init__(self) -> None:
        self._jobs: deque[Job] = deque()

    def begin(self, job: Job, *, urgent: bool = False) -> None:
        """Add a computation at the end of the queue, or at the front of the queue if urgent."""
        if urgent:
            self._jobs.appendleft(job)
        else:
            self._jobs.append(job)

    @property
    def busy(self) -> bool:
        """Whether any computation is pending."""
        return bool(self._jobs)

    def advance(self, pieces: int = 1) -> None:
        """Run at most `pieces` pieces of the pending computations."""
        for _ in range(pieces):
            if not self._jobs:
                return
            job = self._jobs.popleft()  # a failed computation is not repeated
            try:
                next(job)
            except StopIteration:
                continue
            self._jobs.appendleft(job)

    def finish(self) -> None:
        """Run all pending computations to their end."""
        while self.busy:
            self.advance()
