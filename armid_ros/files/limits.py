# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Limit of the memory that an input may take."""

from __future__ import annotations

import os
from pathlib import Path
import resource

#: Memory over the default limit of one input.
_SHARE = 4
_CONTROL_GROUP = Path('/sys/fs/cgroup/memory.max')


def default_memory_limit() -> int:
    """Return the memory limit of one input: a quarter of the memory [bytes]."""
    bounds = [os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES')]
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY:
        bounds.append(limit)
    try:
        bounds.append(int(_CONTROL_GROUP.read_text(encoding='ascii')))
    except (OSError, ValueError):  # no control group, or 'max'
        pass
    return min(bounds) // _SHARE


def size_text(size: int) -> str:
    """Return a number of bytes as text with a unit, such as '1.5 MB'."""
    for unit, scale in (('GB', 10**9), ('MB', 10**6), ('kB', 10**3)):
        if size >= scale:
            return f'{size / scale:.3g} {unit}'
    return f'{size} bytes'
