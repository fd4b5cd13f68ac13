# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The property of every reader: an error of the package, or an answer that can be believed."""

from collections import Counter
from contextlib import contextmanager, suppress
from pathlib import Path
import resource
import signal

from armid_ros.errors import ArmidError
import pytest

#: Processor time [s] and memory [bytes] that one mutant may take.
TIME_LIMIT = 20
MEMORY_LIMIT = 1 << 30

#: What became of the mutants, by kind.
TALLY: dict[str, Counter[str]] = {}


class TooLong(BaseException):
    """A mutant takes more processor time than allowed."""


@contextmanager
def bounded(kind):
    """Limit the processor time of a mutant, and what it adds to the memory of the process."""
    # The kernel forgets the peak of the mutants before, below which this one would hide.
    with suppress(OSError):
        Path('/proc/self/clear_refs').write_text('5')
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    def end(*_):
        TALLY[kind]['too long'] += 1
        raise TooLong(f'{TIME_LIMIT} s of processor time')

    old = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, TIME_LIMIT)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, old)
    grown = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    if grown > MEMORY_LIMIT:
        TALLY[kind]['too much memory'] += 1
        pytest.fail(f'a mutant took {grown >> 20} MiB')


def judge(kind, read, path, whole, agrees):
    """
    Read a mutant, and fail unless it is refused with its name or gives a right answer.

    Parameters
    ----------
    kind : str
        Of file, for the tally.
    read : callable
        Takes the path and returns an answer.
    path : Path
        The mutant.
    whole : object
        The answer of the undamaged file.
    agrees : callable
        Takes an answer and that of the undamaged file; returns 'same', 'said' or what is wrong.

    """
    counts = TALLY.setdefault(kind, Counter())
    counts['mutants'] += 1
    with bounded(kind):
        try:
            answer = read(path)
        except ArmidError as refusal:
            counts['refused'] += 1
            text = str(refusal)
            assert path.name in text, f'no name of the file in: {text}'
            assert '\n' not in text.strip() or len(text) < 5000
            return
        except Exception:
            counts['other exception'] += 1
            raise
    verdict = agrees(answer, whole)
    counts[verdict if verdict in ('same', 'said', 'other') else 'SILENT'] += 1
    assert verdict in ('same', 'said', 'other'), verdict
