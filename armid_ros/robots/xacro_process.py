# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The process that expands one xacro file; started by `armid_ros.robots.xacro_expansion`.

The request is read from stdin and the answer is written to stdout, both in JSON. The process
limits its memory and processor time before it reads the file.

"""

from __future__ import annotations

from collections.abc import Iterator
import difflib
import json
import os
from pathlib import Path
import re
import resource
import runpy
import signal
import sys
from typing import Any

#: Placeholder for the folder of a package that is not found.
NOWHERE = '/package-not-found/'
#: Names of includes and macros for drives and simulators, which define no link or joint.
DRIVES = ('ros2_control', 'ros_control', 'gazebo', 'transmission')


def main() -> None:
    """Read one request and write the answer."""
    request = json.load(sys.stdin)
    answers = os.fdopen(os.dup(1), 'w', encoding='utf-8')
    os.dup2(2, 1)  # output of the expansion must not mix with the answer
    seconds, memory = float(request['seconds']), int(request['memory'])
    signal.setitimer(signal.ITIMER_PROF, seconds)
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 1))
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    json.dump(expanded(request), answers)
    answers.close()


def expanded(request: dict[str, Any]) -> dict[str, str]:
    """Return the expanded text of a file, or the error message."""
    answer: dict[str, str] = {}
    missing: dict[str, str] = {}
    try:
        import xacro.substitution_args

        _find_packages(xacro, request, missing)
        document = xacro.process_file(request['path'], mappings=dict(request['arguments']))
        text = str(document.toxml())
        unknown = _unknown(xacro, request) if request['arguments'] else ''
        if unknown:
            return {'error': unknown}
        answer['text'] = text.replace(f'file://{NOWHERE}', 'package://')
        answer['text'] = answer['text'].replace(NOWHERE, 'package://')
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
    return answer


def _find_packages(xacro: Any, request: dict[str, Any], missing: dict[str, str]) -> None:
    """Make xacro find packages without ROS and skip packages of drives and simulators."""
    # a missing package is an error only if one of its files is read: drivers name paths
    folders = runpy.run_path(str(Path(__file__).with_name('packages.py')))['package_folders']
    arguments = xacro.substitution_args
    include_files, macro_call = xacro.get_include_files, xacro.handle_macro_call

    def find(name: str) -> str:
        places = folders(name, Path(xacro.filestack[-1]), request['packages'])
        found = next((place for place in places if place.is_dir()), None)
        if found is None:
            missing.setdefault(name, _place(xacro))
        return NOWHERE + name if found is None else str(found)

    def include(*values: Any) -> Iterator[str]:
        for file in include_files(*values):
            if not (NOWHERE in file and any(word in file for word in DRIVES)):
                yield file

    def call(node: Any, *values: Any) -> bool:
        try:
            return bool(macro_call(node, *values))
        except xacro.XacroException as error:
            name = node.tagName
            if not (missing and f'unknown macro name: {name}' == str(error)):
                raise
            if not any(word in name for word in DRIVES):
                raise
            xacro.replace_node(node, by=None)
            return True

    arguments._eval_find = arguments._eval_dict['find'] = find
    xacro.get_include_files, xacro.handle_macro_call = include, call


def _reason(error: Exception, request: dict[str, Any], missing: dict[str, str]) -> str:
    """Return why a file cannot be expanded, and a remedy."""
    import xacro.substitution_args

    text = ' '.join(str(error).split()) or type(error).__name__
    cause = error.exc if isinstance(error, xacro.XacroException) else None
    if isinstance(cause, xacro.substitution_args.ArgException):
        name, path = str(cause), str(request['path'])
        declared = _declared(xacro, path)
        given = {_near(one, declared) or one: value for one, value in request['arguments'].items()}
        default = declared.get(name)
        without = [one for one, value in declared.items() if value is None]
        needed = dict.fromkeys([*without, name], 'VALUE')
        why = 'which is not given'
        if default is not None:  # <xacro:arg> is below
            why = f"above the line with its default, '{default}'"
            needed[name] = default if re.fullmatch(r'[\w./-]+', default) else 'VALUE'
        written = ' '.join(f'{one}:={value}' for one, value in (needed | given).items())
        rest = _unknown(xacro, request) or f"grep '<xacro:arg' {path} lists the others"
        place = _place(xacro)
        return (
            f"{'the file' if place == path else place} uses the argument '{name}', {why}; "
            f"write --robot '{path} {written}'; {rest}"
        )
    if missing:
        lines = '; '.join(f"package '{name}' ({file})" for name, file in missing.items())
        first = next(iter(missing))
        return f'not found: {lines}; clone or install it, or add --package {first}=FOLDER ({text})'
    place = _place(xacro)
    return text if place == request['path'] else f'{place}: {text}'


def _unknown(xacro: Any, request: dict[str, Any]) -> str:
    """Return a message on arguments that no file declares or uses; '' if there are none."""
    path, declared = str(request['path']), _declared(xacro, request['path'])
    files = [Path(file) for file in (path, *xacro.all_includes)]
    texts = [file.read_text('utf-8', 'replace') for file in files if file.is_file()]
    unknown = []
    for name in request['arguments']:
        used = re.compile(rf'\$\(arg\s+{re.escape(name)}\s*\)')
        if name not in declared and not any(used.search(text) for text in texts):
            near = _near(name, declared)
            unknown.append(f"'{name}'" + (f" (did you mean '{near}'?)" if near else ''))
    if not unknown:
        return ''
    return f"the file has no argument {', '.join(unknown)}; grep '<xacro:arg' {path} lists them"


def _near(name: str, declared: dict[str, str | None]) -> str:
    """Return the declared argument with the most similar name; '' if none is similar."""
    return next(iter(difflib.get_close_matches(name, declared, 1, 0.75)), '')


def _place(xacro: Any) -> str:
    """Return the file in expansion: the file of the macro, if a macro is expanded."""
    macros, files = xacro.macrostack, xacro.filestack
    return str(macros[-1].history[-1][-1] if macros else files[-1])


def _declared(xacro: Any, path: str) -> dict[str, str | None]:
    """Return the declared arguments with their default; None where one has to be given."""
    known: dict[str, str | None] = {}
    for file in (path, *xacro.all_includes):
        try:
            elements = xacro.parse(None, file).getElementsByTagName('xacro:arg')
        except Exception:  # the error of the main file is reported elsewhere
            continue
        for element in elements:
            default = element.getAttribute('default') if element.hasAttribute('default') else None
            known[element.getAttribute('name')] = default
    return known


if __name__ == '__main__':
    main()
