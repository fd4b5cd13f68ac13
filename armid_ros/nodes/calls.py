# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Call services of a running excitation publisher from a program that is no ROS node."""

from __future__ import annotations

import time
from typing import Any

from armid_ros.errors import TrajectoryError
from rcl_interfaces.srv import SetParameters
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger


def call_publisher(node: str, action: str, speed: float | None, timeout: float) -> str:
    """
    Start, rehearse, stop or slow down the run of an excitation_publisher node.

    Parameters
    ----------
    node : str
        Name of the excitation publisher, with its namespace.
    action : str
        'start', 'rehearse', 'stop', or 'speed'.
    speed : float or None
        Share of the planned speed, for the action 'speed'.
    timeout : float
        Longest time to wait for the answer [s].

    Returns
    -------
    str
        Answer of the node.

    Raises
    ------
    TrajectoryError
        If no node answers in time, or the node rejects the call.

    """
    name = node if node.startswith('/') else f'/{node}'
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    try:
        caller = rclpy.create_node('armid_call', context=context)
        kind: Any
        if action == 'speed':
            kind, service = SetParameters, f'{name}/set_parameters'
            value = Parameter('speed_scaling', value=speed).to_parameter_msg()
            request: Any = SetParameters.Request(parameters=[value])
        else:
            kind, service, request = Trigger, f'{name}/{action}', Trigger.Request()
        client = caller.create_client(kind, service)
        end = time.monotonic() + timeout
        if not client.wait_for_service(timeout):
            raise TrajectoryError(
                f'no node offered the service {service} within {timeout:g} s; start the '
                'excitation_publisher with the same ROS_DOMAIN_ID, or give its name with --node'
            )
        future = client.call_async(request)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(caller)
        executor.spin_until_future_complete(future, max(end - time.monotonic(), 0.1))
        if not future.done():
            raise TrajectoryError(
                f'{name} did not answer the call of {action} within {timeout:g} s; the node may '
                'still execute the call, so watch the arm'
            )
        answer = future.result()
    finally:
        rclpy.shutdown(context=context)
    if action == 'speed':
        result = answer.results[0]
        done, message = result.successful, result.reason or f'speed_scaling {speed:g}'
    else:
        done, message = answer.success, answer.message
    if not done:
        raise TrajectoryError(f'{name} refuses {action}: {message}')
    return str(message)
