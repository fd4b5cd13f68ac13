# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Search for the folder of a ROS package without ROS; used by the xacro process as well."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import os
from pathlib import Path
import re


def package_folders(
    name: str, file: Path | None, given: Mapping[str, str | Path] | None = None
) -> Iterator[Path]:
    """
    Yield the possible folders of a package, the most likely folder first.

    Parameters
    ----------
    name : str
        Name of the package.
    file : Path or None
        The description that refers to it.
    given : mapping of str to str or Path, optional
        Folders of packages by name; a package in this mapping is not looked for elsewhere.

    Yields
    ------
    Path
        The given folder, if any. Otherwise, in this order: folders whose package.xml has the name,
        which enclose the file or lie beside an enclosing folder; such folders in ROS_PACKAGE_PATH;
        the folder in AMENT_PREFIX_PATH; folders of that name without a package.xml, which enclose
        the file or lie beside an enclosing folder.

    """
    if given and name in given:
        yield Path(given[name])
        return
    around = [] if file is None else list(file.resolve().parents)
    path = [Path(part) for part in _paths('ROS_PACKAGE_PATH')]
    for root in (*around, *path):
        yield from (folder for folder in _below(root, name) if _is_package(folder, name))
    yield from (Path(prefix) / 'share' / name for prefix in _paths('AMENT_PREFIX_PATH'))
    yield from (root / name for root in (*around, *path, *(root.parent for root in path)))


def _below(root: Path, name: str) -> Iterator[Path]:
    """Yield a folder, its subfolders, and folders of the given name one level deeper."""
    yield root
    if root == root.parent:
        return
    try:
        inside = sorted(entry.path for entry in os.scandir(root) if entry.is_dir())
    except OSError:
        return
    yield root / name
    yield from map(Path, inside)
    yield from (Path(folder) / name for folder in inside)


def _is_package(folder: Path, name: str) -> bool:
    try:
        text = (folder / 'package.xml').read_text(encoding='utf-8', errors='replace')
    except OSError:
        return False
    found = re.search(r'<name>\s*([^<]*?)\s*</name>', text)
    return found is not None and found[1] == name


def _paths(variable: str) -> list[str]:
    return [part for part in os.environ.get(variable, '').split(os.pathsep) if part]
