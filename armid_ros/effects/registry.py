# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The registry of effects: shipped effects, effects of other packages, user-defined effects.

A package provides effects by an entry point of the group ``armid_ros.effects``, which names a
class or a module that registers classes. Packages are loaded when a name is not shipped, or when
all names are listed.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib.metadata import entry_points
import inspect
import logging
import re
from types import ModuleType
from typing import Protocol

from armid_ros.effects.base import Effect
from armid_ros.effects.quantities import Quantity, Shape
from armid_ros.errors import ModelError, nearest
from armid_ros.robots import Robot

#: Entry-point group of packages that provide effects.
GROUP = 'armid_ros.effects'
#: Pattern of names, which occur in files, on command lines and between '@', '+', ':' and ','.
_NAME = re.compile(r'[a-z][a-z0-9_]*')


class Kind(Protocol):
    """A kind of effect: a class of the catalogue, or an object with the same methods."""

    @property
    def name(self) -> str:
        """Return the name of the effects."""

    def on(self, robot: Robot, joints: tuple[str, ...] | None = None) -> Effect:
        """Make the effect for a robot."""

    def places(self, robot: Robot) -> tuple[tuple[str, ...], ...]:
        """Return the sets of joints of single causes."""

    def as_change(self) -> Kind:
        """Return the kind for a change between two days."""


class Catalogue(Mapping[str, type[Effect]]):
    """
    Classes of effects by name, the shipped ones first.

    Attributes
    ----------
    broken : dict of str to str
        Packages whose effects cannot be loaded, each with the reason.

    """

    def __init__(self, shipped: tuple[type[Effect], ...]) -> None:
        self._kinds = {kind.name: kind for kind in shipped}
        self._shipped = frozenset(self._kinds)
        self._complete = False
        self.broken: dict[str, str] = {}

    def __getitem__(self, name: str) -> type[Effect]:
        """Return a class by its name; packages are loaded if needed."""
        if name not in self._kinds:
            self._complete_once()
        return self._kinds[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over all names; shipped names come first."""
        self._complete_once()
        return iter(tuple(self._kinds))

    def __len__(self) -> int:
        """Return the number of all effects."""
        self._complete_once()
        return len(self._kinds)

    def find(self, name: str) -> type[Effect]:
        """
        Return a class by its name.

        Raises
        ------
        ModelError
            If the name is unknown. The message contains the nearest name or all names, and
            packages that cannot be loaded.

        """
        if name in self:
            return self[name]
        near = nearest(name, self)
        if near:
            raise ModelError(
                f"no effect '{name}'; did you mean '{near}'? 'armid effects' lists all of them"
            )
        lost = ''.join(
            f'; {package} cannot be loaded: {why}' for package, why in self.broken.items()
        )
        raise ModelError(
            f"no effect '{name}'; the catalogue has {', '.join(self)}{lost}"
            '; install a package to add its effects'
        )

    def add(self, kind: type[Effect]) -> None:
        """
        Add a class, or replace an old version of the class.

        Raises
        ------
        ModelError
            If the class is incomplete, or its name or the name of a quantity is already used.

        """
        check_kind(kind)
        there = self._kinds.get(kind.name)
        if there is not None and _home(there) != _home(kind):
            raise ModelError(
                f"the name '{kind.name}' of {_home(kind)} is already used by {_home(there)}; "
                'choose another one'
            )
        taken = {
            name: other.name
            for other in self._kinds.values()
            if other.name != kind.name
            for name in part_names(other)
        }
        for name in part_names(kind):
            if name in taken:
                raise ModelError(
                    f"{kind.name}: the name '{name}' is already used by a quantity of "
                    f'{taken[name]}; one model may contain both, so choose another name'
                )
        self._kinds[kind.name] = kind

    def remove(self, name: str) -> None:
        """Remove a class that is not shipped, if it exists."""
        if name not in self._shipped:
            self._kinds.pop(name, None)

    def _complete_once(self) -> None:
        """Load the effects of all packages, the first time."""
        if self._complete:
            return
        self._complete = True
        for entry in entry_points(group=GROUP):
            try:
                loaded = entry.load()
                if not isinstance(loaded, ModuleType):
                    self.add(loaded)
            except Exception as error:  # another package may raise any exception
                package = entry.dist.name if entry.dist else entry.value
                self.broken[package] = f'{type(error).__name__}: {error}'
                logging.getLogger('armid_ros').warning(
                    'armid_ros: effects of %s cannot be loaded: %s; repair or uninstall it',
                    package,
                    self.broken[package],
                )


def check_kind(kind: type[Effect]) -> None:
    """
    Check that a class has the required attributes of an effect.

    Raises
    ------
    ModelError
        If an attribute is missing; the message names the class and the attribute.

    """
    if not (inspect.isclass(kind) and issubclass(kind, Effect)):
        raise ModelError(f'{kind!r} is not an effect class; derive it from armid_ros.Effect')
    where = _home(kind)
    name = getattr(kind, 'name', None)
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise ModelError(f"{where}: 'name' has to be like 'viscous_friction', not {name!r}")
    lacking = sorted(getattr(kind, '__abstractmethods__', ()))
    if lacking:
        raise ModelError(f'{name} ({where}) has no {" and no ".join(lacking)}')
    summary = getattr(kind, 'summary', None)
    if not isinstance(summary, str) or not summary.strip():
        raise ModelError(f"{name} ({where}): 'summary' has to be a text of one line")
    quantities: tuple[Quantity, ...] = getattr(kind, 'quantities', ())
    if not quantities or not all(isinstance(one, Quantity) for one in quantities):
        raise ModelError(f"{name} ({where}): 'quantities' has to be a tuple of Quantity")
    if not all(isinstance(one, Shape) for one in kind.shapes):
        raise ModelError(f"{name} ({where}): 'shapes' has to be a tuple of Shape")
    names = part_names(kind)
    twice = [part for part in names if names.count(part) > 1]
    if twice:
        raise ModelError(f"{name} ({where}): two quantities are called '{twice[0]}'")


def part_names(kind: type[Effect]) -> list[str]:
    """Return the names of quantities and shapes."""
    return [*(one.name for one in kind.quantities), *(one.name for one in kind.shapes)]


def _home(kind: type[Effect]) -> str:
    return f'{kind.__module__}.{kind.__qualname__}'
