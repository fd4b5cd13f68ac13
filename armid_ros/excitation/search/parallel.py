# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Several searches at a time, each in a process of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
import multiprocessing
from multiprocessing.connection import Connection, wait
import os
import pickle
import signal
import sys
import threading
from types import ModuleType

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.problem import DesignProblem
from armid_ros.excitation.search.local import Found, search, Stopped
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

#: How often the time budget is looked at while the processes are silent [s].
_PATIENCE = 0.2


@dataclass(frozen=True)
class Task:
    """Everything one search needs, apart from its randomness."""

    problem: DesignProblem
    clearance: ClearanceModel | None
    prior: FloatArray | None


@dataclass(frozen=True)
class Outcome:
    """
    The best of several searches.

    Attributes
    ----------
    found : Found
        The trajectory.
    stopped : str
        Why the searches did not end by themselves: 'time budget', 'interrupted', or ''.

    """

    found: Found
    stopped: str


#: Told the share of the work done and the best so far.
Watch = Callable[[float, Found], None]


def search_all(
    task: Task, rngs: Sequence[np.random.Generator], watch: Watch, clock: Callable[[], float]
) -> Outcome:
    """
    Run one search per generator and return the best trajectory of all.

    The result does not depend on which search ends first: the lowest cost wins, and the first
    generator among equals. KeyboardInterrupt ends them all; the best so far is kept.

    Parameters
    ----------
    task : Task
        What to search for.
    rngs : sequence of Generator
        One per search.
    watch : callable
        Told how far they are.
    clock : callable
        Time [s], for the time budget.

    Raises
    ------
    TrajectoryError
        If no search finds anything feasible.
    ChildProcessError
        If a process dies.
    KeyboardInterrupt
        If interrupted before anything was found.

    """
    board = _Board(len(rngs), watch)
    deadline = clock() + task.problem.settings.time_budget
    processes = min(task.problem.settings.processes, len(rngs))
    try:
        if processes == 1 or not _portable(task):
            stopped = _here(task, rngs, board, deadline, clock)
        else:
            stopped = _in_processes(task, rngs, board, deadline, clock, processes)
    except KeyboardInterrupt:
        if board.best is None:
            raise
        stopped = INTERRUPTED
    if board.best is None:
        budget = task.problem.settings.time_budget
        raise TrajectoryError(f'nothing was found within the time budget of {budget:g} s')
    return Outcome(board.best, stopped)


class _Board:
    """What every search has found so far."""

    def __init__(self, count: int, watch: Watch) -> None:
        self._found: list[Found | None] = [None] * count
        self._done = [0.0] * count
        self._watch = watch

    @property
    def best(self) -> Found | None:
        found = [f for f in self._found if f is not None]
        return min(found, key=lambda f: f.cost) if found else None

    def note(self, number: int, done: float, found: Found) -> None:
        self._found[number], self._done[number] = found, done
        best = self.best
        assert best is not None
        self._watch(sum(self._done) / len(self._done), best)


def _here(
    task: Task,
    rngs: Sequence[np.random.Generator],
    board: _Board,
    deadline: float,
    clock: Callable[[], float],
) -> str:
    for number, rng in enumerate(rngs):

        def report(
            done: float, cost: float, trajectory: FourierTrajectory, n: int = number
        ) -> None:
            board.note(n, done, Found(trajectory, cost))
            if clock() > deadline:
                raise Stopped

        search(task.problem, task.clearance, task.prior, rng, report)
        if clock() > deadline:
            return OUT_OF_TIME
    return ''


def _in_processes(
    task: Task,
    rngs: Sequence[np.random.Generator],
    board: _Board,
    deadline: float,
    clock: Callable[[], float],
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
            for connection in wait(list(running), timeout=_PATIENCE):
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
            if clock() > deadline:
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

    def report(done: float, cost: float, trajectory: FourierTrajectory) -> None:
        connection.send((done, Found(trajectory, cost)))

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
    ours = threading.current_thread() is threading.main_thread()
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN) if ours else None
    try:
        yield
    finally:
        if handler is not None:
            signal.signal(signal.SIGINT, handler)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
