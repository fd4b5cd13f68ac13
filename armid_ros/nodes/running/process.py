# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A node as a process of its own: started in one line, ended quietly."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
import faulthandler
import gc
import os
from pathlib import Path
import signal
import sys

from armid_ros.errors import ArmidError
from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.parameters.table import ParameterError
from armid_ros.nodes.running.arguments import is_asked_for, stray, unreadable, usage
import rclpy
from rclpy._rclpy_pybind11 import RCLError, RCLInvalidROSArgsError, UnknownROSArgsError
from rclpy.context import Context
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.signals import SignalHandlerOptions
from threadpoolctl import threadpool_limits

#: How long leaving DDS may take [s].
LEAVING = 20.0
#: How often it is looked whether the process is to end [s].
_LOOK_PERIOD = 0.1


def make_executor(kind: str, context: Context | None = None) -> Executor:
    """
    Make an executor; never the multi-threaded one, which starves topics of 100 Hz and more.

    Parameters
    ----------
    kind : {'single', 'events'}
        Events takes a fifth to a half of the processor time, and is experimental in Jazzy.
    context : Context, optional
        The default one without.

    """
    if kind == 'events':
        return EventsExecutor(context=context)
    return SingleThreadedExecutor(context=context)


@contextmanager
def steady() -> Iterator[None]:
    """
    Use one thread of linear algebra, and search no object for garbage that is there already.

    Matrices of a hundred rows are done sooner than threads have met; where another process has
    the second core, they wait for each other, and 0.2 ms become 20. Objects of the libraries stay
    for good, but a collection that looks through them stops the process for 70 ms.

    """
    gc.collect()
    gc.freeze()
    try:
        with threadpool_limits(limits=1):
            yield
    finally:
        gc.unfreeze()


class _Ending:
    """What signals do to a process: they end it, but not in the middle of a callback."""

    # A node that stops an arm has to be able to publish when it is told to end; the handlers of
    # rclpy would have shut down its context by then. While a node is being made there is nothing
    # to stop, and making it may take long: then SIGINT and SIGTERM end the process at once.

    def __init__(self) -> None:
        self._asked = self._at_once = self.with_parent = self.hung_up = False
        self._parent = os.getppid()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)
        if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as under nohup
            signal.signal(signal.SIGHUP, self._on_hang_up)

    @property
    def due(self) -> bool:
        """Whether the process is to end, also as its parent has where it goes with that."""
        ended = self.with_parent and os.getppid() != self._parent
        return self._asked or self.hung_up or ended

    @contextmanager
    def at_once(self) -> Iterator[None]:
        """Have signals end the process wherever it is."""
        self._at_once = True
        try:
            yield
        finally:
            self._at_once = False

    def _on_hang_up(self, *_: object) -> None:
        self.hung_up = True

    def _on_signal(self, *_: object) -> None:
        self._asked = True
        if self._at_once:
            self._at_once = False  # `ros2 launch` sends a second one
            raise _EndedAtOnce


class _EndedAtOnce(BaseException):
    """A signal came while the node was being made; nothing catches it but `run`."""


def run(make_node: Callable[[], ArmidNode], args: Sequence[str] | None = None) -> None:
    """
    Run a node until it is finished, told to end or hung up; only say what it is with --help.

    Raises
    ------
    SystemExit
        After one line on stderr: with status 2 when the node cannot be made or refuses what it is
        asked, with status 1 when it cannot go on, or was hung up as by a terminal that is closed.

    """
    if isinstance(make_node, type) and is_asked_for(sys.argv[1:] if args is None else args):
        print(usage(make_node))
        return
    node: ArmidNode | None = None
    trouble: list[str] = []
    ending = _Ending()
    try:
        with ending.at_once():
            node = _made(make_node, args)
        executor = make_executor(node.value('executor'))
        executor.add_node(node)
        ending.with_parent = node.value('end_with_parent')
        with steady():
            while rclpy.ok() and not (node.finished or ending.due):
                executor.spin_once(timeout_sec=_LOOK_PERIOD)  # events: else it hangs
    except (_EndedAtOnce, ExternalShutdownException):
        pass
    except RCLError:  # the context is shut down between looking at it and waiting on it
        if rclpy.ok():
            raise
    except ArmidError as error:
        trouble.append(str(error))
    finally:
        trouble += _leave(node)
    if ending.hung_up:
        trouble.append('ended by SIGHUP, as by a terminal that is closed')
    if node is not None and node.failure:
        trouble.append(node.failure)
    if trouble:
        with suppress(OSError):  # the terminal may be gone
            print('; '.join(trouble), file=sys.stderr)
        raise SystemExit(2 if node is None or node.failure else 1)


def _made(make_node: Callable[[], ArmidNode], args: Sequence[str] | None) -> ArmidNode:
    """Begin with ROS and make a node; ParameterError for arguments that are none of ROS."""
    own = sys.argv[1:] if args is None else args
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except (RCLError, RCLInvalidROSArgsError, UnknownROSArgsError) as error:
        raise ParameterError(unreadable(error)) from error
    said = stray(own, Path(sys.argv[0]).stem)
    if said:
        raise ParameterError(said)
    node = make_node()
    node.warn_of_unknown()
    return node


def _leave(node: ArmidNode | None) -> list[str]:
    """Let a node finish what must not be lost, and leave DDS; return what went wrong."""
    # Ctrl-C under `ros2 launch` arrives twice; the second must not interrupt closing.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    trouble: list[str] = []
    if node is not None:
        try:
            node.close()
        except ArmidError as error:
            trouble.append(str(error))
    # Fast DDS waits for what other processes hold in shared memory, and for ever where one of
    # them was killed. The watchdog is a thread in C: it says where the process hangs, and ends it.
    faulthandler.dump_traceback_later(LEAVING, exit=True, file=sys.__stderr__)
    if node is not None:
        node.destroy_node()
    rclpy.try_shutdown()
    faulthandler.cancel_dump_traceback_later()
    return trouble
