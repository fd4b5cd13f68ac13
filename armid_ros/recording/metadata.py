# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read metadata.yaml and QoS profiles of any rosbag2 version, and write those of version 9."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from armid_ros.errors import RecordingError
from armid_ros.files import is_file, load_yaml, read_text, reading
from armid_ros.recording.source import Topic
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import metadata
import yaml

FILE_NAME = 'metadata.yaml'
#: Largest duration, which means no limit.
_NO_LIMIT = QosTime(9223372036, 854775807)
#: Reliable publisher that keeps no messages for late subscribers. History and depth are unknown,
#: because the middleware does not report them to a recorder.
VOLATILE = Qos(
    QosHistory.UNKNOWN,
    0,
    QosReliability.RELIABLE,
    QosDurability.VOLATILE,
    _NO_LIMIT,
    _NO_LIMIT,
    QosLiveliness.AUTOMATIC,
    _NO_LIMIT,
    avoid_ros_namespace_conventions=False,
)
#: Reliable publisher that sends its last messages to late subscribers.
LATCHED = VOLATILE._replace(durability=QosDurability.TRANSIENT_LOCAL)


@dataclass(frozen=True)
class BagMetadata:
    """
    Storage files and message counts that metadata.yaml states for a bag.

    Attributes
    ----------
    files : tuple of Path
        The files of the bag, in order.
    counts : mapping of str to int
        Number of messages of each topic, as stated by the writer.

    """

    files: tuple[Path, ...]
    counts: Mapping[str, int] = field(default_factory=dict)


def bag_information(
    topics: Sequence[Topic], file_name: str | None, start_ns: int, end_ns: int
) -> dict[str, Any]:
    """
    Return the entries below the top-level key of metadata.yaml as a dictionary.

    Parameters
    ----------
    topics : sequence of Topic
        Topics with their counts.
    file_name : str or None
        The only file of the bag; None while the file is written.
    start_ns, end_ns : int
        Log time of the first and the last message [ns]; ignored for a bag without messages.

    """
    count = sum(topic.count for topic in topics)
    # value of rosbag2 for a bag without messages
    start = {'nanoseconds_since_epoch': start_ns if count else 2**63 - 1}
    duration = {'nanoseconds': end_ns - start_ns if count else 0}
    files = [] if file_name is None else [file_name]
    return {
        'version': 9,
        'storage_identifier': 'mcap',
        'duration': duration,
        'starting_time': start,
        'message_count': count,
        'topics_with_message_count': [
            {
                'topic_metadata': {
                    'name': topic.name,
                    'type': topic.type_name,
                    'serialization_format': topic.encoding,
                    'offered_qos_profiles': metadata.dump_qos_v9(list(topic.qos)),
                    'type_description_hash': topic.message_type.type_hash,
                },
                'message_count': topic.count,
            }
            for topic in topics
        ],
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': files,
        'files': [
            {
                'path': name,
                'starting_time': dict(start),
                'duration': dict(duration),
                'message_count': count,
            }
            for name in files
        ],
        'custom_data': None,
        'ros_distro': 'jazzy',
    }


def yaml_text(information: Mapping[str, Any] | Sequence[Mapping[str, Any]]) -> str:
    """Format a dictionary, or a list of dictionaries, as YAML text."""
    # The C dumper takes 1 ms and may be missing; the Python dumper takes 10 ms.
    dumper = getattr(yaml, 'CSafeDumper', yaml.SafeDumper)
    return str(yaml.dump(information, Dumper=dumper, sort_keys=False, allow_unicode=True))


def read_metadata(bag: Path) -> BagMetadata:
    """
    Read metadata.yaml of a bag, written by any version of rosbag2.

    Raises
    ------
    RecordingError
        If the file is not valid, or names a file that does not exist.

    """
    path = bag / FILE_NAME
    text = read_text(path, RecordingError)
    try:
        with reading('', RecordingError):
            information = load_yaml(text)['rosbag2_bagfile_information']
            names = information['relative_file_paths']
            if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
                raise ValueError('relative_file_paths has to be a list of file names')
            if len(set(names)) != len(names):
                raise ValueError('relative_file_paths lists a file twice')
            counts: dict[str, int] = {}
            entries = information.get('topics_with_message_count')
            for entry in entries if isinstance(entries, list) else ():
                name, count = entry['topic_metadata']['name'], entry['message_count']
                if isinstance(name, str) and isinstance(count, int):
                    counts[name] = counts.get(name, 0) + count
    except RecordingError as error:
        raise RecordingError(
            f'{path}: the file is not a valid metadata.yaml ({str(error).lstrip(": ")}); to read '
            'the bag without this file, move the file elsewhere'
        ) from error
    # Up to version 3 the paths began with the name of the directory.
    files = tuple(bag / Path(name).name for name in names)
    missing = [file.name for file in files if not is_file(file)]
    if missing:
        present = ', '.join(sorted(entry.name for entry in bag.iterdir()))
        raise RecordingError(
            f'{path}: lists the files {", ".join(missing)}, but the directory of the bag has only '
            f'{present}'
        )
    return BagMetadata(files, counts)


def parse_qos(text: str | None) -> tuple[Qos, ...]:
    """Parse QoS profiles from a YAML text of any rosbag2 version; empty for invalid text."""
    default: dict[str, Any] = dict(metadata.dump_qos_v9([VOLATILE])[0])
    default |= dict.fromkeys(('reliability', 'durability', 'liveliness'), 'unknown')
    try:
        listed: Any = load_yaml(text or '')
        profiles: Any = [default | one for one in (listed if isinstance(listed, list) else ())]
        return tuple(metadata.parse_qos(profiles))
    except (yaml.YAMLError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        # Messages can be read without the QoS of their publisher.
        return ()
