# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decode serialised JointState messages one at a time, with few Python objects."""

from __future__ import annotations

import struct
from typing import NamedTuple

from armid_ros.motion import FloatArray
from armid_ros.recording.joint_state.layout import JointStateLayout
import numpy as np

_NOTHING = np.empty(0)


class JointStateValues(NamedTuple):
    """
    Values of one message.

    Attributes
    ----------
    sec, nanosec : int
        Stamp.
    names : tuple of str
        Joints; the same object for all messages of one sender.
    position, velocity, effort : ndarray
        Values, as many as the message has: as a rule one per name, or none.

    """

    sec: int
    nanosec: int
    names: tuple[str, ...]
    position: FloatArray
    velocity: FloatArray
    effort: FloatArray


class JointStateMessages:
    """Decoder of serialised messages, with a cache of layouts."""

    def __init__(self) -> None:
        self._known: list[_Fields] = []

    def read(self, data: bytes) -> JointStateValues:
        """
        Return the values of a message.

        Raises
        ------
        MalformedMessage
            The bytes are no JointState.

        """
        for fields in self._known:
            values = fields.read(data)
            if values is not None:
                return values
        fields = _Fields(JointStateLayout.of(data))
        self._known = [fields, *self._known[:7]]  # one layout per sender on a topic
        values = fields.read(data)
        assert values is not None
        return values


class _Fields:
    """Fields of messages of one layout, and the bytes that identify it."""

    def __init__(self, layout: JointStateLayout) -> None:
        order = layout.order
        self.names = layout.names
        expected, mask = layout.names_pattern
        self._named = slice(layout.names_offset, layout.names_offset + expected.nbytes)
        self._text = int.from_bytes(expected.tobytes(), 'little')
        self._mask = int.from_bytes(mask.tobytes(), 'little')
        self._code = b'\x00\x01' if order == '<' else b'\x00\x00'
        # the stamp and all lengths in one call
        numbers, end = order + '4xiII', 16
        for at, _ in layout.places:
            numbers, end = f'{numbers}{at - end}xI', at + 4
        self._numbers = struct.Struct(numbers).unpack_from
        self._lengths = [layout.frame_length, *layout.counts]
        self._end = layout.end
        self._longest = layout.end + layout.spare
        self._type = np.dtype(order + 'f8')
        begins = (begin for _, begin in layout.places)
        self._places = list(zip(layout.counts, begins, strict=True))

    def read(self, data: bytes) -> JointStateValues | None:
        """Return the values; None if the layout is another one. Padding is not compared."""
        if data[:2] != self._code or not self._end <= len(data) <= self._longest:
            return None
        if int.from_bytes(data[self._named], 'little') & self._mask != self._text:
            return None
        sec, nanosec, *lengths = self._numbers(data)
        if lengths != self._lengths:
            return None
        position, velocity, effort = (
            np.frombuffer(data, self._type, count, place) if count else _NOTHING
            for count, place in self._places
        )
        return JointStateValues(sec, nanosec, self.names, position, velocity, effort)
