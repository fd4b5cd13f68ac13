# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Options that belong together reach a command as one settings object."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import wraps
from pathlib import Path
from typing import Any

from armid_ros.cli import options
from armid_ros.identification import SignalSettings
from armid_ros.robots import Robot


def gathered(**kinds: type[Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """
    Give a command settings objects in place of the options that are their fields.

    It stands below the options, next to the function.

    Parameters
    ----------
    **kinds : dataclass
        By the name of the parameter that takes it; every field has the name of an option.

    """

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def call(**values: Any) -> Any:
            made = {
                name: kind(**{field.name: values.pop(field.name) for field in fields(kind)})
                for name, kind in kinds.items()
            }
            return command(**made, **values)

        call.gathered = kinds  # type: ignore[attr-defined]
        return call

    return decorate


@dataclass(frozen=True)
class RobotChoice:
    """
    The robot that is meant, as ``options.robot``, ``gravity`` and ``joints`` have it.

    Attributes
    ----------
    robot_source : str
        Shipped name, path, or '-' for the description in a bag.
    gravity : str
        A name, or a vector [m/s^2].
    joints : str or None
        Driven joints with commas.

    """

    robot_source: str
    gravity: str
    joints: str | None

    def load(self, bags: Sequence[Path] = (), tell: bool = True) -> Robot:
        """Load it; say what is not driven."""
        return options.open_robot(self.robot_source, self.gravity, self.joints, bags, tell)


@dataclass(frozen=True)
class FilterOptions:
    """
    How signals are filtered.

    Attributes
    ----------
    cutoff : float or None
        Of the position filter [Hz].
    decimation : int or None
        One sample of this many is kept.

    """

    cutoff: float | None
    decimation: int | None

    def settings(self) -> SignalSettings:
        """Return what identification takes."""
        return SignalSettings(self.cutoff, self.decimation)
