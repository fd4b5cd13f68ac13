# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Convert quality of service from and to the two notations of rosbag2."""

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

#: Duration without a limit [s, ns].
_INFINITE = QosTime(9223372036, 854775807)
#: Reliable publisher that keeps no messages for late subscribers. History and depth are unknown,
#: since the middleware does not report them to a recorder.
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
#: Reliable publisher that sends its last messages to late subscribers.
LATCHED = VOLATILE._replace(durability=QosDurability.TRANSIENT_LOCAL)


def dump_qos(profiles: Iterable[Qos]) -> list[dict[str, Any]]:
    """Convert profiles to the notation of metadata.yaml, version 9."""

    def written(value: object) -> object:
        if isinstance(value, Enum):
            return value.name.lower()
        return value._asdict() if isinstance(value, QosTime) else value

    return [
        {name: written(value) for name, value in profile._asdict().items()} for profile in profiles
    ]


def parse_qos(text: str | None) -> tuple[Qos, ...]:
    """Read profiles from YAML in either notation; empty if the text is not valid."""
    try:
        listed = load_yaml(text or '')
        profiles = listed if isinstance(listed, list) else ()
        return tuple(
            Qos(*(_read(profile.get(name), of) for name, of in VOLATILE._asdict().items()))
            for profile in profiles
            if isinstance(profile, Mapping)
        )
    except (yaml.YAMLError, ArithmeticError, ValueError, TypeError):
        # Messages can be read without the QoS of their publisher.
        return ()


def _read(value: Any, default: object) -> Any:
    """Read a field. Policies are names, or up to version 8 integers of rmw/types.h."""
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
