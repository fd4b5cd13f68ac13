# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Expansion of xacro files in a separate process, and search for ROS packages without ROS.

A xacro file is a program: it can include any readable file, read environment variables and loop
without end. It is therefore expanded in a separate process with limits of time and memory, and
only if a person names the file. A description from a topic or a bag is never expanded. This file
is also the program of that process, so it imports nothing from the package at its start. The
process reads its request from stdin and writes its answer to stdout, both in JSON.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
import difflib
import json
import os
from pathlib import Path
import re
import resource
import signal
import subprocess
import sys
from typing import Any

#: Largest processor time of an expansion [s]; the largest descriptions take 1 to 2 s.
TIME_LIMIT = 20.0
#: Largest elapsed time of an expansion [s]; this ends an expansion that waits for a file.
ELAPSED_LIMIT = 300.0
#: Largest memory of an expansion [bytes].
MEMORY_LIMIT = 2 << 30
#: Placeholder for the folder of a package that is not found.
_MISSING_PACKAGE = '/package-not-found/'
#: Names of includes and macros for drives and simulators, which define no link or joint.
_DRIVER_WORDS = ('ros2_control', 'ros_control', 'gazebo', 'transmission')


def expand_xacro(path: Path, arguments: Mapping[str, str], packages: Mapping[str, str]) -> str:
    """
    Return the expanded text of a xacro file.

    Parameters
    ----------
    path : Path
        The file. It is trusted like a program; only its time and memory are limited.
    arguments : mapping of str to str
        Values of <xacro:arg>.
    packages : mapping of str to str
        Folders by name of packages that `package_folders` does not find.

    Raises
    ------
    RobotError
        If the file cannot be expanded within the limits.

    """
    from armid_ros.errors import RobotError

    request = {
        'path': str(path),
        'arguments': dict(arguments),
        'packages': dict(packages),
        'seconds': TIME_LIMIT,
        'memory': MEMORY_LIMIT,
    }
    command = [sys.executable, '-P', __file__]
    try:
        done = subprocess.run(
            command,
            input=json.dumps(request),
            capture_output=True,
            encoding='utf-8',
            errors='replace',
            timeout=ELAPSED_LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise RobotError(f'{path}: xacro did not finish within {ELAPSED_LIMIT:g} s') from error
    except OSError as error:
        raise RobotError(f'{path}: xacro: cannot be started: {error.strerror}') from error
    if -done.returncode in (signal.SIGPROF, signal.SIGXCPU, signal.SIGKILL):
        raise RobotError(
            f'{path}: xacro did not finish within {TIME_LIMIT:g} s of processor time or '
            f'{MEMORY_LIMIT >> 20} MiB of memory; does a macro call itself without end?'
        )
    answer: dict[str, Any] = {}
    with suppress(ValueError):  # the process ended without an answer
        answer = json.loads(done.stdout)
    if 'text' not in answer:
        reason = answer.get('error') or f'needs more than {MEMORY_LIMIT >> 20} MiB of memory'
        raise RobotError(f'{path}: xacro: {reason}')
    return str(answer['text'])


def package_folders(
    name: str, file: Path | None, given: Mapping[str, str | Path] | None = None
) -> Iterator[Path]:
    """
    Yield the possible folders of a ROS package, the most likely folder first.

    Parameters
    ----------
    name : str
        Name of the package.
    file : Path or None
        The description that refers to it.
    given : mapping of str to str or Path, optional
        Folders of packages by name; a package in this mapping is not searched elsewhere.

    Yields
    ------
    Path
        The given folder, if any. Otherwise, in this order: folders whose package.xml has the name,
        which enclose the file or are next to an enclosing folder; such folders in
        ROS_PACKAGE_PATH; the folder in AMENT_PREFIX_PATH; folders of that name without a
        package.xml, which enclose the file or are next to an enclosing folder.

    """
    if given and name in given:
        yield Path(given[name])
        return
    around = [] if file is None else list(file.resolve().parents)
    path = [Path(part) for part in _paths('ROS_PACKAGE_PATH')]
    for root in (*around, *path):
        yield from _packages(root, name)
    yield from (Path(prefix) / 'share' / name for prefix in _paths('AMENT_PREFIX_PATH'))
    yield from (root / name for root in (*around, *path, *(root.parent for root in path)))


def _packages(root: Path, name: str) -> Iterator[Path]:
    """Yield folders, at most two levels deep, that contain a package.xml with this name."""
    folders = [root]
    if root != root.parent:
        with suppress(OSError):
            inside = sorted(Path(entry.path) for entry in os.scandir(root) if entry.is_dir())
            folders += [root / name, *inside, *(folder / name for folder in inside)]
    for folder in folders:
        try:
            text = (folder / 'package.xml').read_text(encoding='utf-8', errors='replace')
        except OSError:
            continue
        found = re.search(r'<name>\s*([^<]*?)\s*</name>', text)
        if found is not None and found[1] == name:
            yield folder


def _paths(variable: str) -> list[str]:
    return [part for part in os.environ.get(variable, '').split(os.pathsep) if part]


def main() -> None:
    """Expand the xacro file requested on stdin; memory and processor time are limited."""
    request = json.load(sys.stdin)
    answers = os.fdopen(os.dup(1), 'w', encoding='utf-8')
    os.dup2(2, 1)  # output of the expansion must not mix with the answer
    seconds, memory = float(request['seconds']), int(request['memory'])
    signal.setitimer(signal.ITIMER_PROF, seconds)
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 1))
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    json.dump(expanded(request), answers)
    answers.close()


class _Arguments(dict[str, str]):
    """Arguments of a xacro file, and all argument names that the file declares or uses."""

    def __init__(self, given: Mapping[str, str]) -> None:
        super().__init__(given)
        self.known: dict[str, None] = {}

    def __contains__(self, name: object) -> bool:
        self.known[str(name)] = None
        return super().__contains__(name)

    def __getitem__(self, name: str) -> str:
        self.known[name] = None
        return super().__getitem__(name)


def expanded(request: dict[str, Any]) -> dict[str, str]:
    """Expand the requested xacro file; return its text, or an error message."""
    answer: dict[str, str] = {}
    missing: dict[str, str] = {}
    arguments = _Arguments(request['arguments'])
    try:
        import xacro.substitution_args

        _find_packages(xacro, request, missing)
        text = str(xacro.process_file(request['path'], mappings=arguments).toxml())
        unknown = [name for name in request['arguments'] if name not in arguments.known]
        if unknown:
            near = difflib.get_close_matches(unknown[0], arguments.known, 1, 0.75)
            guess = f" (did you mean '{near[0]}'?)" if near else ''
            path = request['path']
            text = f"the file has no argument '{unknown[0]}'{guess}; grep '<xacro:arg' {path}"
            return {'error': f'{text} lists them'}
        answer['text'] = text.replace(f'file://{_MISSING_PACKAGE}', 'package://')
        answer['text'] = answer['text'].replace(_MISSING_PACKAGE, 'package://')
    except ImportError:
        answer['error'] = 'a xacro file needs the Python package xacro'
    except MemoryError:
        answer['error'] = 'takes too much memory'
    except RecursionError:
        answer['error'] = 'nested too deep'
    except SystemExit:
        answer['error'] = 'the file cannot be expanded'
    except Exception as error:  # xacro evaluates Python expressions, which can raise any error
        answer['error'] = _reason(error, request, missing)
        if arguments:
            shown = ' '.join(f'{name}:={value}' for name, value in arguments.items())
            answer['error'] += f'; its arguments are {shown}'
    return answer


def _find_packages(xacro: Any, request: dict[str, Any], missing: dict[str, str]) -> None:
    """Make xacro find packages without ROS, and skip packages that a robot model does not need."""
    # a missing package is an error only if its files are read, because drivers only name paths
    arguments = xacro.substitution_args
    include_files, macro_call = xacro.get_include_files, xacro.handle_macro_call

    def find(name: str) -> str:
        places = package_folders(name, Path(xacro.filestack[-1]), request['packages'])
        found = next((place for place in places if place.is_dir()), None)
        if found is None:
            missing.setdefault(name, _place(xacro))
        return _MISSING_PACKAGE + name if found is None else str(found)

    def include(*values: Any) -> Iterator[str]:
        for file in include_files(*values):
            if not (_MISSING_PACKAGE in file and any(word in file for word in _DRIVER_WORDS)):
                yield file

    def call(node: Any, *values: Any) -> bool:
        try:
            return bool(macro_call(node, *values))
        except xacro.XacroException as error:
            name = node.tagName
            if not (missing and f'unknown macro name: {name}' == str(error)):
                raise
            if not any(word in name for word in _DRIVER_WORDS):
                raise
            xacro.replace_node(node, by=None)
            return True

    arguments._eval_find = arguments._eval_dict['find'] = find
    xacro.get_include_files, xacro.handle_macro_call = include, call


def _reason(error: Exception, request: dict[str, Any], missing: dict[str, str]) -> str:
    """Return why a xacro file cannot be expanded, with a remedy."""
    import xacro.substitution_args

    text = ' '.join(str(error).split()) or type(error).__name__
    cause = error.exc if isinstance(error, xacro.XacroException) else None
    place, path = _place(xacro), str(request['path'])
    if isinstance(cause, xacro.substitution_args.ArgException):
        values = {str(cause): 'VALUE'} | request['arguments']
        written = ' '.join(f'{one}:={value}' for one, value in values.items())
        return (
            f"{'the file' if place == path else place} uses the argument '{cause}', which has no "
            f"value there; write --robot '{path} {written}'; grep '<xacro:arg' {path} lists the "
            'others'
        )
    if missing:
        lines = '; '.join(f"package '{name}' ({file})" for name, file in missing.items())
        first = next(iter(missing))
        return f'not found: {lines}; clone or install, or add --package {first}=FOLDER ({text})'
    return text if place == path else f'{place}: {text}'


def _place(xacro: Any) -> str:
    """Return the path of the file or macro that xacro expands at present."""
    macros, files = xacro.macrostack, xacro.filestack
    return str(macros[-1].history[-1][-1] if macros else files[-1])


if __name__ == '__main__':
    main()
