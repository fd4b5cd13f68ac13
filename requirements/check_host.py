# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Say in one line what this machine lacks, before anything is installed on it.

Runs on any Python 3, so that an unsupported one is named and not met with a syntax error.

"""

import os
from pathlib import Path
import shutil
import sys
import sysconfig

SUPPORTED = ((3, 11), (3, 12))
ENVIRONMENT = os.environ.get('VENV', '.venv')
COMPILERS = (
    ('C', 'CC', ('cc', 'gcc', 'clang')),
    ('C++', 'CXX', ('c++', 'g++', 'clang++')),
)


def missing():
    """Return the first thing that is missing and what to do about it; None when all is there."""
    version = '.'.join(str(number) for number in sys.version_info[:3])
    if tuple(sys.version_info[:2]) not in SUPPORTED:
        return (
            f'Python 3.11 or 3.12 is needed (ROS 2 Jazzy has wheels for these), and '
            f'{sys.executable} is {version}: name another one, as in '
            f'`make PYTHON=/path/to/python3.12`'
        )
    made_with = environment_version()
    if made_with not in (None, tuple(sys.version_info[:2])):
        return (
            f'{ENVIRONMENT} was made with Python {made_with[0]}.{made_with[1]} and '
            f'{sys.executable} is {version}: run `make clean` first'
        )
    try:
        import ensurepip  # noqa: F401
        import venv  # noqa: F401
    except ImportError:
        return f'{sys.executable} has no venv module: install it (Debian: python3-venv)'
    if not Path(sysconfig.get_path('include'), 'Python.h').exists():
        return (
            f'{sys.executable} has no C headers, which compiling armid_msgs needs: install them '
            f'(Debian: python3-dev), or name a Python that has them, `make PYTHON=...`'
        )
    for language, variable, names in COMPILERS:
        chosen = os.environ.get(variable)
        if not any(shutil.which(name) for name in (chosen.split()[:1] if chosen else names)):
            return (
                f'there is no {language} compiler ({chosen or ", ".join(names)}): install one '
                f'(Debian: g++), or set {variable}'
            )
    return None


def environment_version():
    """Return (major, minor) of the Python that the environment was made with; None without one."""
    try:
        lines = Path(ENVIRONMENT, 'pyvenv.cfg').read_text().splitlines()
    except OSError:
        return None
    fields = dict(line.split(' = ', 1) for line in lines if ' = ' in line)
    return tuple(int(number) for number in fields.get('version', '0.0').split('.')[:2])


if __name__ == '__main__':
    problem = missing()
    if problem:
        sys.exit(f'armid_ros: {problem}')
