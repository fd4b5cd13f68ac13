# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Reserve ROS domains, so that nodes do not communicate with other robots."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
import os
import socket

from armid_ros.errors import ArmidError
from rclpy.context import Context

_RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'


@contextmanager
def private_context(domain: int | None = None) -> Iterator[Context]:
    """
    Yield a ROS context that communicates on this machine only.

    Parameters
    ----------
    domain : int, optional
        ROS domain; by default a domain that no other private context uses.

    Raises
    ------
    ArmidError
        If all domains are in use.

    """
    with reserved_domain() if domain is None else nullcontext(domain) as chosen:
        context = Context()
        # rmw reads the range from the environment when a context is made
        before = os.environ.get(_RANGE)
        os.environ[_RANGE] = 'LOCALHOST'
        try:
            context.init(args=[], domain_id=chosen)
        finally:
            del os.environ[_RANGE]
            if before is not None:
                os.environ[_RANGE] = before
        try:
            yield context
        finally:
            context.try_shutdown()


@contextmanager
def reserved_domain() -> Iterator[int]:
    """
    Yield the ID of a ROS domain that no other process of armid uses in a `with` block.

    Raises
    ------
    ArmidError
        If all domains are in use.

    """
    # their ports are below the ephemeral ports of Linux; 0 is the default domain
    domains = range(1, 102)
    first = os.getpid() % len(domains)
    for domain in (*domains[first:], *domains[:first]):
        # The name of an abstract socket is free again when its process ends.
        with socket.socket(socket.AF_UNIX) as reservation:
            try:
                reservation.bind(f'\0armid_ros/domain/{domain}')
            except OSError:
                continue
            yield domain
            return
    raise ArmidError(f'all {len(domains)} ROS domain IDs of armid are in use; end a node')
