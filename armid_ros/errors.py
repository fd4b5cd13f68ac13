# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Errors that a user can cause; each message names the fault, its place and the remedy."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def nearest(name: str, names: Iterable[str]) -> str:
    """Return the name that is most similar to a text; empty if none is similar enough."""
    # up to a quarter of the letters may differ
    return next(iter(get_close_matches(name, list(names), 1, 0.75)), '')


def meant(name: str, names: Iterable[str]) -> str:
    """Return the suggestion "; did you mean 'NAME'?"; empty if no name is similar."""
    found = nearest(name, names)
    return f"; did you mean '{found}'?" if found else ''


def visible(text: str) -> str:
    """
    Return a text with escaped control characters, safe for a terminal.

    Names come from files and messages; their escape sequences must not control the terminal.

    """
    if text.isprintable():
        return text
    return ''.join(c if c.isprintable() or c in '\n\t' else repr(c)[1:-1] for c in text)


class ArmidError(Exception):
    """
    Base class of errors from bad input; the command line prints the message and exits with 2.

    Examples
    --------
    >>> import armid_ros as ar
    >>> try:
    ...     ar.load_robot('nowhere.urdf')
    ... except ar.ArmidError as error:
    ...     print(error)
    nowhere.urdf: neither a file nor a shipped robot; shipped are humanoid_arm, ...

    """

    def __str__(self) -> str:
        """Return the message with escaped control characters."""
        return visible(super().__str__())


class RobotError(ArmidError):
    """A robot description cannot be used."""


class RecordingError(ArmidError):
    """A recording cannot be read, or does not fit the robot."""


class ModelError(ArmidError):
    """A model file, an effect or a parameter set is not valid."""


class TrajectoryError(ArmidError):
    """A trajectory violates the limits of the robot, or no trajectory satisfies them."""


class IdentificationError(ArmidError):
    """The data do not determine the parameters."""


class RecordingEnded(RecordingError):
    """Recording cannot continue: the disk is full, or the file was removed."""


class OutputError(ArmidError):
    """A result cannot be written, or would overwrite another one."""


class FleetError(ArmidError):
    """A run over a fleet cannot start or cannot continue."""
