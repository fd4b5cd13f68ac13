# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Errors that a user can cause; each message names the fault, its place and the remedy."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def nearest(name: str, names: Iterable[str]) -> str:
    """Return the known name with the most similar spelling; empty if none is similar."""
    # 0.75: up to a quarter of the letters may differ
    return next(iter(get_close_matches(name, list(names), 1, 0.75)), '')


def meant(name: str, names: Iterable[str]) -> str:
    """Return a suggestion such as "; did you mean 'elbow'?"; empty if no name is similar."""
    found = nearest(name, names)
    return f"; did you mean '{found}'?" if found else ''


def visible(text: str) -> str:
    """Return a text, safe to print on a terminal, with its control characters escaped."""
    if text.isprintable():
        return text
    return ''.join(c if c.isprintable() or c in '\n\t' else repr(c)[1:-1] for c in text)


class ArmidError(Exception):
    """
    Base class of errors caused by bad input; commands print them and exit with code 2.

    Examples
    --------
    >>> import armid_ros as ar
    >>> try:
    ...     ar.load_robot('nowhere.urdf')
    ... except ar.ArmidError as error:
    ...     print(error)
    nowhere.urdf: neither a file nor a shipped robot; shipped robots: humanoid_arm, ...

    """

    def __str__(self) -> str:
        """Return the message with escaped control characters."""
        return visible(super().__str__())


class RobotError(ArmidError):
    """Error in a robot description, such as an invalid URDF."""


class RecordingError(ArmidError):
    """Error if a recording cannot be read, or does not fit the robot."""


class ModelError(ArmidError):
    """Error in a model file, an effect or a set of parameters."""


class TrajectoryError(ArmidError):
    """Error if a trajectory violates limits, or if no valid trajectory is found."""


class IdentificationError(ArmidError):
    """Error if no model can be identified from the data with the chosen settings."""


class RecordingEnded(RecordingError):
    """Error that ends a recording: the disk is full or the file was removed."""


class OutputError(ArmidError):
    """Error in writing a result, such as a folder that contains another result."""


class FleetError(ArmidError):
    """Error that prevents a run over a fleet of arms from starting or continuing."""
