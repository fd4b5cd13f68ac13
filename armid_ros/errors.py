# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The errors a user can cause; each message says what is wrong, where, and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

#: Likeness, from 0 to 1, from which a name is meant by another: one letter in four may differ.
_ALIKE = 0.75


def nearest(name: str, names: Iterable[str]) -> str:
    """Return the one of some names that was meant by a name; empty if none is like it."""
    return next(iter(get_close_matches(name, list(names), 1, _ALIKE)), '')


def meant(name: str, names: Iterable[str]) -> str:
    """Return the question whether the nearest name was meant, to go into a message, or nothing."""
    found = nearest(name, names)
    return f"; did you mean '{found}'?" if found else ''


def visible(text: str) -> str:
    """
    Return a text as it may go to a terminal: control characters are spelled out.

    Names come from files and messages; an escape sequence in one must not move the cursor.

    """
    if text.isprintable():
        return text
    return ''.join(c if c.isprintable() or c in '\n\t' else repr(c)[1:-1] for c in text)


class ArmidError(Exception):
    """
    Base of every error that bad input can cause; the command line prints it and exits 2.

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
        """Return the message, fit for a terminal."""
        return visible(super().__str__())


class RobotError(ArmidError):
    """A robot description cannot be used."""


class RecordingError(ArmidError):
    """A recording cannot be read, or does not fit the robot."""


class ModelError(ArmidError):
    """A model file, an effect or a parameter set is not valid."""


class TrajectoryError(ArmidError):
    """A trajectory violates the limits of the robot, or cannot be made within them."""


class IdentificationError(ArmidError):
    """The data cannot identify what was asked."""


class RecordingEnded(RecordingError):
    """A recording cannot go on: its disk is full, or its file is gone."""


class OutputError(ArmidError):
    """A result cannot be written, or would take the place of another one."""


class FleetError(ArmidError):
    """A run over a fleet cannot begin, or cannot go on."""
