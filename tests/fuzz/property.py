# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The property of every reader: an error of the package, or an answer that can be believed."""

from contextlib import contextmanager, suppress
from pathlib import Path
import resource
import signal

from armid_ros.errors import ArmidError

#: Processor time [s] and memory [bytes] that one mutant may take.
TIME_LIMIT = 20
MEMORY_LIMIT = 1 << 30


class TooLong(BaseException):
    """A mutant takes more processor time than allowed."""


@contextmanager
def bounded():
    """Limit the processor time of a mutant, and what it adds to the memory of the process."""
    # The kernel forgets the peak of the mutants before, below which this one would hide.
    with suppress(OSError):
        Path('/proc/self/clear_refs').write_text('5')
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    def end(*_):
        raise TooLong(f'{TIME_LIMIT} s of processor time')

    old = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, TIME_LIMIT)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, old)
    grown = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    assert grown <= MEMORY_LIMIT, f'a mutant took {grown >> 20} MiB'


def judge(read, path, whole, agrees):
    """
    Read a mutant, and fail unless it is refused with its name or gives a right answer.

    Parameters
    ----------
    read : callable
        Takes the path and returns an answer.
    path : Path
        The mutant.
    whole : object
        The answer of the undamaged file.
    agrees : callable
        Takes an answer and that of the undamaged file; returns 'same', 'said', 'other' or what is
        wrong.

    """
    with bounded():
        try:
            answer = read(path)
        except ArmidError as refusal:
            text = str(refusal)
            assert path.name in text, f'no name of the file in: {text}'
            assert '\n' not in text.strip() or len(text) < 5000
            return
    verdict = agrees(answer, whole)
    assert verdict in ('same', 'said', 'other'), verdict
