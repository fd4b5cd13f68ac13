# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Entry points that add commands and nodes: those of the fleet, of the papers and of other packages.

A package names a click command in the group ``armid_ros.commands``, and the module of a node,
which has a function ``main``, in the group ``armid_ros.nodes``. Effects have a group of their own.

"""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from typing import Any, TYPE_CHECKING

from armid_ros.errors import ArmidError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


@cache
def plug_ins(kind: str) -> dict[str, EntryPoint]:
    """
    Find plug-ins by name, without those whose folder was deleted.

    Parameters
    ----------
    kind : str
        Commands or nodes: what the name of the group ends with.

    """
    from importlib.metadata import entry_points  # commands of the core start without it

    found = entry_points(group=f'armid_ros.{kind}')
    return {entry.name: entry for entry in found if _is_there(entry.module)}


def load_plug_in(entry: EntryPoint) -> Any:
    """
    Import what an entry point names.

    Raises
    ------
    ArmidError
        If its package cannot be loaded; the message names the package and its error.
    ModuleNotFoundError
        If it needs a module that is not installed.

    """
    try:
        return entry.load()
    except ModuleNotFoundError:
        raise
    except Exception as error:  # a package of somebody else may fail in any way
        package = entry.dist.name if entry.dist else entry.module
        raise ArmidError(
            f'{package}: {entry.value} cannot be loaded: {type(error).__name__}: {error}; mend or '
            'uninstall it'
        ) from error


def _is_there(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except ModuleNotFoundError:
        return False
    except Exception:  # the package of a module fails: loading it reports how
        return True
