# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which files are results of this package, and so may be replaced by others.

A document names its schema and a page its generator near the beginning. Other files have no room
for a name: they are results if a document or a page lies beside them.

"""

from __future__ import annotations

from collections.abc import Collection
from fnmatch import fnmatch
from pathlib import Path
import re

from armid_ros.errors import OutputError
from armid_ros.files.regular import open_regular

#: What each kind of result may leave in its folder.
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
    'armid/inspection/1': ('inspection.html',),
    'armid/elastic/1': ('elastic.json', 'report.html', '*.png', 'resonances', 'steps'),
    'armid/springs/1': ('elastic.json', 'report.html'),
    'armid/exo/1': ('exo.json', 'report.html', 'recording'),
    'armid/lunar/1': ('lunar.json', 'report.html'),
}
#: What a page has in its head.
GENERATOR = '<meta name="generator" content="armid_ros">'
#: Where a file says what it is [bytes from the beginning].
_HEAD = 4096
_SCHEMA = re.compile(rb'schema"?: *"?armid/[a-z_]+/[0-9]')
_MARKS = {
    '.html': re.compile(re.escape(GENERATOR.encode())),
    '.json': _SCHEMA,
    '.yaml': _SCHEMA,
}


def refuse_foreign(folder: Path, schema: str, also: Collection[str] = ()) -> None:
    """
    Refuse a folder with files that a command did not write.

    Parameters
    ----------
    folder : Path
        The folder to fill.
    schema : str
        Of the results; nothing is refused where it is not known what belongs to them.
    also : collection of str
        Names of what else the command writes; may be patterns such as '*.png'.

    Raises
    ------
    OutputError
        Naming the folder and the file.

    """
    if schema not in _WRITES:
        return
    writes = (*_WRITES[schema], *also)
    names = sorted(path.name for path in folder.iterdir())
    for name in names:
        if not any(fnmatch(name.removeprefix('.').removesuffix('.part'), one) for one in writes):
            raise OutputError(
                f'{folder}: holds {name}, which this command does not write; name another folder, '
                'or use --force, which leaves it there'
            )
    known = [name for name in names if Path(name).suffix in _MARKS]
    for name in known or names:
        if not is_own(folder / name):
            raise OutputError(
                f'{folder}: holds {name}, which armid did not write; name another folder, or '
                'write over it with --force'
            )


def is_own(path: Path) -> bool:
    """Tell whether a document or a page is a result of this package."""
    mark = _MARKS.get(path.suffix)
    if mark is None:
        return False
    try:
        with open_regular(path, OutputError) as stream:
            return mark.search(stream.read(_HEAD)) is not None
    except (OutputError, OSError):
        return False
