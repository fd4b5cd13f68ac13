# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Cases that are made once: kept in the folder that ARMID_LIVED_CACHE names, if it names one.

A case is kept under the sources it was made by, so that none outlives a change of the generator.

"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from hashlib import sha256
import os
from pathlib import Path
import pickle
from typing import TypeVar

Made = TypeVar('Made')

_HERE = Path(__file__).parent


def kept(name: str, make: Callable[[], Made]) -> Made:
    """
    Return what was kept under a name, or make and keep it.

    Parameters
    ----------
    name : str
        Name of a file.
    make : callable
        Makes it.

    """
    folder = os.environ.get('ARMID_LIVED_CACHE')
    if not folder:
        return make()
    path = Path(folder) / _sources() / f'{name}.pickle'
    if path.exists():
        made: Made = pickle.loads(path.read_bytes())
        return made
    made = make()
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_suffix(f'.{os.getpid()}')
    beside.write_bytes(pickle.dumps(made))
    beside.replace(path)
    return made


@cache
def _sources() -> str:
    """Return a name for the generator as it is."""
    paths = [*_HERE.rglob('*.py'), *_HERE.parent.glob('*.py')]
    sources = sorted(path for path in paths if not path.name.startswith('test_'))
    return sha256(b''.join(path.read_bytes() for path in sources)).hexdigest()[:16]
