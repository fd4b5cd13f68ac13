# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Search for the bags of a fleet, and the arm and day of each bag."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
import datetime
import hashlib
import re
from typing import Any
from urllib.parse import quote

from armid_ros.errors import FleetError
from armid_ros.fleet.store import opened

#: Endings of files that are bags, or parts of one.
SUFFIXES = ('.mcap', '.db3', '.mcap.zstd', '.db3.zstd')
#: A date in a path: 2026-01-31, 2026_01_31 or 20260131.
_DATE = re.compile(r'(?<!\d)(20\d\d)([-_]?)(\d\d)\2(\d\d)(?!\d)')
#: Length of a day [ns].
DAY_NS = 86_400 * 10**9
#: Largest length of an arm's name in a file name [bytes]; file systems allow 255 in total.
_MAX_NAME = 240
_WILDCARD = re.compile(r'[*?\[]')
#: Keys of stores for the version of a file, the most reliable first.
_VERSIONS = ('ETag', 'etag', 'md5Hash', 'mtime', 'LastModified', 'updated', 'created')


@dataclass(frozen=True, order=True)
class BagFile:
    """
    Bag of a fleet: name of the arm, URL, date in the path, size and version of the content.

    Attributes
    ----------
    arm : str
        Name of the arm.
    url : str
        URL of the bag.
    day : str
        Date in the path, such as 2026-01-31; empty without a date.
    size : int
        Size of the bag [bytes].
    version : str
        Text that changes when the content of the bag changes.

    """

    arm: str
    url: str
    day: str = ''
    size: int = 0
    version: str = ''

    @property
    def name(self) -> str:
        """File name for the results of the bag: name of the bag and hash of the URL."""
        last = self.url.rstrip('/').rsplit('/', 1)[-1]
        return f'{re.sub(r"[^A-Za-z0-9_.-]", "_", last)}-{digest(self.url, size=10)}'


def digest(*parts: str, size: int = 16) -> str:
    """Return the first ``size`` hexadecimal digits of the SHA-256 hash of given texts."""
    return hashlib.sha256('\n'.join(parts).encode()).hexdigest()[:size]


def folder_of(arm: str) -> str:
    """Return the name of the results folder of an arm."""
    return f'arm={file_name(arm)}'


def file_name(arm: str) -> str:
    """Convert the name of an arm to a file name: escape all but letters and digits by %."""
    return ''.join(char if char.isalnum() else quote(char, safe='') for char in arm)


def find_bags(patterns: Sequence[str], arm_pattern: str | None = None) -> list[BagFile]:
    """
    List the bags whose URLs match patterns with wildcards.

    The arm of a bag is the part of the path that the first wildcard matches. If this part is the
    bag itself, the folder of the bag names the arm.

    Parameters
    ----------
    patterns : sequence of str
        URLs or paths with wildcards of .mcap and .db3 files or rosbag2 directories.
    arm_pattern : str, optional
        Regular expression to search for in the URL; its first group is the name of the arm.

    Raises
    ------
    FleetError
        If there is no bag, or if the name of an arm is missing, empty or too long.

    """
    try:
        regular = None if arm_pattern is None else re.compile(arm_pattern)
    except re.error as error:
        raise FleetError(f'--arm {arm_pattern}: {error}') from error
    if regular is not None and regular.groups < 1:
        raise FleetError(
            f"--arm {arm_pattern}: add a (group) for the name of the arm, as in 'robots/([^/]+)/'"
        )
    found: dict[str, BagFile] = {}
    for pattern in patterns:
        filesystem, path = opened(pattern)
        try:
            listed = filesystem.glob(path, detail=True)
        except Exception as error:  # stores raise different exceptions
            raise FleetError(f'{pattern}: no list of files: {error}') from error
        bags = list(_bags(filesystem, listed))
        if not bags:
            raise FleetError(
                f'{pattern}: there is no bag; a bag is a .mcap or .db3 file or a rosbag2 directory'
                + ('' if _WILDCARD.search(pattern) else f', as in "{pattern.rstrip("/")}/*/*"')
            )
        for at, size, version in bags:
            url = filesystem.unstrip_protocol(at)
            arm = _arm(path, at)
            if regular is not None:
                match = regular.search(url)
                if match is None:
                    raise FleetError(f'{url}: --arm {arm_pattern} does not match this URL')
                arm = match.group(1) or ''
            length = len(file_name(arm).encode())
            if not 0 < length <= _MAX_NAME:
                raise FleetError(
                    f'{url}: the name of its arm, {arm!r}, takes {length} bytes as a file name, '
                    f'but has to take 1 to {_MAX_NAME}; name the arm by another part of the path '
                    "with --arm 'robots/([^/]+)/'"
                )
            plain = at if url.startswith('file://') else url
            found[plain] = BagFile(arm, plain, _day(at), size, version)
    return sorted(found.values())


def _bags(
    filesystem: Any, listed: Mapping[str, Mapping[str, Any]]
) -> Iterator[tuple[str, int, str]]:
    """Yield path, size [bytes] and version of each bag among listed files and directories."""

    def version(info: Mapping[str, Any]) -> str:
        found = [str(info[name]) for name in _VERSIONS if info.get(name)][:1]
        return '/'.join([str(info.get('name')), str(info.get('size')), *found])

    directories: list[str] = []
    for path, info in sorted(listed.items()):
        path = path.rstrip('/')
        if any(path.startswith(f'{folder}/') for folder in directories[-1:]):
            continue  # a file in a bag directory
        if info.get('type') == 'directory':
            inside = [
                one for one in filesystem.ls(path, detail=True) if one['name'].endswith(SUFFIXES)
            ]
            if inside:
                directories.append(path)
                versions = [version(one) for one in sorted(inside, key=lambda one: one['name'])]
                size = sum(int(one.get('size') or 0) for one in inside)
                yield path, size, digest(*versions)
        elif path.endswith(SUFFIXES):
            yield path, int(info.get('size') or 0), digest(version(info))


def _arm(pattern: str, path: str) -> str:
    """Return the name of an arm: path component at the first wildcard, or folder of the bag."""
    wild = [k for k, part in enumerate(pattern.split('/')) if _WILDCARD.search(part)]
    parts = path.rstrip('/').split('/')
    last = len(parts) - 1
    at = min(wild[0] if wild else last, max(last - 1, 0))
    return parts[at]


def _day(path: str) -> str:
    """Return the last date in a path, such as 2026-01-31; empty if there is none."""
    for year, _, month, day in reversed(_DATE.findall(path)):
        try:
            return datetime.date(int(year), int(month), int(day)).isoformat()
        except ValueError:
            continue
    return ''
