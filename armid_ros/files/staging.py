# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Results of several files as one: all of a run, or all of the one before.

A run writes into a folder of its own inside the folder of its results, which is on the same file
system wherever that is mounted. Its files are moved to their places once all of them are written;
a run that fails, or is interrupted, leaves what was there before.

"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from fnmatch import fnmatch
import os
from pathlib import Path
import shutil

from armid_ros.errors import OutputError
from armid_ros.files.output import DOCUMENTS
from armid_ros.files.own import STAGING


@dataclass(frozen=True)
class Staged:
    """
    A result in the making.

    Attributes
    ----------
    out : Path
        Folder that the result is for.
    folder : Path
        Where it is written until it is kept.
    replaced : tuple of str
        Names, or patterns, of the files of an earlier result; those go that this one has not.
    spared : tuple of Path
        Files that stay all the same, as the result refers to them.

    """

    out: Path
    folder: Path
    replaced: tuple[str, ...] = ()
    spared: tuple[Path, ...] = ()
    _kept: set[str] = field(default_factory=set)

    @property
    def alone(self) -> bool:
        """Whether nothing else is in the folder."""
        return all(path.name == STAGING for path in self.out.iterdir())

    def keep(self) -> None:
        """
        Move what was written to its place.

        The document that says what the folder is goes first and comes last: files that another
        process finds without it are no result yet.

        Raises
        ------
        OutputError
            A file cannot be moved.

        """
        names = sorted(os.listdir(self.folder), key=lambda name: (name in DOCUMENTS, name))
        self._kept.update(names)
        try:
            for name in DOCUMENTS:
                if name in names:
                    (self.out / name).unlink(missing_ok=True)
            for path in self._earlier():
                path.unlink()
            for name in names:
                _move(self.folder / name, self.out / name)
        except OSError as error:
            raise OutputError(f'{self.out}: cannot be written: {error.strerror}') from error

    def _earlier(self) -> list[Path]:
        """Return files of an earlier result that this one has not; folders may be recordings."""
        spared = {path.resolve() for path in self.spared}
        return [
            path
            for path in self.out.iterdir()
            if path.name not in self._kept
            and any(fnmatch(path.name, one) for one in self.replaced)
            and path.resolve() not in spared
            and (path.is_symlink() or path.is_file())
        ]


@contextmanager
def staged(
    out: Path, replaced: Collection[str] = (), spared: Collection[Path] = ()
) -> Iterator[Staged]:
    """
    Hold a place for a result in the making; what was not kept when the context ends is gone.

    Parameters
    ----------
    out, replaced, spared
        As for `Staged`; the folder is made if it is not there.

    Raises
    ------
    OutputError
        The folder cannot be made or written to.

    """
    folder = out / STAGING
    try:
        out.mkdir(parents=True, exist_ok=True)
        _remove(folder)  # of a run that was killed
        folder.mkdir()
    except OSError as error:
        raise OutputError(f'{out}: cannot be made or written to: {error.strerror}') from error
    try:
        yield Staged(out, folder, tuple(replaced), tuple(spared))
    finally:
        with suppress(OSError):
            _remove(folder)


def _move(source: Path, target: Path) -> None:
    """Replace a file; a folder is taken out of the way first, as none replaces another."""
    if target.is_dir() and not target.is_symlink():
        aside = source.with_name(f'{source.name}.old')
        target.replace(aside)
        source.replace(target)
        shutil.rmtree(aside)
    else:
        source.replace(target)


def _remove(path: Path) -> None:
    """Take a folder away, or a link with its name and not what it points to."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
