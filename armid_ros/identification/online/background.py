# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Background computations in small pieces, between the samples of a stream.

A stream must not wait. Computations that take longer than one sample are therefore generators,
which yield after every piece of bounded size. With each sample, a few pieces run. Their order
depends on the samples alone. The results therefore do not depend on the speed of the computer.

"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator
from typing import TypeVar

Result = TypeVar('Result')

#: A background job without a result: a generator that yields after every piece of work.
Job = Generator[None, None, None]
#: A background job that returns a result.
Pieces = Generator[None, None, Result]


def at_once(work: Pieces[Result]) -> Result:
    """Run all pieces of a job; return its result."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            result: Result = end.value
            return result


class Background:
    """Queue of jobs that run in pieces: an urgent one first, otherwise in order."""

    def __init__(self) -> None:
        self._jobs: deque[Job] = deque()

    def begin(self, job: Job, *, urgent: bool = False) -> None:
        """Add a job."""
        if urgent:
            self._jobs.appendleft(job)
        else:
            self._jobs.append(job)

    @property
    def busy(self) -> bool:
        """Whether any job is pending."""
        return bool(self._jobs)

    def advance(self, pieces: int = 1) -> None:
        """Run up to a number of pieces."""
        for _ in range(pieces):
            if not self._jobs:
                return
            job = self._jobs.popleft()  # failed jobs are not repeated
            try:
                next(job)
            except StopIteration:
                continue
            self._jobs.appendleft(job)

    def finish(self) -> None:
        """Finish all jobs."""
        while self.busy:
            self.advance()

    def clear(self) -> None:
        """Drop all jobs that are pending."""
        for job in self._jobs:
            job.close()
        self._jobs.clear()
