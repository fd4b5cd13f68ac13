# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A node as a process of its own: started in one line, ended quietly."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
import signal
import sys

from armid_ros.errors import ArmidError
from armid_ros.nodes.base import ArmidNode
import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy.context import Context
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor


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


def run(make_node: Callable[[], ArmidNode], args: Sequence[str] | None = None) -> None:
    """
    Run a node until it is finished, interrupted, told to shut down or hung up.

    Raises
    ------
    SystemExit
        After one line on stderr: with status 2 when the node cannot be made, with status 1 when
        it cannot go on, or was hung up as by a terminal that is closed.

    """
    node: ArmidNode | None = None
    trouble: list[str] = []
    hung_up = _note_hang_up()
    try:
        rclpy.init(args=args)
        node = make_node()
        executor = make_executor(node.value('executor'))
        executor.add_node(node)
        while rclpy.ok() and not node.finished and not hung_up:
            executor.spin_once(timeout_sec=1.0)  # events: spin() without a time-out hangs
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RCLError:  # a signal that comes between looking at the context and waiting on it
        if rclpy.ok():
            raise
    except ArmidError as error:
        trouble.append(str(error))
    finally:
        # Ctrl-C under `ros2 launch` arrives twice; the second must not interrupt closing.
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_IGN)
        if node is not None:
            trouble += _closed(node)
        rclpy.try_shutdown()
    if hung_up:
        trouble.append('ended by SIGHUP, as by a terminal that is closed')
    if trouble:
        with suppress(OSError):  # the terminal may be gone
            print('; '.join(trouble), file=sys.stderr)
        raise SystemExit(2 if node is None else 1)


def _note_hang_up() -> list[int]:
    """Return a list that fills when the process is hung up, unless that is to be ignored."""
    came: list[int] = []
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as under nohup
        signal.signal(signal.SIGHUP, lambda number, _: came.append(number))
    return came


def _closed(node: ArmidNode) -> list[str]:
    """Let a node finish what must not be lost; return what went wrong."""
    try:
        node.close()
    except ArmidError as error:
        return [str(error)]
    finally:
        node.destroy_node()
    return []
