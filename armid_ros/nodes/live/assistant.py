# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Diagnoses in a separate process, so that joint states at 1 kHz are not delayed.

Jobs are sent to the process and results returned through a pair of sockets. The process ends when
the other end is closed, so that it never outlives its parent.

"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
import os
from pathlib import Path
import subprocess
import sys
import traceback
from typing import ClassVar

from armid_ros.api.diagnosis import DiagnosisResult
from armid_ros.diagnosis import Diagnosis, next_run
from armid_ros.errors import ArmidError, IdentificationError
from armid_ros.excitation.schedule import excitation_text
from armid_ros.nodes.live.request import Answer, answer, DiagnosisRequest
import numpy as np

#: One linear algebra thread, as matrices are small and other processes need the cores.
_ONE_THREAD = dict.fromkeys(('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'), '1')


@dataclass(frozen=True)
class Save:
    """
    Write the last diagnosis to a folder.

    Attributes
    ----------
    folder : Path
        Folder for `FILES`.

    """

    FILES: ClassVar[tuple[str, ...]] = ('diagnosis.json', 'model.yaml', 'report.html')

    folder: Path


@dataclass(frozen=True)
class Plan:
    """Plan the motion that separates the candidates of the last diagnosis."""

    seed: int = 0


@dataclass(frozen=True)
class Done:
    """
    Result of a job that is no diagnosis.

    Attributes
    ----------
    text : str
        Result, or the reason of the failure.
    success : bool
        Whether the job succeeded.
    excitation : str
        Planned motion as YAML; empty if none was planned.

    """

    text: str
    success: bool = True
    excitation: str = ''


Job = DiagnosisRequest | Save | Plan
Result = Answer | Done


class Worker:
    """Runs jobs, and keeps the last diagnosis for later jobs."""

    def __init__(self) -> None:
        self._last: tuple[DiagnosisRequest, Diagnosis] | None = None

    def run(self, job: Job) -> Result:
        """Run a job; an error of the data or the disk gives a result without success."""
        try:
            if isinstance(job, DiagnosisRequest):
                found, diagnosis = answer(job)
                if diagnosis is not None:
                    self._last = job, diagnosis
                return found
            if self._last is None:
                raise IdentificationError('nothing has been diagnosed so far')
            request, diagnosis = self._last
            if isinstance(job, Save):
                result = DiagnosisResult(diagnosis, request.arm, (request.window,), ())
                return Done(f'wrote {", ".join(Save.FILES)} to {result.save(job.folder)}')
            run = next_run(diagnosis, np.random.default_rng(job.seed))
            if run is None:
                return Done('no candidates are ambiguous: no motion is needed', success=False)
            return Done(run.sentence, excitation=excitation_text(run.excitation))
        except ArmidError as error:
            return Done(str(error), success=False)
        except OSError as error:
            text = f'{error.filename}: cannot be written: {error.strerror}'
            return Done(text, success=False)


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
        """Return whether a job is under way."""
        return self._pending > 0

    def ask(self, job: Job) -> None:
        """
        Send a job, which runs after the pending jobs; start a new process if the old one ended.

        A diagnosis request is larger than the buffer of the pipe, and would have to wait for the
        pending jobs; send it when none is pending.

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
            self._pipe.send(job)
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
            return Done(f'the process that diagnoses has ended with {code}', success=False)
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
    """Run jobs from a socket until its other end is closed."""
    os.nice(10)  # lower priority than the nodes
    worker = Worker()
    with suppress(EOFError, OSError), Connection(fd) as pipe:
        while True:
            job = pipe.recv()
            try:
                result = worker.run(job)
            except (
                Exception
            ) as error:  # an unexpected error of one window must not end the process
                traceback.print_exc()
                what = f'{type(job).__name__.lower()} failed: {type(error).__name__}: {error}'
                result = Done(what, success=False)
            pipe.send(result)
