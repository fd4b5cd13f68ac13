# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Diagnoses in a separate process, so that joint states at 1 kHz are not delayed.

Tasks are sent to the process and results returned through a pair of sockets. The process ends when
the other end is closed, so that it never outlives its parent.

"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
import os
from pathlib import Path
import subprocess
import sys
import traceback
from typing import Any

from armid_ros.api.diagnosis import DiagnosisResult
from armid_ros.diagnosis import Diagnosis, next_run
from armid_ros.errors import ArmidError, IdentificationError
from armid_ros.excitation.schedule import excitation_text
from armid_ros.nodes.live.request import Answer, answer, DiagnosisRequest
import numpy as np

#: One linear algebra thread, as matrices are small and other processes need the cores.
_ONE_THREAD = dict.fromkeys(('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'), '1')


#: Files of a saved diagnosis.
FILES = ('diagnosis.json', 'model.yaml', 'report.html')
#: An answer; the text of another task, with its planned motion as YAML if any; or an error.
Result = Answer | tuple[str, str] | IdentificationError


class Worker:
    """Runs tasks, and keeps the last diagnosis for later tasks."""

    def __init__(self) -> None:
        self._last: tuple[DiagnosisRequest, Diagnosis] | None = None

    def run(self, task: str, argument: Any) -> Result:
        """Run 'diagnose', 'save' or 'plan'; errors of the data or the disk are returned."""
        tasks: dict[str, Callable[[Any], Result]] = {
            'diagnose': self._diagnose,
            'save': self._save,
            'plan': self._plan,
        }
        try:
            return tasks[task](argument)
        except ArmidError as error:
            return IdentificationError(str(error))
        except OSError as error:
            return IdentificationError(f'{error.filename}: cannot be written: {error.strerror}')

    def _diagnose(self, request: DiagnosisRequest) -> Answer:
        found, diagnosis = answer(request)
        if diagnosis is not None:
            self._last = request, diagnosis
        return found

    def _save(self, folder: Path) -> tuple[str, str]:
        """Write the last diagnosis to a folder."""
        request, diagnosis = self._require()
        result = DiagnosisResult(diagnosis, request.arm, (request.window,), ())
        return f'wrote {", ".join(FILES)} to {result.save(folder)}', ''

    def _plan(self, seed: int) -> tuple[str, str]:
        """Plan the motion that separates the candidates of the last diagnosis."""
        _, diagnosis = self._require()
        run = next_run(diagnosis, np.random.default_rng(seed))
        if run is None:
            raise IdentificationError('no candidates are ambiguous: no motion is needed')
        return run.sentence, excitation_text(run.excitation)

    def _require(self) -> tuple[DiagnosisRequest, Diagnosis]:
        if self._last is None:
            raise IdentificationError('nothing has been diagnosed so far')
        return self._last


class Assistant:
    """
    Computes diagnoses in a separate process.

    Raises
    ------
    OSError
        If the process cannot be started.

    """

    def __init__(self) -> None:
        self._pending = 0
        self._start()

    @property
    def busy(self) -> bool:
        """Return whether a task is under way."""
        return self._pending > 0

    def ask(self, task: str, argument: Any) -> None:
        """
        Send a task, which runs after the pending tasks; start a new process if the old one ended.

        A diagnosis request is larger than the buffer of the pipe, and would have to wait for the
        pending tasks; send it when none is pending.

        Parameters
        ----------
        task : str
            'diagnose', 'save' or 'plan'.
        argument : DiagnosisRequest, Path or int
            Request of the diagnosis, folder to write to, or random seed of the plan.

        Raises
        ------
        IdentificationError
            If the process has just ended.
        OSError
            If a new process cannot be started.

        """
        if not self.busy and self._process.poll() is not None:
            self.close()
            self._start()
        try:
            self._pipe.send((task, argument))
        except OSError as error:
            raise IdentificationError(f'the diagnosis process has ended: {error}') from error
        self._pending += 1

    def poll(self) -> Result | None:
        """Return the result if one has arrived; None otherwise."""
        if self._pipe.closed or not self._pipe.poll():
            return None
        self._pending -= 1
        try:
            result: Result = self._pipe.recv()
        except (EOFError, OSError):  # the process ended, possibly during the transfer
            self._pending = 0
            self._pipe.close()
            code = self._process.wait()
            return IdentificationError(f'the process that diagnoses has ended with {code}')
        return result

    def close(self) -> None:
        """Kill the process."""
        self._process.kill()
        self._process.wait()
        self._pipe.close()

    def _start(self) -> None:
        self._pipe, other = Pipe()
        with other:
            self._process = subprocess.Popen(
                [
                    sys.executable,
                    '-P',
                    '-c',
                    f'from {__name__} import main; main({other.fileno()})',
                ],
                stdin=subprocess.DEVNULL,
                stdout=2,  # standard error, for output of libraries
                pass_fds=[other.fileno()],
                env=os.environ | _ONE_THREAD,
                start_new_session=True,  # Ctrl-C must reach the parent only
            )


def main(fd: int) -> None:
    """Run tasks from a socket until its other end is closed."""
    os.nice(10)  # lower priority than the nodes
    worker = Worker()
    with suppress(EOFError, OSError), Connection(fd) as pipe:
        while True:
            task, argument = pipe.recv()
            try:
                result = worker.run(task, argument)
            except Exception as error:  # of one window, which must not end the process
                traceback.print_exc()
                what = f'{task} failed: {type(error).__name__}: {error}'
                result = IdentificationError(what)
            pipe.send(result)
