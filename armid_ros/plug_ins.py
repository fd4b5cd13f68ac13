# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Commands and nodes of plug-ins, found by the entry points of installed packages.

The fleet, the papers and packages of other authors are plug-ins. A package names a click command
in the group ``armid_ros.commands``. It names the module of a node, which has a function ``main``,
in the group ``armid_ros.nodes``. Effects have a separate group.

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
    Return the entry points of all installed plug-ins by name, if their modules exist.

    Parameters
    ----------
    kind : str
        'commands' or 'nodes', the last part of the name of the group.

    """
    from importlib.metadata import entry_points  # slow import, which core commands do not need

    found = {}
    for entry in entry_points(group=f'armid_ros.{kind}'):
        try:
            there = find_spec(entry.module) is not None
        except ModuleNotFoundError:
            there = False
        except Exception:  # load_plug_in reports this error
            there = True
        if there:
            found[entry.name] = entry
    return found


def load_plug_in(entry: EntryPoint) -> Any:
    """
    Import and return the command or module that the entry point of a plug-in names.

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
    except Exception as error:  # a package of another author may raise any error
        package = entry.dist.name if entry.dist else entry.module
        raise ArmidError(
            f'{package}: the plug-in {entry.value} cannot be imported: {type(error).__name__}: '
            f'{error}; repair or uninstall the package'
        ) from error
