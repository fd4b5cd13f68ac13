# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that can be hidden, by name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from tests.hidden.base import HiddenEffect
from tests.hidden.drive import DRIVE
from tests.hidden.friction import FRICTION
from tests.hidden.load import LOAD
from tests.hidden.outside import OUTSIDE
from tests.hidden.sensing import SENSING
from tests.hidden.springs import SPRINGS

_ALL: tuple[type[HiddenEffect], ...] = (*FRICTION, *SENSING, *LOAD, *DRIVE, *SPRINGS, *OUTSIDE)

HIDDEN: Mapping[str, type[HiddenEffect]] = MappingProxyType({e.name: e for e in _ALL})

#: Names that the diagnosis can give.
CATALOGUED = tuple(name for name, effect in HIDDEN.items() if effect.in_catalogue)

#: Names of what it should call unknown.
OUTSIDE_NAMES = tuple(name for name, effect in HIDDEN.items() if not effect.in_catalogue)
