# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Recognition of files that are results of this package, and so may be replaced.

A document has its schema and a page its generator near the beginning; a layout has its schema in
a comment or a variable. Other files have no mark: they are results if a document or a page is in
the same folder.

"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from fnmatch import fnmatch
from pathlib import Path
import re

from armid_ros.errors import OutputError
from armid_ros.files.regular import open_regular, read_text

#: Files and folders of each kind of result, by schema.
_WRITES = {
    'armid/identification/1': (
        'model.yaml',
        'identification.json',
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
        'excitation.yaml',
        'excitation.csv',
        'excitation.json',
        'report.html',
        'trajectory',
    ),
    'armid/comparison/1': ('comparison.json', 'report.html'),
    'armid/inspection/1': ('inspection.html', 'inspection.json'),
    'armid/check/1': ('check.json', 'report.html'),
    'armid/elastic/1': ('elastic.json', 'report.html', 'resonances', 'steps'),
    'armid/springs/1': ('elastic.json', 'report.html'),
    'armid/exo/1': ('exo.json', 'report.html', 'recording'),
    'armid/lunar/1': ('lunar.json', 'report.html'),
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
#: Folder in which a run writes until its result is complete.
STAGING = '.armid-part'
#: Element in the head of each page of this package.
GENERATOR = '<meta name="generator" content="armid_ros">'
#: Pattern of message types in metadata.yaml, and message types of a bag with a planned motion.
_KIND = re.compile(r'^ *type: *(\S+)', re.MULTILINE)
_OF_A_PLAN = {'trajectory_msgs/msg/JointTrajectory', 'std_msgs/msg/String'}
#: Size of the beginning of a file that contains its mark [bytes].
_HEAD = 4096
_SCHEMA = re.compile(rb'schema"?: *"?armid/[a-z_]+/[0-9]')
_MARKS = {
    '.html': re.compile(re.escape(GENERATOR.encode())),
    '.json': _SCHEMA,
    '.yaml': _SCHEMA,
    '.rviz': _SCHEMA,
    'plotjuggler.xml': _SCHEMA,
}


def settled(path: Path) -> Path:
    """Return the final path of a staged file; other paths unchanged."""
    return Path(*(part for part in path.parts if part != STAGING))


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
                f'{folder}: holds {name}, which this command does not write; name another folder, '
                'or use --force, which leaves it there'
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
    """Return foreign files; files that cannot have a mark count only if all names are such."""
    known = [name for name in names if _mark_of(name)]
    return (name for name in known or names if not is_own(folder / name))


def _mark_of(name: str) -> re.Pattern[bytes] | None:
    return _MARKS.get(name) or _MARKS.get(Path(name).suffix)


def is_plan(path: Path) -> bool:
    """Return whether a folder is a bag with a trajectory and no measurements."""
    try:
        text = read_text(path / 'metadata.yaml', OutputError)
    except OutputError:
        return False
    kinds = set(_KIND.findall(text))
    return 'trajectory_msgs/msg/JointTrajectory' in kinds <= _OF_A_PLAN


def is_own(path: Path) -> bool:
    """Return whether a document, page or trajectory is a result of this package."""
    if path.is_dir():
        return is_plan(path)
    mark = _mark_of(path.name)
    if mark is None:
        return False
    try:
        with open_regular(path, OutputError) as stream:
            return mark.search(stream.read(_HEAD)) is not None
    except (OutputError, OSError):
        return False
