# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Atomic replacement of a result that consists of several files.

A run writes to a staging folder inside the folder of its results, so both are on the same file
system. Once all files are written, the folder is exchanged in one step. If a run fails, or is
interrupted or killed, the earlier result is unchanged.

"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager, ExitStack, suppress
import ctypes
from dataclasses import dataclass, field
import errno
from fnmatch import fnmatch
import os
from pathlib import Path
import shutil

from armid_ros.errors import OutputError
from armid_ros.files.output import DOCUMENTS, locked, STAGING


@dataclass(frozen=True)
class Staged:
    """
    New result in a staging folder; the earlier result is replaced once all files are complete.

    Attributes
    ----------
    out : Path
        Folder of the results.
    folder : Path
        Staging folder for the files of the new result, until `keep`.
    replaced : tuple of str
        Names or patterns of earlier files, which are deleted if the new result lacks them.
    spared : tuple of Path
        Files that are not deleted, because the new result refers to them.

    """

    out: Path
    folder: Path
    replaced: tuple[str, ...] = ()
    spared: tuple[Path, ...] = ()
    _kept: set[str] = field(default_factory=set)
    _locks: ExitStack = field(default_factory=ExitStack)

    @property
    def alone(self) -> bool:
        """Whether the results folder contains only the staging folder."""
        return all(path.name == STAGING for path in self.out.iterdir())

    def keep(self) -> None:
        """
        Replace the earlier result by the staged files, in one step if possible.

        Other files of the folder are linked into a new folder, which then replaces the old
        folder. If that is impossible (current folder, mount point, file system without hard
        links), the files are moved one by one. The document is then removed first and moved last,
        so a run that is killed in between leaves no document.

        Raises
        ------
        OutputError
            If a file cannot be moved.

        """
        names = sorted(os.listdir(self.folder), key=lambda name: (name in DOCUMENTS, name))
        self._kept.update(names)
        try:
            if self._exchanged(names):
                return
            for name in DOCUMENTS:
                if name in names:
                    (self.out / name).unlink(missing_ok=True)
            for path in self._earlier_files():
                path.unlink()
            for name in names:
                source, target = self.folder / name, self.out / name
                if target.is_dir() and not target.is_symlink():
                    aside = source.with_name(f'{name}.old')  # rename cannot replace a folder
                    target.replace(aside)
                    source.replace(target)
                    shutil.rmtree(aside)
                else:
                    source.replace(target)
        except OSError as error:
            raise OutputError(f'{self.out}: result cannot be written: {error.strerror}') from error

    def _exchanged(self, names: Collection[str]) -> bool:
        """Replace the results folder by a new folder atomically; return False if impossible."""
        out = self.out.resolve()
        old, own = out.stat(), self.folder.stat()
        if Path.cwd().is_relative_to(out) or (old.st_uid, old.st_gid) != (own.st_uid, own.st_gid):
            return False
        new = out.with_name(f'.{out.name}{STAGING}')
        goes = {STAGING, *names, *(path.name for path in self._earlier_files())}
        kept = [path for path in out.iterdir() if path.name not in goes]
        try:
            _remove(new)  # remains of a killed run
            new.mkdir()
            for path in (*kept, *self.folder.iterdir()):
                if path.is_dir() and not path.is_symlink():
                    shutil.copytree(path, new / path.name, symlinks=True, copy_function=os.link)
                else:
                    os.link(path, new / path.name, follow_symlinks=False)
            (new / STAGING).mkdir()
            shutil.copystat(out, new)
            self._locks.enter_context(locked(new))
            _exchange(new, out)
        except (OSError, OutputError, shutil.Error):
            with suppress(OSError):
                _remove(new)
            return False
        with suppress(OSError):
            _remove(new)
        return True

    def _earlier_files(self) -> list[Path]:
        """Return the files of the earlier result that are absent from the new result."""
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
    Create a staging folder for a result; delete the folder after the `with` block.

    Parameters
    ----------
    out, replaced, spared
        Attributes of `Staged`; the folder `out` is created if it does not exist.

    Raises
    ------
    OutputError
        If the folder cannot be created or written to.

    """
    folder = out / STAGING
    try:
        out.mkdir(parents=True, exist_ok=True)
        _remove(folder)  # remains of a killed run
        folder.mkdir()
    except OSError as error:
        raise OutputError(f'{out}: the folder cannot be created: {error.strerror}') from error
    with ExitStack() as locks:
        try:
            yield Staged(out, folder, tuple(replaced), tuple(spared), _locks=locks)
        finally:
            with suppress(OSError):
                _remove(folder)


def _exchange(first: Path, second: Path) -> None:
    """Exchange the names of two folders atomically; OSError if the system does not support it."""
    at_fdcwd, rename_exchange = -100, 2  # constants of the system call renameat2(2)
    rename = getattr(ctypes.CDLL(None, use_errno=True), 'renameat2', None)
    if rename is None:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))
    if rename(at_fdcwd, os.fsencode(first), at_fdcwd, os.fsencode(second), rename_exchange):
        code = ctypes.get_errno()
        raise OSError(code, os.strerror(code), str(second))


def _remove(path: Path) -> None:
    """Delete a folder, file or symbolic link; the target of a link is kept."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
