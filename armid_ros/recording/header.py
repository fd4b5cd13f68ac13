# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The header that most serialised messages begin with."""

from __future__ import annotations

import struct

_BIG, _LITTLE = struct.Struct('>iI').unpack_from, struct.Struct('<iI').unpack_from


def header_stamp(data: bytes) -> int:
    """Return the stamp of a serialised message that begins with a header [ns]; 0 if unset."""
    seconds, nanoseconds = (_LITTLE if data[1] & 1 else _BIG)(data, 4)
    return int(seconds) * 10**9 + int(nanoseconds)
