# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Reading of untrusted files, and atomic writing of results.

To read text, use `read_text` (no FIFO, no device, a bounded size), `load_yaml` (bounded depth and
expansion) and `reading`, which converts errors of a parser into an error of the package with the
path. To write results, use `write_file` inside the `result_folder` of the command. A result of
several files is written to a `staged` folder until it is complete.

"""

from armid_ros.files.documents import finite, load_yaml, reading, yaml_line
from armid_ros.files.output import final_path, json_text, result_folder, write_file
from armid_ros.files.regular import (
    default_memory_limit,
    is_file,
    open_regular,
    read_text,
    size_text,
)
from armid_ros.files.staging import Staged, staged

__all__ = [
    'is_file',
    'open_regular',
    'read_text',
    'load_yaml',
    'yaml_line',
    'reading',
    'finite',
    'write_file',
    'json_text',
    'result_folder',
    'Staged',
    'staged',
    'final_path',
    'default_memory_limit',
    'size_text',
]
