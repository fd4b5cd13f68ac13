# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Expansion of xacro, which is a program more than a document.

A xacro file can include any file that its reader may read, ask for environment variables, and
repeat itself without end. It is therefore expanded in a process of its own, with a limit of time
and memory, and only where a person names the file: a description that comes over a topic or out of
a bag is never expanded.

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
#: How long it may last, with other processes on the machine [s]; what waits for a file ends so.
PATIENCE = 300.0
#: The most memory [bytes].
MEMORY_LIMIT = 2 << 30


def expand_xacro(path: Path, arguments: Mapping[str, str], packages: Mapping[str, str]) -> str:
    """
    Return what a xacro file expands to.

    Parameters
    ----------
    path : Path
        The file; it is trusted as a program is, except for time and memory.
    arguments : mapping of str to str
        Values of <xacro:arg>.
    packages : mapping of str to str
        Folders of packages by name, where `package_folders` would not find them.

    Raises
    ------
    RobotError
        It cannot be expanded, or not within the limits.

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
    with suppress(ValueError):  # it died before it gave an answer
        answer = json.loads(done.stdout)
    if 'text' not in answer:
        reason = answer.get('error') or f'not expanded within {MEMORY_LIMIT >> 20} MiB'
        raise RobotError(f'{path}: xacro: {reason}')
    return str(answer['text'])
