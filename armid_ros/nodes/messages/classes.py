# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Find message classes by type name."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from armid_ros.errors import RecordingError
from rclpy.type_support import check_for_type_support


def message_class(type_name: str) -> type[Any]:
    """
    Return the Python class of a ROS message type, by its name.

    Raises
    ------
    RecordingError
        If the package is not installed, has no such message, or cannot be loaded.

    """
    package, _, name = type_name.partition('/msg/')
    try:
        message_type: type[Any] = getattr(import_module(f'{package}.msg'), name)
        check_for_type_support(message_type)
    except Exception as error:  # packages built for another system raise arbitrary exceptions
        raise RecordingError(
            f'the message type {type_name} is not available ({error}): install or source the '
            f"package '{package}'"
        ) from error
    return message_type
