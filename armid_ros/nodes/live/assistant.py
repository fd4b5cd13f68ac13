# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Diagnoses in a separate process, so that joint states at 1 kHz are not delayed.

A pair of sockets sends tasks to the process and returns results. The process ends when the other
end is closed, so it never outlives its parent.

"""

from __future__ import annotations

from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
import os
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
#: A diagnosis; or the text of another task, with its planned motion as YAML if any; or an error.
Result = Answer | tuple[str, str] | IdentificationError


class Worker:
    """Execute tasks in the diagnosis process, and store the last diagnosis."""

    def __init__(self) -> None:
        self._last: tuple[DiagnosisRequest, Diagnosis] | None = None

    def run(self, task: str, argument: Any) -> Result:
        """
        Diagnose, save the last diagnosis, or plan a motion that separates its candidates.

        Errors of the data or the disk are returned, not raised. `argument` is that of
        `Assistant.ask`.

        """
        try:
            if task == 'diagnose':
                found, diagnosis = answer(argument)
                if diagnosis is not None:
                    self._last = argument, diagnosis
                return found
            if self._last is None:
                raise IdentificationError('no diagnosis is complete so far; keep the arm moving')
            request, diagnosis = self._last
            if task == 'save':
                result = DiagnosisResult(diagnosis, request.arm, (request.window,), ())
                return f'wrote {", ".join(FILES)} to {result.save(argument)}', ''
            run = next_run(diagnosis, np.random.default_rng(argument))
            if run is None:
                raise IdentificationError(
                    'the last diagnosis is not ambiguous, so no motion is needed'
                )
            return run.sentence, excitation_text(run.excitation)
        except ArmidError as error:
            return IdentificationError(str(error))
        except OSError as error:
            return IdentificationError(f'{error.filename} cannot be written: {error.strerror}')


class Assistant:
    """
    Connection to a separate process that computes diagnoses.

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
        """Whether the process still has tasks to complete."""
        return self._pending > 0

    def ask(self, task: str, argument: Any) -> None:
        """
        Send a task to the process, which executes tasks in the order of arrival.

        A new process is started if the last process has ended. A diagnosis request is larger than
        the buffer of the socket; send it only without pending tasks, as it would wait for them.

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
        """Return the next result of the process; None if no result has arrived."""
        if self._pipe.closed or not self._pipe.poll():
            return None
        self._pending -= 1
        try:
            result: Result = self._pipe.recv()
        except (EOFError, OSError):  # the process ended, possibly during the transfer
            self._pending = 0
            self._pipe.close()
            code = self._process.wait()
            return IdentificationError(f'the diagnosis process has ended with exit code {code}')
        return result

    def close(self) -> None:
        """End the process immediately."""
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
    """Run the tasks that arrive on a socket, until its other end closes."""
    os.nice(10)  # lower priority than the nodes
    worker = Worker()
    with suppress(EOFError, OSError), Connection(fd) as pipe:
        while True:
            task, argument = pipe.recv()
            try:
                result = worker.run(task, argument)
            except Exception as error:  # of one window, which must not end the process
                traceback.print_exc()
                text = f'{task} failed: {type(error).__name__}: {error}'
                result = IdentificationError(text)
            pipe.send(result)
