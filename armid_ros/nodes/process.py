# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A node as a process of its own: started in one line, ended quietly."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
    Run a node until it is finished, interrupted or told to shut down.

    Raises
    ------
    SystemExit
        With status 2, after one line on stderr, when the node cannot be made.

    """
    node: ArmidNode | None = None
    try:
        rclpy.init(args=args)
        node = make_node()
        executor = make_executor(node.value('executor'))
        executor.add_node(node)
        while rclpy.ok() and not node.finished:
            executor.spin_once(timeout_sec=1.0)  # events: spin() without a time-out hangs
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RCLError:  # a signal that comes between looking at the context and waiting on it
        if rclpy.ok():
            raise
    except ArmidError as error:
        print(error, file=sys.stderr)
        raise SystemExit(2) from None
    finally:
        # Ctrl-C under `ros2 launch` arrives twice; the second must not interrupt closing.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        if node is not None:
            node.close()
            node.destroy_node()
        rclpy.try_shutdown()
