# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Quality of service of a topic, in the two notations rosbag2 has written it in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from armid_ros.files import load_yaml
from rosbags.interfaces import QosDurability, QosHistory, QosLiveliness, QosReliability
import yaml

#: Duration without a limit [ns].
INFINITE_NS = 9223372036 * 10**9 + 854775807


@dataclass(frozen=True)
class QosProfile:
    """
    What a publisher of a topic offered.

    Attributes
    ----------
    history : {'unknown', 'keep_last', 'keep_all', 'system_default'}
        The middleware does not tell a recorder, hence 'unknown'.
    depth : int
        Queue length; 0 when unknown.
    reliability : {'reliable', 'best_effort', ...}
        Whether lost messages are sent again.
    durability : {'volatile', 'transient_local', ...}
        Whether late subscribers get the last messages.
    deadline_ns, lifespan_ns, lease_ns : int
        Durations [ns]; INFINITE_NS when unlimited.
    liveliness : str
        How a publisher proves that it lives.
    avoid_ros_namespace_conventions : bool
        Whether the topic has no ROS prefix in the middleware.

    """

    history: str = 'unknown'
    depth: int = 0
    reliability: str = 'reliable'
    durability: str = 'volatile'
    deadline_ns: int = INFINITE_NS
    lifespan_ns: int = INFINITE_NS
    liveliness: str = 'automatic'
    lease_ns: int = INFINITE_NS
    avoid_ros_namespace_conventions: bool = False

    @property
    def latched(self) -> bool:
        """Whether late subscribers get the last messages."""
        return self.durability == 'transient_local'


LATCHED = QosProfile(durability='transient_local')


def dump_qos(profiles: Iterable[QosProfile]) -> list[dict[str, Any]]:
    """Return profiles in the notation of metadata.yaml, version 9."""
    return [
        {
            'history': profile.history,
            'depth': profile.depth,
            'reliability': profile.reliability,
            'durability': profile.durability,
            'deadline': _dump_duration(profile.deadline_ns),
            'lifespan': _dump_duration(profile.lifespan_ns),
            'liveliness': profile.liveliness,
            'liveliness_lease_duration': _dump_duration(profile.lease_ns),
            'avoid_ros_namespace_conventions': profile.avoid_ros_namespace_conventions,
        }
        for profile in profiles
    ]


def dump_qos_text(profiles: Iterable[QosProfile]) -> str:
    """Return profiles as the YAML text of an MCAP channel."""
    listed = dump_qos(profiles)
    return str(yaml.safe_dump(listed, sort_keys=False)).strip() if listed else ''


def parse_qos(profiles: str | Iterable[Mapping[str, Any]] | None) -> tuple[QosProfile, ...]:
    """Return profiles from either notation; none where it cannot be understood."""
    try:
        listed = load_yaml(profiles) if isinstance(profiles, str) else profiles
        if not isinstance(listed, (list, tuple)):
            return ()
        return tuple(_parse_profile(profile) for profile in listed if isinstance(profile, Mapping))
    except (yaml.YAMLError, ArithmeticError, ValueError, TypeError):
        # What a publisher offered is good to know, but no reason not to read what it sent.
        return ()


def _parse_profile(profile: Mapping[str, Any]) -> QosProfile:
    return QosProfile(
        history=_parse_choice(profile.get('history'), QosHistory),
        depth=int(profile.get('depth', 0)),
        reliability=_parse_choice(profile.get('reliability'), QosReliability),
        durability=_parse_choice(profile.get('durability'), QosDurability),
        deadline_ns=_parse_duration(profile.get('deadline')),
        lifespan_ns=_parse_duration(profile.get('lifespan')),
        liveliness=_parse_choice(profile.get('liveliness'), QosLiveliness),
        lease_ns=_parse_duration(profile.get('liveliness_lease_duration')),
        avoid_ros_namespace_conventions=bool(profile.get('avoid_ros_namespace_conventions')),
    )


def _parse_choice(value: object, choices: type[Enum]) -> str:
    """Return a policy by its name, or by its integer in rmw/types.h, as up to version 8."""
    names = {one.value: one.name.lower() for one in choices}
    if isinstance(value, int):
        return names.get(value, 'unknown')
    return value if isinstance(value, str) and value in names.values() else 'unknown'


def _dump_duration(nanoseconds: int) -> dict[str, int]:
    seconds, rest = divmod(nanoseconds, 10**9)
    return {'sec': seconds, 'nsec': rest}


def _parse_duration(value: object) -> int:
    if not isinstance(value, Mapping):
        return INFINITE_NS
    return int(value.get('sec', 0)) * 10**9 + int(value.get('nsec', 0))
