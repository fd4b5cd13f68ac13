# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Results as files: each is whole or absent, and results of other runs are not replaced by accident.

A file is written under a temporary name and then moved, so a symbolic link in the folder is
replaced and not followed. The folder is locked while a command works on it; the system releases
the lock when the process ends.

"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
import fcntl
import json
import math
import os
from pathlib import Path
from typing import Any

from armid_ros.errors import OutputError
from armid_ros.files.documents import load_json, load_yaml, reading
from armid_ros.files.own import refuse_foreign, settled
from armid_ros.files.regular import read_text

#: Documents whose schema identifies the results in a folder; a command writes its document last.
DOCUMENTS = (
    'identification.json',
    'diagnosis.json',
    'excitation.json',
    'elastic.json',
    'exo.json',
    'comparison.json',
    'lunar.json',
    'fleet.json',
)
#: Model file that may be in a folder without document, and schemas of results that replace it.
_MODEL = 'model.yaml'
_WITH_MODEL = ('armid/identification/1', 'armid/diagnosis/1')


def write_file(path: str | Path, content: str | bytes) -> None:
    """
    Write a file under a temporary name and move it, so that it is whole or absent.

    Parameters
    ----------
    path : str or Path
        The file; an existing one is replaced, and a symbolic link is not followed.
    content : str or bytes
        Whole content; text is written in UTF-8.

    Raises
    ------
    OutputError
        If the file cannot be written; an existing file is then unchanged.

    """
    path = Path(path)
    beside = path.with_name(f'.{path.name}.part')
    data = content.encode('utf-8', 'backslashreplace') if isinstance(content, str) else content
    try:
        beside.unlink(missing_ok=True)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        with os.fdopen(os.open(beside, flags, 0o666), 'wb') as stream:
            stream.write(data)
        beside.replace(path)
    except OSError as error:
        with suppress(OSError):
            beside.unlink(missing_ok=True)
        raise OutputError(f'{settled(path)}: cannot be written: {error.strerror}') from error


def json_text(document: Any, indent: int | None = None) -> str:
    """Return a document as JSON; numbers that are not finite become null."""
    return json.dumps(_representable(document), indent=indent, allow_nan=False)


@contextmanager
def result_folder(
    path: Path,
    schema: str,
    robot: str = '',
    *,
    also: Collection[str] = (),
    force: bool = False,
) -> Iterator[Path]:
    """
    Make and lock a folder for the results of one command.

    Parameters
    ----------
    path : Path
        The folder; created if it does not exist.
    schema : str
        Schema of the results, such as 'armid/identification/1'.
    robot : str
        Name of the robot in the results; empty without a robot.
    also : collection of str
        Names of further files that the command writes.
    force : bool
        Whether to replace results of another kind or robot, and files of other programs.

    Raises
    ------
    OutputError
        If the folder cannot be written to, another run works on it, or it has results of another
        kind or robot, or files that the command did not write.

    """
    made = [one for one in (path, *path.parents) if not os.path.lexists(one)]
    try:
        with locked(path):
            probe = path / '.armid-probe'
            write_file(probe, b'0' * 4096)
            with suppress(OSError):
                probe.unlink()
            if not force:
                _refuse_other_results(path, schema, robot)
                refuse_foreign(path, schema, also)
            yield path
    finally:
        with suppress(OSError):  # folders that are still empty after a failure are removed
            for one in made:
                one.rmdir()


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """
    Make a folder if it does not exist, and lock it against other runs.

    Raises
    ------
    OutputError
        If the folder cannot be made or opened, or another run holds its lock.

    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except (FileExistsError, NotADirectoryError) as error:
        raise OutputError(f'{path}: is a file, or below one; --out is a folder') from error
    except OSError as error:
        raise OutputError(f'{path}: cannot be made or opened: {error.strerror}') from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        os.close(descriptor)
        raise OutputError(
            f'{path}: another run is writing into it; wait for its end or name another folder'
        ) from error
    except OSError:  # a file system without locks
        pass
    try:
        yield
    finally:
        os.close(descriptor)


def _refuse_other_results(path: Path, schema: str, robot: str) -> None:
    for name in DOCUMENTS:
        if not os.path.lexists(path / name):
            continue
        try:
            with reading(path / name, OutputError):
                found = load_json(read_text(path / name, OutputError))
                kind, other = str(found['schema']), str(found.get('robot', ''))
        except OutputError:
            kind, other = f'{name}, which cannot be read', ''
        if kind != schema:
            raise OutputError(f'{path}: holds {_in_words(kind)}, not {_in_words(schema)}; {_HINT}')
        if robot and other and not _same(robot, other):
            raise OutputError(f'{path}: holds {kind} of {other}, not of {robot}; {_HINT}')
    alone = not any(os.path.lexists(path / name) for name in DOCUMENTS)
    if alone and schema in _WITH_MODEL and os.path.lexists(path / _MODEL):
        _refuse_other_model(path, robot)


def _in_words(schema: str) -> str:
    """Return the kind of result of a schema such as 'armid/comparison/1', in words."""
    parts = schema.split('/')
    return f'results of kind {parts[1]}' if len(parts) == 3 else schema


def _refuse_other_model(path: Path, robot: str) -> None:
    try:
        with reading(path / _MODEL, OutputError):
            found = load_yaml(read_text(path / _MODEL, OutputError))
            kind, other = str(found['schema']), str(found['robot'])
    except OutputError:
        raise OutputError(f'{path}: holds a {_MODEL} that cannot be read; {_HINT}') from None
    if not kind.startswith('armid/model/') or (robot and not _same(robot, other)):
        raise OutputError(f'{path}: holds {kind} of {other}, not of {robot}; {_HINT}')


_HINT = 'name another folder, or write over it with --force'


def _same(robot: str, other: str) -> bool:
    """Return whether two names are of one robot: shipped names, or paths of one file."""
    if '-' in (robot, other):  # '-' is the description in the bag, which may be any robot
        return True
    return robot == other or Path(robot).absolute() == Path(other).absolute()


def _representable(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _representable(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_representable(part) for part in value]
    return value
