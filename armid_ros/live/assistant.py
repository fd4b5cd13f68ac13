# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Who answers: a process of its own, so that joint states of 1 kHz never wait for a diagnosis.

The process reads jobs from its standard input and writes results to its standard output. It ends
when its input does, so it never outlives who started it, however that one ended.

"""

from __future__ import annotations

from dataclasses import dataclass
import os
from pathlib import Path
import pickle
import queue
import struct
import subprocess
import sys
import threading
import traceback
from typing import Any, ClassVar, IO

from armid_ros.api.diagnosis import DiagnosisResult
from armid_ros.diagnosis import Diagnosis, next_run
from armid_ros.errors import ArmidError, IdentificationError
from armid_ros.excitation.files import excitation_text
from armid_ros.live.request import Answer, answer, DiagnosisRequest
import numpy as np

#: One thread of linear algebra: the matrices are small, and the other cores have the arm.
_ONE_THREAD = dict.fromkeys(('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'), '1')
#: Courtesy towards the processes that must not wait.
_NICE = 10
_LENGTH = struct.Struct('<Q')


@dataclass(frozen=True)
class Save:
    """
    Write the last diagnosis to a folder.

    Attributes
    ----------
    folder : Path
        Gets `FILES`.

    """

    FILES: ClassVar[tuple[str, ...]] = ('diagnosis.json', 'model.yaml', 'report.html')

    folder: Path


@dataclass(frozen=True)
class Plan:
    """Plan the motion that separates the names of the last diagnosis."""

    seed: int = 0


@dataclass(frozen=True)
class Done:
    """
    What became of a job that is no request.

    Attributes
    ----------
    text : str
        What was done, or why not.
    success : bool
        Whether it was.
    excitation : str
        The planned motion as YAML; empty where none was.

    """

    text: str
    success: bool = True
    excitation: str = ''


Job = DiagnosisRequest | Save | Plan
Result = Answer | Done


class InProcess:
    """Answers at once, in the process that asks."""

    def __init__(self) -> None:
        self._last: tuple[DiagnosisRequest, Diagnosis] | None = None
        self._result: Result | None = None

    @property
    def busy(self) -> bool:
        """Whether a result waits to be taken."""
        return self._result is not None

    def ask(self, job: Job) -> None:
        """Do a job."""
        try:
            self._result = self._done(job)
        except ArmidError as error:
            self._result = Done(str(error), success=False)
        except OSError as error:
            text = f'{error.filename}: cannot be written: {error.strerror}'
            self._result = Done(text, success=False)

    def poll(self) -> Result | None:
        """Return the result, once."""
        result, self._result = self._result, None
        return result

    def close(self) -> None:
        """Nothing to end."""

    def _done(self, job: Job) -> Result:
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
            return Done('no name is in doubt: there is nothing to separate', success=False)
        return Done(run.sentence, excitation=excitation_text(run.excitation))


class Assistant:
    """
    Answers in a process of its own.

    Raises
    ------
    OSError
        If the process cannot be started.

    """

    def __init__(self) -> None:
        self.busy = False
        self._start()

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def ask(self, job: Job) -> None:
        """
        Begin a job, in another process where the one before has ended.

        Raises
        ------
        IdentificationError
            If another one is under way, or the process ends just now.
        OSError
            If another process cannot be started.

        """
        if self.busy:
            raise IdentificationError('a diagnosis is under way; ask again in some seconds')
        if self._process.poll() is not None:
            self.close()
            self._start()
        assert self._process.stdin is not None
        try:
            _write(self._process.stdin, job)
        except OSError as error:
            raise IdentificationError(f'the process that diagnoses has ended: {error}') from error
        self.busy = True

    def poll(self) -> Result | None:
        """Return what came, once."""
        try:
            result = self._results.get_nowait()
        except queue.Empty:
            return None
        self.busy = False
        return result

    def close(self) -> None:
        """End the process, whatever it does."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                try:
                    pipe.close()
                except OSError:  # what it was not read of any more
                    pass

    def _start(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, '-P', '-c', f'from {__name__} import main; main()'],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | _ONE_THREAD,
            start_new_session=True,  # Ctrl-C is for who started it
        )
        self._results: queue.SimpleQueue[Result] = queue.SimpleQueue()
        own = self._process, self._results
        threading.Thread(target=_listen, args=own, daemon=True).start()


#: Answers jobs one at a time.
Helper = Assistant | InProcess


def _listen(process: subprocess.Popen[bytes], results: queue.SimpleQueue[Result]) -> None:
    """Pass on what a process answers, until it ends."""
    assert process.stdout is not None
    while (result := _read(process.stdout)) is not None:
        results.put(result)
    code = process.wait()
    results.put(Done(f'the process that diagnoses has ended with {code}', success=False))


def _write(pipe: IO[bytes], what: object) -> None:
    data = pickle.dumps(what, protocol=pickle.HIGHEST_PROTOCOL)
    pipe.write(_LENGTH.pack(len(data)) + data)
    pipe.flush()


def _read(pipe: IO[bytes]) -> Any:
    """Return the next object; None at the end."""
    try:
        head = pipe.read(_LENGTH.size)
        if len(head) < _LENGTH.size:
            return None
        length = _LENGTH.unpack(head)[0]
        data = pipe.read(length)
    except (OSError, ValueError):  # closed while it is read
        return None
    if len(data) < length:  # it ended while it wrote
        return None
    return pickle.loads(data)  # of a process of one's own


def main() -> None:
    """Answer until the input ends."""
    os.nice(_NICE)
    jobs, results = sys.stdin.buffer, os.fdopen(os.dup(1), 'wb')
    os.dup2(2, 1)  # what a library prints must not get among the results
    helper = InProcess()
    while (job := _read(jobs)) is not None:
        try:
            helper.ask(job)
            result = helper.poll()
        except Exception as error:  # a window that nobody foresaw; the next one is another
            traceback.print_exc()
            what = f'{type(job).__name__.lower()} failed: {type(error).__name__}: {error}'
            result = Done(what, success=False)
        _write(results, result)
