# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""ROS domains for runs that must neither hear other robots nor be heard by them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
import os
import socket

from armid_ros.errors import ArmidError
from rclpy.context import Context

#: Domains whose ports Linux does not hand out otherwise; 0 is everybody's.
_DOMAINS = range(1, 102)
_RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'


@contextmanager
def private_context(domain: int | None = None) -> Iterator[Context]:
    """
    Open a ROS context that only this machine hears.

    Parameters
    ----------
    domain : int, optional
        Its domain; by default one that no other private context is on.

    Raises
    ------
    ArmidError
        If all domains are taken.

    """
    with reserved_domain() if domain is None else nullcontext(domain) as chosen:
        context = Context()
        # rmw reads the range when a context is made; there is no argument for it
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
    Reserve a domain on this machine, for as long as the context is open or the process lives.

    Raises
    ------
    ArmidError
        If all domains are taken.

    """
    first = os.getpid() % len(_DOMAINS)
    for shift in range(len(_DOMAINS)):
        domain = _DOMAINS[(first + shift) % len(_DOMAINS)]
        # An abstract socket is a name that vanishes with its process: no port, no file.
        with socket.socket(socket.AF_UNIX) as reservation:
            try:
                reservation.bind(f'\0armid_ros/domain/{domain}')
            except OSError:
                continue
            yield domain
            return
    raise ArmidError(f'all {len(_DOMAINS)} private ROS domains of this machine are in use')
