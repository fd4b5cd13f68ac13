# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Run a node in its own process until it is finished or a signal arrives."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
import faulthandler
import gc
import inspect
import os
from pathlib import Path
import re
import signal
import sys
import textwrap

from armid_ros.errors import ArmidError
from armid_ros.nodes.base import ArmidNode, COMMON
from armid_ros.nodes.parameters.table import ParameterError
import rclpy
from rclpy._rclpy_pybind11 import RCLError, RCLInvalidROSArgsError, UnknownROSArgsError
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from threadpoolctl import threadpool_limits

#: Syntax of ROS arguments.
_SYNTAX = 'write --ros-args -p NAME:=VALUE -r NAME:=OTHER_NAME --params-file FILE, and see --help'
#: Timeout of the shutdown of DDS [s].
SHUTDOWN_TIMEOUT = 20.0


@contextmanager
def steady() -> Iterator[None]:
    """
    Limit linear algebra to one thread, and exclude existing objects from garbage collection.

    For matrices of a hundred rows, the synchronisation of threads takes longer than the
    computation: 20 ms instead of 0.2 ms if the second core is busy. A garbage collection of the
    objects of imported libraries would stop the process for 70 ms.

    """
    gc.collect()
    gc.freeze()
    try:
        with threadpool_limits(limits=1):
            yield
    finally:
        gc.unfreeze()


class _Ending:
    """Handler of signals, which end the process of a node between two callbacks."""

    # A node must publish the stop of an arm after a signal, but the handlers of rclpy shut down
    # its context. During the construction of a node, SIGINT and SIGTERM end the process at once.

    def __init__(self) -> None:
        self._requested = self._at_once = self.with_parent = self.hung_up = False
        self._parent = os.getppid()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)
        # ignored signals stay ignored, as under nohup
        if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
            signal.signal(signal.SIGHUP, self._on_signal)

    @property
    def due(self) -> bool:
        """Whether the process must end, after a signal or the end of the parent process."""
        ended = self.with_parent and os.getppid() != self._parent
        return self._requested or self.hung_up or ended

    @contextmanager
    def at_once(self) -> Iterator[None]:
        """Let signals end the process immediately during a `with` block."""
        self._at_once = True
        try:
            yield
        finally:
            self._at_once = False

    def _on_signal(self, number: int, _: object) -> None:
        if number == signal.SIGHUP:
            self.hung_up = True
            return
        self._requested = True
        if self._at_once:
            self._at_once = False  # `ros2 launch` sends a second one
            raise _EndedAtOnce


class _EndedAtOnce(BaseException):
    """Exception that a signal raises during the construction of a node, for `run`."""


def run(make_node: Callable[[], ArmidNode], args: Sequence[str] | None = None) -> None:
    """
    Run a node until it is finished or a signal arrives; with --help, print its help.

    Raises
    ------
    SystemExit
        After one line on stderr: with status 2 if the node cannot be made or its task failed, with
        status 1 after a fatal error or SIGHUP.

    """
    given = list(sys.argv[1:] if args is None else args)
    own = given[: given.index('--ros-args')] if '--ros-args' in given else given
    if isinstance(make_node, type) and {'-h', '--help'} & set(own):
        print(usage(make_node))
        return
    node: ArmidNode | None = None
    trouble: list[str] = []
    ending = _Ending()
    try:
        with ending.at_once():
            node = _made(make_node, args)
        # not the multi-threaded executor, which delays topics above 100 Hz
        kinds = {'events': EventsExecutor, 'single': SingleThreadedExecutor}
        executor = kinds[node.value('executor')]()
        executor.add_node(node)
        ending.with_parent = node.value('end_with_parent')
        node.ends = lambda: ending.due
        with steady():
            while rclpy.ok() and not (node.finished or ending.due):
                executor.spin_once(timeout_sec=0.1)  # without this, the events executor hangs
    except (_EndedAtOnce, ExternalShutdownException):
        pass
    except RCLError:  # the context was shut down between the check and the wait
        if rclpy.ok():
            raise
    except ArmidError as error:
        trouble.append(str(error))
    finally:
        trouble += _shut_down(node)
    if ending.hung_up:
        trouble.append('ended by SIGHUP, as by a terminal that is closed')
    if node is not None and node.failure:
        trouble.append(node.failure)
    if trouble:
        with suppress(OSError):  # the terminal may be closed
            print('; '.join(trouble), file=sys.stderr)
        raise SystemExit(2 if node is None or node.failure else 1)


def _made(make_node: Callable[[], ArmidNode], args: Sequence[str] | None) -> ArmidNode:
    """Initialise ROS, and create and return a node; ParameterError for invalid arguments."""
    own = sys.argv[1:] if args is None else args
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except (RCLError, RCLInvalidROSArgsError, UnknownROSArgsError) as error:
        raise ParameterError(unreadable(error)) from error
    others = remove_ros_args(['', *own])[1:]
    if others:
        raise ParameterError(f'{" ".join(others)}: unknown arguments; {_SYNTAX}')
    node = make_node()
    node.warn_of_unknown()
    return node


def _shut_down(node: ArmidNode | None) -> list[str]:
    """Close a node and shut down ROS; return error messages."""
    # Under `ros2 launch` Ctrl-C arrives twice; the second must not interrupt closing.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    trouble: list[str] = []
    if node is not None:
        try:
            node.close()
        except ArmidError as error:
            trouble.append(str(error))
    # Fast DDS waits for other processes with shared memory, and never ends if one was killed.
    # The watchdog, a thread in C, prints the stack of the process and ends it.
    faulthandler.dump_traceback_later(SHUTDOWN_TIMEOUT, exit=True, file=sys.__stderr__)
    if node is not None:
        node.destroy_node()
    rclpy.try_shutdown()
    faulthandler.cancel_dump_traceback_later()
    return trouble


def unreadable(error: Exception) -> str:
    """
    Return a readable message on invalid ROS arguments, with the correct syntax.

    Parameters
    ----------
    error : Exception
        Exception that rclpy raised for the arguments.

    """
    text = re.sub(r',? at /\S+:\d+', '', str(error)).removeprefix('failed to initialize rcl: ')
    return f'{" ".join(text.split())}; {_SYNTAX}'


def usage(node: type[ArmidNode]) -> str:
    """
    Return the help text of a node: its purpose and its parameters.

    Parameters
    ----------
    node : type
        Class of the node; its module has the name of the executable.

    """
    program = Path(inspect.getfile(node)).stem
    purpose = inspect.getdoc(node) or ''
    lines = []
    for parameter in (*node.table, *COMMON):
        value, text = parameter.default, parameter.text()
        if parameter.limits is not None:
            text += f' {parameter.limits[0]:g} to {parameter.limits[1]:g}.'
        written = str(value).lower() if isinstance(value, bool) else str(value)
        lines.append(
            f"  {parameter.name}:='{value}'"
            if isinstance(value, str)
            else f'  {parameter.name}:={written}'
        )
        lines += textwrap.wrap(text, 99, initial_indent=' ' * 6, subsequent_indent=' ' * 6)
    parts = [
        f'Usage: {program} --ros-args -p NAME:=VALUE ... -r TOPIC:=OTHER_TOPIC ...',
        purpose.partition('\nAttributes\n')[0].strip(),
        'Parameters, with their defaults:',
        '\n'.join(lines),
    ]
    return '\n\n'.join(parts)
