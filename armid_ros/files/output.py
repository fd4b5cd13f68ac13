# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Results as files: each is complete or absent, and replaces no result of another run by accident.

A file is written under a temporary name and then renamed, so a symbolic link in the folder is
replaced, not followed. The folder is locked while a command works on it; the system releases
the lock when the process ends.

Results of this package may be replaced. Results have a mark: the schema of a document, the
generator of a page, and the schema in a comment or variable of a layout. Files without a mark are
results if a document or a page is in the same folder.

"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
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

#: Model file that may be in a folder without a document, and results that may replace it.
_MODEL = 'model.yaml'
_SCHEMAS_WITH_MODEL = ('armid/identification/1', 'armid/diagnosis/1')
#: Files and folders of each kind of result, by schema; the JSON document comes first.
_WRITES = {
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
#: Documents whose schema identifies the results in a folder; a command writes its document last.
DOCUMENTS = tuple(
    dict.fromkeys(first for first, *_ in _WRITES.values() if first.endswith('.json'))
)
#: Folder in which a run writes until its result is complete.
STAGING = '.armid-part'
#: Pattern of message types in metadata.yaml, and message types of a bag with a planned motion.
_MESSAGE_TYPE = re.compile(r'^ *type: *(\S+)', re.MULTILINE)
_PLAN_TYPES = {'trajectory_msgs/msg/JointTrajectory', 'std_msgs/msg/String'}
_MARK = re.compile(re.escape(GENERATOR).encode() + rb'|schema"?: *"?armid/[a-z_]+/[0-9]')
#: Endings of files with a mark.
_MARKED_SUFFIXES = ('.html', '.json', '.yaml', '.rviz', 'plotjuggler.xml')


def write_file(path: str | Path, content: str | bytes) -> None:
    """
    Write a file under a temporary name and rename it, so that it is complete or absent.

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
        with suppress(OSError):  # empty folders are removed after a failure
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
    except OSError:  # the file system has no locks
        pass
    try:
        yield
    finally:
        os.close(descriptor)


def _refuse_other_results(path: Path, schema: str, robot: str) -> None:
    """Refuse a folder with a document, or only a model, of another kind or robot."""
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
        hint = 'name another folder, or write over it with --force'
        if not fits:
            raise OutputError(f'{path}: holds {_in_words(kind)}, not {_in_words(schema)}; {hint}')
        # '-' is the description in the bag, which may be any robot
        same = '-' in (robot, other) or Path(robot).absolute() == Path(other).absolute()
        if robot and other and not same:
            raise OutputError(f'{path}: holds {kind} of {other}, not of {robot}; {hint}')


def _in_words(schema: str) -> str:
    """Return the name of the kind of result of a schema such as 'armid/comparison/1'."""
    parts = schema.split('/')
    return f'results of kind {parts[1]}' if len(parts) == 3 else schema


def _representable(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _representable(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_representable(part) for part in value]
    return value


def settled(path: Path) -> Path:
    """Return the final path of a staged file; other paths unchanged."""
    return Path(*(part for part in path.parts if part != STAGING))


def hash_files(paths: Iterable[str | Path]) -> tuple[tuple[str, int, str], ...]:
    """Hash files, and all files in folders such as bags; skip other paths."""
    found = []
    for path in map(Path, paths):
        inside = sorted(path.rglob('*')) if path.is_dir() else [path]
        for file in filter(Path.is_file, inside):
            with file.open('rb') as stream:
                digest = hashlib.file_digest(stream, 'sha256').hexdigest()
            found.append((str(settled(file)), file.stat().st_size, digest))
    return tuple(found)


def written_by(schema: str, also: Collection[str] = ()) -> tuple[str, ...]:
    """Return names and patterns, such as '*.png', of the files of a kind of result."""
    return (*_WRITES.get(schema, ()), *also)


def refuse_foreign(folder: Path, schema: str, also: Collection[str] = ()) -> None:
    """
    Refuse a folder with files that a command did not write.

    Parameters
    ----------
    folder : Path
        The folder of the results.
    schema : str
        Schema of the results; nothing is refused for an unknown schema.
    also : collection of str
        Names of further files that the command writes, or patterns such as '*.png'.

    Raises
    ------
    OutputError
        If there is such a file; the message names the folder and the file.

    """
    if schema not in _WRITES:
        return
    writes = written_by(schema, also)
    names = sorted(path.name for path in folder.iterdir() if path.name != STAGING)
    for name in names:
        if not any(fnmatch(name.removeprefix('.').removesuffix('.part'), one) for one in writes):
            raise OutputError(
                f'{folder}: contains {name}, which this command does not write; choose another '
                'folder, or add --force to keep that file and write there'
            )
    for name in _foreign(folder, names):
        raise OutputError(
            f'{folder}: holds {name}, which armid did not write; name another folder, or '
            'write over it with --force'
        )


def refuse_replacing(folder: Path, names: Collection[str]) -> None:
    """
    Raise an error instead of replacing files that this package did not write.

    Parameters
    ----------
    folder : Path
        The folder, which need not exist.
    names : collection of str
        Names of the files to be written.

    Raises
    ------
    OutputError
        If there is such a file; the message names the folder and the file.

    """
    for name in _foreign(folder, [name for name in names if (folder / name).exists()]):
        raise OutputError(
            f'{folder}: holds {name}, which armid did not write; name another folder'
        )


def _foreign(folder: Path, names: Sequence[str]) -> Iterator[str]:
    """Return foreign files; files that cannot have a mark count only if no others exist."""
    known = [name for name in names if name.endswith(_MARKED_SUFFIXES)]
    return (name for name in known or names if not is_own(folder / name))


def is_plan(path: Path) -> bool:
    """Return whether a folder is a bag with a trajectory and no measurements."""
    try:
        text = read_text(path / 'metadata.yaml', OutputError)
    except OutputError:
        return False
    kinds = set(_MESSAGE_TYPE.findall(text))
    return 'trajectory_msgs/msg/JointTrajectory' in kinds <= _PLAN_TYPES


def is_own(path: Path) -> bool:
    """Return whether a document, page or trajectory is a result of this package."""
    if path.is_dir():
        return is_plan(path)
    if not path.name.endswith(_MARKED_SUFFIXES):
        return False
    try:
        with open_regular(path, OutputError) as stream:
            return _MARK.search(stream.read(4096)) is not None  # the mark is at the beginning
    except (OutputError, OSError):
        return False
