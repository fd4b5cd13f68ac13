# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Options that belong together reach a command as one settings object."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import wraps
from typing import Any


def gathered(**kinds: type[Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """
    Give a command settings objects in place of the options that are their fields.

    It stands below the options, next to the function.

    Parameters
    ----------
    **kinds : dataclass
        By the name of the parameter that takes it; every field has the name of an option.

    """

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def call(**values: Any) -> Any:
            made = {
                name: kind(**{field.name: values.pop(field.name) for field in fields(kind)})
                for name, kind in kinds.items()
            }
            return command(**made, **values)

        call.gathered = kinds  # type: ignore[attr-defined]
        return call

    return decorate
