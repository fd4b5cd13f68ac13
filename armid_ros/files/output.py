# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Writing of results: each file is complete or absent, and other results are not overwritten.

A file is written under a temporary name and then renamed, so a symbolic link in the folder is
replaced, not followed. The folder is locked while a command works on it; the system releases
the lock when the process ends.

Earlier results of this package may be replaced. They have a mark: the schema of a document, the
generator of a page, or the schema in a comment or variable of a layout. Files without a mark are
results if a document or a page is in the same folder.

"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
import fcntl
from fnmatch import fnmatch
import hashlib
import json
import math
import os
from pathlib import Path
import re
from typing import Any

from armid_ros.errors import OutputError
from armid_ros.files.documents import load_yaml, reading
from armid_ros.files.regular import open_regular, read_text
from armid_ros.version import GENERATOR

#: Model file, which may be alone in a folder, and the results that may replace it.
_MODEL = 'model.yaml'
_SCHEMAS_WITH_MODEL = ('armid/identification/1', 'armid/diagnosis/1')
#: Files and folders of each result, by schema; the JSON document comes first.
WRITES = {
    'armid/identification/1': (
        'identification.json',
        'model.yaml',
        'report.html',
        'identified.urdf',
        'identified.mjcf.xml',
        'robot.urdf',
    ),
    'armid/diagnosis/1': (
        'diagnosis.json',
        'model.yaml',
        'report.html',
        'robot.urdf',
        'residual.csv',
        'experiment.yaml',
    ),
    'armid/excitation/1': (
        'excitation.json',
        'excitation.yaml',
        'excitation.csv',
        'report.html',
        'trajectory',
    ),
    'armid/comparison/1': ('comparison.json', 'report.html'),
    'armid/inspection/1': ('inspection.html', 'inspection.json'),
    'armid/check/1': ('report.html', 'check.json'),
    'armid/elastic/1': ('elastic.json', 'report.html', 'resonances', 'steps'),
    'armid/springs/1': ('elastic.json', 'report.html'),
    'armid/exo/1': ('exo.json', 'report.html', 'recording'),
    'armid/lunar/1': ('lunar.json', 'report.html'),
    'armid/positions/1': ('positions.json', 'model.yaml', 'robot.urdf', 'torque'),
    'armid/layout/1': ('plotjuggler.xml', 'foxglove.json', 'arm.rviz'),
    'armid/fleet/1': (
        'fleet.json',
        'index.html',
        'alarms.jsonl',
        'arms',
        'bags',
        'pages',
        'parameters',
        'refused',
        'reports',
        'robots',
        'watch',
    ),
}
#: JSON documents whose schema identifies the results in a folder; a command writes them last.
DOCUMENTS = tuple(dict.fromkeys(first for first, *_ in WRITES.values() if first.endswith('.json')))
#: Name of the folder to which a run writes until its result is complete.
STAGING = '.armid-part'
#: Message types in metadata.yaml, and the message types of a bag with a planned motion.
_MESSAGE_TYPE = re.compile(r'^ *type: *(\S+)', re.MULTILINE)
_PLAN_TYPES = {'trajectory_msgs/msg/JointTrajectory', 'std_msgs/msg/String'}
_MARK = re.compile(re.escape(GENERATOR).encode() + rb'|schema"?: *"?armid/[a-z_]+/[0-9]')
#: Endings of files with a mark.
_MARKED_SUFFIXES = ('.html', '.json', '.yaml', '.rviz', 'plotjuggler.xml')


def write_file(path: str | Path, content: str | bytes) -> None:
    """
    Write a file atomically: write a temporary file, then rename the temporary file.

    Parameters
    ----------
    path : str or Path
        The file; an existing one is replaced, and a symbolic link is not followed.
    content : str or bytes
        Content of the file; text is written in UTF-8.

    Raises
    ------
    OutputError
        If the file cannot be written; an existing file is then unchanged.

    """
    path = Path(path)
    temporary = path.with_name(f'.{path.name}.part')
    data = content.encode('utf-8', 'backslashreplace') if isinstance(content, str) else content
    try:
        temporary.unlink(missing_ok=True)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        with os.fdopen(os.open(temporary, flags, 0o666), 'wb') as stream:
            stream.write(data)
        temporary.replace(path)
    except OSError as error:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise OutputError(f'{final_path(path)}: cannot be written: {error.strerror}') from error


def json_text(document: Any, indent: int | None = None) -> str:
    """Format a document as JSON; numbers that are not finite become null."""
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
    Create a folder for the results of a command, and lock the folder during the `with` block.

    Parameters
    ----------
    path : Path
        Folder of the results; it is created if it does not exist.
    schema : str
        Schema of the results, such as 'armid/identification/1'.
    robot : str
        Name of the robot in the results; empty without a robot.
    also : collection of str
        Names of further files that the command writes.
    force : bool
        Whether to replace results of another command or robot, and files of other programs.

    Raises
    ------
    OutputError
        If the folder cannot be written to, another run writes to it, or it has results of another
        command or robot, or files that the command did not write.

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
        with suppress(OSError):  # empty folders are removed after a failure
            for one in made:
                one.rmdir()


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """
    Lock a folder against other runs during the `with` block; create the folder if necessary.

    Raises
    ------
    OutputError
        If the folder cannot be created or opened, or another run has locked it.

    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except (FileExistsError, NotADirectoryError) as error:
        raise OutputError(
            f'{path}: the path is a file, or inside a file; give a folder with --out'
        ) from error
    except OSError as error:
        raise OutputError(f'{path}: the folder cannot be opened: {error.strerror}') from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        os.close(descriptor)
        raise OutputError(
            f'{path}: another run writes to this folder; wait until it ends, or give another '
            'folder'
        ) from error
    except OSError:  # the file system has no locks
        pass
    try:
        yield
    finally:
        os.close(descriptor)


def _refuse_other_results(path: Path, schema: str, robot: str) -> None:
    """Raise OutputError if a folder contains results of another command or robot."""
    there = [name for name in DOCUMENTS if os.path.lexists(path / name)]
    if not there and schema in _SCHEMAS_WITH_MODEL and os.path.lexists(path / _MODEL):
        there = [_MODEL]
    for name in there:
        load = load_yaml if name == _MODEL else json.loads
        try:
            with reading(path / name, OutputError):
                found = load(read_text(path / name, OutputError))
                kind, other = str(found['schema']), str(found.get('robot', ''))
        except OutputError:
            kind, other = f'{name}, which cannot be read', ''
        fits = kind.startswith('armid/model/') if name == _MODEL else kind == schema
        hint = 'give another folder, or --force to overwrite'
        if not fits:
            own, new = _in_words(kind), _in_words(schema)
            raise OutputError(f'{path} contains {own}, not {new}; {hint}')
        # '-' is the description in the bag, which may be any robot
        same = '-' in (robot, other) or Path(robot).absolute() == Path(other).absolute()
        if robot and other and not same:
            raise OutputError(
                f'{path} contains {_in_words(kind)} for robot {other}, not for {robot}; {hint}'
            )


def _in_words(schema: str) -> str:
    """Return a schema in words, such as 'results of comparison' for 'armid/comparison/1'."""
    parts = schema.split('/')
    return f'results of {parts[1]}' if len(parts) == 3 else schema


def _representable(value: Any) -> Any:
    """Return a copy of a nested document with None in place of NaN and infinite numbers."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _representable(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_representable(part) for part in value]
    return value


def final_path(path: Path) -> Path:
    """Return the final path of a file in a staging folder; return other paths unchanged."""
    return Path(*(part for part in path.parts if part != STAGING))


def hash_files(paths: Iterable[str | Path]) -> tuple[tuple[str, int, str], ...]:
    """Return path, size [bytes] and SHA-256 of each file, including the files inside folders."""
    found = []
    for path in map(Path, paths):
        inside = sorted(path.rglob('*')) if path.is_dir() else [path]
        for file in filter(Path.is_file, inside):
            with file.open('rb') as stream:
                digest = hashlib.file_digest(stream, 'sha256').hexdigest()
            found.append((str(final_path(file)), file.stat().st_size, digest))
    return tuple(found)


def refuse_foreign(folder: Path, schema: str, also: Collection[str] = ()) -> None:
    """
    Raise OutputError if a folder contains files that the command did not write.

    Parameters
    ----------
    folder : Path
        The folder of the results.
    schema : str
        Schema of the results; for an unknown schema, no files are refused.
    also : collection of str
        Names of further files that the command writes, or patterns such as '*.png'.

    Raises
    ------
    OutputError
        If the folder has such a file; the message names folder and file.

    """
    if schema not in WRITES:
        return
    writes = (*WRITES[schema], *also)
    names = sorted(path.name for path in folder.iterdir() if path.name != STAGING)
    for name in names:
        if not any(fnmatch(name.removeprefix('.').removesuffix('.part'), one) for one in writes):
            raise OutputError(
                f'{folder}: contains {name}, which this command does not write; give another '
                'folder, or add --force to keep that file and write there'
            )
    refuse_replacing(folder, names, ', or overwrite the file with --force')


def refuse_replacing(folder: Path, names: Collection[str], remedy: str = '') -> None:
    """
    Raise OutputError if the files to be replaced include a file of another program.

    Parameters
    ----------
    folder : Path
        The folder, which need not exist.
    names : collection of str
        Names of the files to be written.
    remedy : str
        End of the error message: what the user can do other than give another folder.

    Raises
    ------
    OutputError
        If the folder has such a file; the message names folder and file.

    """
    there = [name for name in names if os.path.lexists(folder / name)]
    # files that cannot have a mark count only if no other files exist
    for name in [one for one in there if one.endswith(_MARKED_SUFFIXES)] or there:
        if not is_own(folder / name):
            raise OutputError(
                f'{folder}: contains {name}, which armid did not write; give another folder'
                f'{remedy}'
            )


def is_plan(path: Path) -> bool:
    """Return whether a folder is a bag with a planned trajectory and without measurements."""
    try:
        text = read_text(path / 'metadata.yaml', OutputError)
    except OutputError:
        return False
    kinds = set(_MESSAGE_TYPE.findall(text))
    return 'trajectory_msgs/msg/JointTrajectory' in kinds <= _PLAN_TYPES


def is_own(path: Path) -> bool:
    """Return whether armid_ros wrote a file or bag, such as a report or planned motion."""
    if path.is_dir():
        return is_plan(path)
    if not path.name.endswith(_MARKED_SUFFIXES):
        return False
    try:
        with open_regular(path, OutputError) as stream:
            return _MARK.search(stream.read(4096)) is not None  # the mark is at the beginning
    except (OutputError, OSError):
        return False
