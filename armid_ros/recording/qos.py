# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Quality of service of a topic, in the two notations rosbag2 has written it in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum
from typing import Any

from armid_ros.files import load_yaml
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
import yaml

#: Without a limit [s, ns].
_INFINITE = QosTime(9223372036, 854775807)
#: A reliable publisher whose late subscribers get nothing; the middleware does not tell a recorder
#: history and depth.
VOLATILE = Qos(
    QosHistory.UNKNOWN,
    0,
    QosReliability.RELIABLE,
    QosDurability.VOLATILE,
    _INFINITE,
    _INFINITE,
    QosLiveliness.AUTOMATIC,
    _INFINITE,
    avoid_ros_namespace_conventions=False,
)
#: One whose late subscribers get the last messages.
LATCHED = VOLATILE._replace(durability=QosDurability.TRANSIENT_LOCAL)


def dump_qos(profiles: Iterable[Qos]) -> list[dict[str, Any]]:
    """Return profiles in the notation of metadata.yaml, version 9."""

    def written(value: object) -> object:
        if isinstance(value, Enum):
            return value.name.lower()
        return value._asdict() if isinstance(value, QosTime) else value

    return [
        {name: written(value) for name, value in profile._asdict().items()} for profile in profiles
    ]


def parse_qos(text: str | None) -> tuple[Qos, ...]:
    """Return profiles from their YAML in either notation; none where it cannot be understood."""
    try:
        listed = load_yaml(text or '')
        profiles = listed if isinstance(listed, list) else ()
        return tuple(
            Qos(*(_read(profile.get(name), of) for name, of in VOLATILE._asdict().items()))
            for profile in profiles
            if isinstance(profile, Mapping)
        )
    except (yaml.YAMLError, ArithmeticError, ValueError, TypeError):
        # What a publisher offered is good to know, but no reason not to read what it sent.
        return ()


def _read(value: Any, default: object) -> Any:
    """Return a field; a policy by its name, or its integer in rmw/types.h as up to version 8."""
    if isinstance(default, Enum):
        named = {one.name.lower(): one for one in type(default)}
        unknown = named['unknown']
        if isinstance(value, int):
            return next((one for one in type(default) if one.value == value), unknown)
        return named.get(value, unknown) if isinstance(value, str) else unknown
    if isinstance(default, QosTime):
        if not isinstance(value, Mapping):
            return default
        return QosTime(int(value.get('sec', 0)), int(value.get('nsec', 0)))
    return int(value or 0) if type(default) is int else bool(value)
