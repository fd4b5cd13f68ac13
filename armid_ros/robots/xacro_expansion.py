# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Expansion of xacro files in a separate process.

A xacro file is a program: it can include any readable file, read environment variables and loop
without end. It is therefore expanded in a separate process with limits of time and memory, and
only if a person names the file. A description from a topic or a bag is never expanded.

"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
import json
from pathlib import Path
import signal
import subprocess
import sys
from typing import Any

from armid_ros.errors import RobotError

#: Processor time that an expansion may take [s]; the largest descriptions take one or two.
TIME_LIMIT = 20.0
#: Largest elapsed time of an expansion [s]; this ends an expansion that waits for a file.
PATIENCE = 300.0
#: Largest memory of an expansion [bytes].
MEMORY_LIMIT = 2 << 30


def expand_xacro(path: Path, arguments: Mapping[str, str], packages: Mapping[str, str]) -> str:
    """
    Return the expanded text of a xacro file.

    Parameters
    ----------
    path : Path
        The file. It is trusted like a program; only its time and memory are limited.
    arguments : mapping of str to str
        Values of <xacro:arg>.
    packages : mapping of str to str
        Folders by name of packages that `package_folders` does not find.

    Raises
    ------
    RobotError
        If the file cannot be expanded within the limits.

    """
    request = {
        'path': str(path),
        'arguments': dict(arguments),
        'packages': dict(packages),
        'seconds': TIME_LIMIT,
        'memory': MEMORY_LIMIT,
    }
    command = [sys.executable, '-P', str(Path(__file__).with_name('xacro_process.py'))]
    try:
        done = subprocess.run(
            command,
            input=json.dumps(request),
            capture_output=True,
            encoding='utf-8',
            errors='replace',
            timeout=PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise RobotError(f'{path}: xacro: not expanded within {PATIENCE:g} s') from error
    except OSError as error:
        raise RobotError(f'{path}: xacro: cannot be started: {error.strerror}') from error
    if -done.returncode in (signal.SIGPROF, signal.SIGXCPU, signal.SIGKILL):
        raise RobotError(
            f'{path}: xacro: not expanded within {TIME_LIMIT:g} s of processor time and '
            f'{MEMORY_LIMIT >> 20} MiB'
        )
    answer: dict[str, Any] = {}
    with suppress(ValueError):  # the process died before it answered
        answer = json.loads(done.stdout)
    if 'text' not in answer:
        reason = answer.get('error') or f'not expanded within {MEMORY_LIMIT >> 20} MiB'
        raise RobotError(f'{path}: xacro: {reason}')
    return str(answer['text'])
