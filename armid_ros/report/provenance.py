# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Provenance of a result: input files, software versions, settings and seed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib import metadata
import platform

#: Packages whose version can change a result.
_PACKAGES = ('armid_ros', 'numpy', 'scipy', 'pin', 'clarabel', 'mcap')


@dataclass(frozen=True)
class Provenance:
    """
    Files, versions, settings and seed with which a result can be reproduced.

    Attributes
    ----------
    files : tuple of (str, int, str)
        Files that were read: path as given, size [bytes], SHA-256 in hexadecimal digits.
    versions : mapping of str to str
        Software and its version.
    settings : mapping of str to str
        Settings of the command.
    seed : int or None
        Seed of the random numbers.
    command : str
        Command line; may be empty.
    created : str
        Time of the command; may be empty.

    """

    files: tuple[tuple[str, int, str], ...] = ()
    versions: Mapping[str, str] = field(default_factory=dict)
    settings: Mapping[str, str] = field(default_factory=dict)
    seed: int | None = None
    command: str = ''
    created: str = ''


@dataclass(frozen=True)
class ResultOrigin:
    """
    Robot name, provenance and next command, for the files and the page of a result.

    Attributes
    ----------
    robot : str
        Name of the robot in documents; by default its shipped name or its path.
    source : str
        Reference to the description in model.yaml; by default the same as `robot`.
    provenance : Provenance
        Files, versions and settings that the report names.
    step : str
        Next command for the report; by default without arguments.

    """

    robot: str = ''
    source: str = ''
    provenance: Provenance = Provenance()
    step: str = ''

    def of(self, known: str) -> ResultOrigin:
        """Return a copy in which the name `known` replaces missing names of the robot."""
        return replace(self, robot=self.robot or known, source=self.source or known)


#: Shipped names and paths, without provenance.
DEFAULT_ORIGIN = ResultOrigin()


def versions() -> dict[str, str]:
    """Return the versions of Python, system and packages that may influence a result."""
    known = {'Python': platform.python_version(), 'system': platform.platform(terse=True)}
    for package in _PACKAGES:
        try:
            known[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return known
