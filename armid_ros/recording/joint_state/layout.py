# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Where the fields of a serialised sensor_msgs/JointState are.

CDR: four bytes of encapsulation, then fields aligned to their size counted from byte 4; a string
is a 4-byte length with the terminating zero counted, a sequence a 4-byte count. Messages of one
publisher have the same layout, so it is found once and thousands of messages are then read as one
numpy record array. What a layout assumes of a message - lengths, counts, names - is compared for
every message; bytes of padding are not, since writers leave rubbish in them.

"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
import struct
from typing import Any

from armid_ros.recording.message_types import BYTE_ORDERS
import numpy as np
import numpy.typing as npt

# Encapsulation 4, stamp 8, then the length of frame_id.
_FRAME = 12


class MalformedMessage(ValueError):
    """The bytes are no sensor_msgs/JointState."""


@dataclass(frozen=True)
class JointStateLayout:
    """
    Layout of a JointState message.

    Attributes
    ----------
    order : {'<', '>'}
        Byte order.
    frame_length : int
        Bytes of frame_id, its terminating zero counted.
    names : tuple of str
        Joint names.
    counts : tuple of int
        Number of positions, velocities and efforts.
    offsets : tuple of int
        Where their values begin; of no meaning where there are none.
    end : int
        Where the last value ends.

    """

    order: str
    frame_length: int
    names: tuple[str, ...]
    counts: tuple[int, int, int]
    offsets: tuple[int, int, int]
    end: int

    @classmethod
    def of(cls, cdr: bytes) -> JointStateLayout:
        """
        Find the layout of one message.

        Raises
        ------
        MalformedMessage
            The bytes are not a JointState.

        """
        order = BYTE_ORDERS.get(cdr[:2])
        if order is None:
            raise MalformedMessage(f'encapsulation {cdr[:2].hex(" ")!r} is not plain CDR')
        try:
            (frame_length,) = struct.unpack_from(order + 'I', cdr, _FRAME)
            names, position = _read_names(cdr, order, _align(_FRAME + 4 + frame_length, 4))
            counts, offsets = [], []
            for _ in range(3):
                position = _align(position, 4)
                (count,) = struct.unpack_from(order + 'I', cdr, position)
                position += 4
                start = _align(position, 8) if count else position
                position = start + 8 * count
                counts.append(count)
                offsets.append(start)
        except (struct.error, UnicodeDecodeError) as error:
            raise MalformedMessage(f'not a JointState: {error}') from error
        # A writer reserves room to align what follows, and for each empty sequence as well.
        if not 0 <= len(cdr) - position <= 7 + 4 * counts.count(0):
            raise MalformedMessage(f'{len(cdr)} bytes where a JointState has {position}')
        return cls(
            order,
            frame_length,
            names,
            (counts[0], counts[1], counts[2]),
            (offsets[0], offsets[1], offsets[2]),
            position,
        )

    @classmethod
    def make(
        cls, names: tuple[str, ...], frame_id: str, counts: tuple[int, int, int]
    ) -> JointStateLayout:
        """Return the layout of messages to be written."""
        frame_length = len(frame_id.encode()) + 1
        position = _align(_FRAME + 4 + frame_length, 4) + 4
        for name in names:
            position = _align(position, 4) + 4 + len(name.encode()) + 1
        offsets = []
        for count in counts:
            position = _align(position, 4) + 4
            start = _align(position, 8) if count else position
            offsets.append(start)
            position = start + 8 * count
        return cls(
            '<', frame_length, names, counts, (offsets[0], offsets[1], offsets[2]), position
        )

    @property
    def names_offset(self) -> int:
        """Where the count of names is."""
        return _align(_FRAME + 4 + self.frame_length, 4)

    def count_offset(self, field: int) -> int:
        """Where the number of values of a field (0 position, 1 velocity, 2 effort) is."""
        if not self.counts[field]:
            return self.offsets[field] - 4
        # The values are aligned to 8, so the count before them may be followed by padding.
        previous = self.names_end if field == 0 else self._end_of(field - 1)
        return _align(previous, 4)

    def _end_of(self, field: int) -> int:
        return self.offsets[field] + 8 * self.counts[field]

    @cached_property
    def names_end(self) -> int:
        """Where the last name ends."""
        position = self.names_offset + 4
        for name in self.names:
            position = _align(position, 4) + 4 + len(name.encode()) + 1
        return position

    def dtype(self, length: int) -> np.dtype[np.void]:
        """Return messages of this layout and a total length as a numpy record."""
        words = (_align(self.names_end, 4) - self.names_offset) // 4
        fields: dict[str, tuple[Any, int]] = {
            'encapsulation': ('>u2', 0),
            'sec': (self.order + 'i4', 4),
            'nanosec': (self.order + 'u4', 8),
            'frame_length': (self.order + 'u4', _FRAME),
            'names': (('<u4', (words,)), self.names_offset),
        }
        for field, name in enumerate(('position', 'velocity', 'effort')):
            fields['n_' + name] = (self.order + 'u4', self.count_offset(field))
            if self.counts[field]:
                values = (self.order + 'f8', (self.counts[field],))
                fields[name] = (values, self.offsets[field])
        return np.dtype(
            {
                'names': list(fields),
                'formats': [form for form, _ in fields.values()],
                'offsets': [offset for _, offset in fields.values()],
                'itemsize': length,
            }
        )

    @cached_property
    def names_pattern(self) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
        """Return the words of the names, and which of their bits are not padding."""
        words = _align(self.names_end, 4) - self.names_offset
        text, mask = bytearray(words), bytearray(words)
        struct.pack_into(self.order + 'I', text, 0, len(self.names))
        mask[0:4] = b'\xff' * 4
        position = 4
        for name in self.names:
            position = _align(position, 4)
            raw = name.encode() + b'\0'
            end = position + 4 + len(raw)
            text[position:end] = struct.pack(self.order + 'I', len(raw)) + raw
            mask[position:end] = b'\xff' * (end - position)
            position = end
        return np.frombuffer(bytes(text), '<u4'), np.frombuffer(bytes(mask), '<u4')

    def fits(self, rows: npt.NDArray[np.void]) -> npt.NDArray[np.bool_]:
        """Tell which of the messages, read as records of this layout, have this layout."""
        expected, mask = self.names_pattern
        names = rows['names']
        # As a rule all padding is alike, and plain comparison of the first row's is enough.
        reference = names[0]
        if np.array_equal(reference & mask, expected):
            equal = names == reference
            same = np.ones(len(rows), dtype=np.bool_) if equal.all() else equal.all(axis=1)
        else:
            same = np.zeros(len(rows), dtype=np.bool_)
        if not same.all():
            rest = np.flatnonzero(~same)
            same[rest] = ((names[rest] & mask) == expected).all(axis=1)
        same &= rows['encapsulation'] == (1 if self.order == '<' else 0)
        same &= rows['frame_length'] == self.frame_length
        for field, name in enumerate(('n_position', 'n_velocity', 'n_effort')):
            same &= rows[name] == self.counts[field]
        return np.asarray(same)


def _read_names(cdr: bytes, order: str, position: int) -> tuple[tuple[str, ...], int]:
    """Return the joint names and where they end."""
    (count,) = struct.unpack_from(order + 'I', cdr, position)
    position += 4
    if count > len(cdr):
        raise MalformedMessage(f'{count} joint names in {len(cdr)} bytes')
    names = []
    for _ in range(count):
        position = _align(position, 4)
        (length,) = struct.unpack_from(order + 'I', cdr, position)
        position += 4
        names.append(cdr[position : position + max(length - 1, 0)].decode())
        position += length
        if position > len(cdr):
            raise MalformedMessage('a joint name does not end within the message')
    return tuple(names), position


def _align(position: int, size: int) -> int:
    """Return the next position aligned to a size, counted from the end of the encapsulation."""
    return ((position - 4 + size - 1) & -size) + 4
