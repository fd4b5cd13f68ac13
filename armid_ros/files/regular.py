# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Reading of regular files without waiting, and limits of their size.

Opening a FIFO waits for a writer, and reading a device may never end. Both are refused at once.

"""

from __future__ import annotations

import os
from pathlib import Path
import resource
import stat
from typing import BinaryIO

from armid_ros.errors import ArmidError

#: Largest size of a text file [bytes]; a description of 10,000 links has 6 MB.
TEXT_LIMIT = 64 << 20
_CONTROL_GROUP = Path('/sys/fs/cgroup/memory.max')

_KINDS = (
    (stat.S_ISDIR, 'a folder'),
    (stat.S_ISFIFO, 'a FIFO'),
    (stat.S_ISCHR, 'a device'),
    (stat.S_ISBLK, 'a device'),
    (stat.S_ISSOCK, 'a socket'),
)


def is_file(path: str | Path) -> bool:
    """Return whether a path is a regular file."""
    try:
        return stat.S_ISREG(os.stat(path).st_mode)
    except (OSError, ValueError):
        return False


def open_regular(path: str | Path, error: type[ArmidError]) -> BinaryIO:
    """
    Open a regular file for reading; refuse folders, pipes, devices and sockets.

    Parameters
    ----------
    path : str or Path
        The file.
    error : type of ArmidError
        Class of the raised error.

    Raises
    ------
    ArmidError
        If the file cannot be opened, or is a folder, a FIFO, a device or a socket.

    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except (OSError, ValueError) as problem:
        raise error(f'{path}: the file cannot be read: {problem_text(problem)}') from problem
    mode = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(mode):
        os.close(descriptor)
        kind = next((name for is_kind, name in _KINDS if is_kind(mode)), 'a special file')
        raise error(f'{path}: the path cannot be read, as it is {kind}, not a file')
    return os.fdopen(descriptor, 'rb')


def read_text(path: str | Path, error: type[ArmidError]) -> str:
    """
    Return the content of a text file of limited size.

    Parameters
    ----------
    path : str or Path
        The file, in UTF-8.
    error : type of ArmidError
        Class of the raised error.

    Raises
    ------
    ArmidError
        If the file cannot be opened, is not a regular file, is too large, or is not text.

    """
    with open_regular(path, error) as stream:
        try:
            content = stream.read(TEXT_LIMIT + 1)
        except OSError as problem:
            raise error(f'{path}: the file cannot be read: {problem_text(problem)}') from problem
    if len(content) > TEXT_LIMIT:
        raise error(f'{path}: the file exceeds {TEXT_LIMIT >> 20} MiB, the limit of text files')
    try:
        return content.decode('utf-8-sig')
    except UnicodeDecodeError as problem:
        raise error(f'{path}: the file is not UTF-8 text: {problem}') from problem


def problem_text(problem: OSError | ValueError) -> str:
    """Return the reason of a system error as text, without the path."""
    return (problem.strerror if isinstance(problem, OSError) else None) or str(problem)


def default_memory_limit() -> int:
    """Return the default memory limit for an input: a quarter of available memory [bytes]."""
    bounds = [os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES')]
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY:
        bounds.append(limit)
    try:
        bounds.append(int(_CONTROL_GROUP.read_text(encoding='ascii')))
    except (OSError, ValueError):  # no control group, or 'max'
        pass
    return min(bounds) // 4


def size_text(size: int) -> str:
    """Format a number of bytes with a unit, such as '1.5 MB'."""
    for unit, scale in (('GB', 10**9), ('MB', 10**6), ('kB', 10**3)):
        if size >= scale:
            return f'{size / scale:.3g} {unit}'
    return f'{size} bytes'
