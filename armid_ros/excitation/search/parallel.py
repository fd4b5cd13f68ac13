# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Several searches at a time, each in a process of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
import multiprocessing
from multiprocessing.connection import Connection, wait
import os
import pickle
import signal
import sys
import time
from types import ModuleType

from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.problem import DesignProblem
from armid_ros.excitation.search.local import Found, search, Stopped, Watch
from armid_ros.motion import FloatArray
import numpy as np

#: One thread of linear algebra per process, as the matrices are small; and no module of the
#: current folder in place of an installed one.
_OF_CHILDREN = (
    'OMP_NUM_THREADS',
    'OPENBLAS_NUM_THREADS',
    'MKL_NUM_THREADS',
    'PYTHONSAFEPATH',
)

#: Why searches did not end by themselves.
INTERRUPTED, OUT_OF_TIME = 'interrupted', 'time budget'


@dataclass(frozen=True)
class Task:
    """Everything one search needs, apart from its randomness."""

    problem: DesignProblem
    clearance: ClearanceModel | None
    prior: FloatArray | None


def search_all(task: Task, rngs: Sequence[np.random.Generator], watch: Watch) -> tuple[Found, str]:
    """
    Run one search per generator and return the best trajectory of all.

    The result does not depend on which search ends first: the lowest cost wins, and the first
    generator among equals. KeyboardInterrupt ends them all, and so does the time budget, once
    something is found; the best so far is kept.

    Parameters
    ----------
    task : Task
        What to search for.
    rngs : sequence of Generator
        One per search.
    watch : callable
        Receives the share of the work that is done, and the best so far.

    Returns
    -------
    found : Found
        The best of all.
    stopped : str
        Why the searches did not end by themselves: 'time budget', 'interrupted', or ''.

    Raises
    ------
    TrajectoryError
        If no search finds anything feasible.
    ChildProcessError
        If a process dies.
    KeyboardInterrupt
        If interrupted before anything was found.

    """
    processes = min(task.problem.settings.processes, len(rngs))
    board = _Board(len(rngs), task.problem.settings.time_budget * processes, watch)
    try:
        if processes == 1 or not _portable(task):
            stopped = _here(task, rngs, board)
        else:
            stopped = _in_processes(task, rngs, board, processes)
    except KeyboardInterrupt:
        if board.best is None:
            raise
        stopped = INTERRUPTED
    assert board.best is not None
    return board.best, stopped


class _Board:
    """What every search has found so far."""

    def __init__(self, count: int, budget: float, watch: Watch) -> None:
        self._found: list[Found | None] = [None] * count
        self._done, self._used = [0.0] * count, [0.0] * count
        self._budget, self._watch = budget, watch

    @property
    def best(self) -> Found | None:
        found = [f for f in self._found if f is not None]
        return min(found, key=lambda f: f.cost) if found else None

    @property
    def out_of_time(self) -> bool:
        """Whether the searches have used their processor time."""
        return sum(self._used) > self._budget

    def note(self, number: int, done: float, found: Found, used: float) -> None:
        self._found[number], self._done[number], self._used[number] = found, done, used
        best = self.best
        assert best is not None
        self._watch(sum(self._done) / len(self._done), best)


def _here(task: Task, rngs: Sequence[np.random.Generator], board: _Board) -> str:
    for number, rng in enumerate(rngs):
        begun = time.process_time()

        def report(done: float, found: Found, n: int = number, begun: float = begun) -> None:
            board.note(n, done, found, time.process_time() - begun)
            if board.out_of_time:
                raise Stopped

        search(task.problem, task.clearance, task.prior, rng, report)
        if board.out_of_time:
            return OUT_OF_TIME
    return ''


def _in_processes(
    task: Task,
    rngs: Sequence[np.random.Generator],
    board: _Board,
    processes: int,
) -> str:
    context = multiprocessing.get_context('spawn')
    waiting = list(enumerate(rngs))[::-1]
    running: dict[Connection, tuple[int, multiprocessing.process.BaseProcess]] = {}
    try:
        while waiting or running:
            while waiting and len(running) < processes:
                number, rng = waiting.pop()
                ours, theirs = context.Pipe(duplex=False)
                process = context.Process(target=_work, args=(task, rng, theirs), daemon=True)
                with _undisturbed_children(), _nameless_main():
                    process.start()
                theirs.close()
                running[ours] = (number, process)
            for connection in wait(list(running)):
                assert isinstance(connection, Connection)
                number, worker = running[connection]
                try:
                    message = connection.recv()
                except EOFError:
                    worker.join()
                    del running[connection]
                    connection.close()
                    if worker.exitcode:
                        raise ChildProcessError(
                            f'search {number + 1} ended with code {worker.exitcode}, unfinished'
                        ) from None
                    continue
                if isinstance(message, Exception):
                    raise message
                board.note(number, *message)
            if board.out_of_time:
                return OUT_OF_TIME
        return ''
    finally:
        for connection, (_, worker) in running.items():
            worker.terminate()
            worker.join()
            connection.close()


def _work(task: Task, rng: np.random.Generator, connection: Connection) -> None:
    """Search, in a process of its own, and send what is found."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    begun = time.process_time()

    def report(done: float, found: Found) -> None:
        connection.send((done, found, time.process_time() - begun))

    try:
        search(task.problem, task.clearance, task.prior, rng, report)
    except Exception as error:
        connection.send(error)
    finally:
        connection.close()


def _portable(task: Task) -> bool:
    """Whether a task can go to a process that does not know the script that runs."""
    with _nameless_main():
        try:
            pickle.dumps(task)
        except (pickle.PicklingError, AttributeError, TypeError):
            return False
    return True


@contextmanager
def _nameless_main() -> Iterator[None]:
    """
    Hide the script that runs from processes that start in the meantime.

    They would run it again, which a script that is not written for it does not survive.

    """
    script = sys.modules['__main__']
    sys.modules['__main__'] = ModuleType('__main__')
    try:
        yield
    finally:
        sys.modules['__main__'] = script


@contextmanager
def _undisturbed_children() -> Iterator[None]:
    """Have processes that start in the meantime find `_OF_CHILDREN`, and leave Ctrl-C to us."""
    before = {name: os.environ.get(name) for name in _OF_CHILDREN}
    os.environ.update(dict.fromkeys(_OF_CHILDREN, '1'))
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # it waits until then
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
