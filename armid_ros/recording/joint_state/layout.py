# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Positions of the fields in serialised sensor_msgs/JointState messages.

A CDR message has four bytes of encapsulation and then fields, aligned to their size from byte 4.
A string begins with a 4-byte length that includes the final zero, and a sequence begins with a
4-byte count. Messages of one publisher have the same layout. The layout is found once, and
thousands of messages are then read as one numpy record array. Lengths, counts and names are
compared for every message. Padding bytes are not compared, because writers leave arbitrary values
there.

"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
import struct
from typing import Any

from armid_ros.recording.message_types import BYTE_ORDERS, QUANTITIES
import numpy as np
import numpy.typing as npt

#: Offset of the length of frame_id, after the encapsulation (4) and the stamp (8).
_FRAME_OFFSET = 12


class MalformedMessage(ValueError):
    """Error raised for bytes that are not a valid sensor_msgs/JointState message."""


@dataclass(frozen=True)
class JointStateLayout:
    """
    Layout of a serialised JointState message: byte order, names, lengths of the arrays.

    Attributes
    ----------
    order : {'<', '>'}
        Byte order.
    frame_length : int
        Size of frame_id with its final zero [bytes].
    names : tuple of str
        Joint names.
    counts : tuple of int
        Number of positions, velocities and efforts.

    """

    order: str
    frame_length: int
    names: tuple[str, ...]
    counts: tuple[int, ...]

    @classmethod
    def of(cls, cdr: bytes) -> JointStateLayout:
        """
        Parse the layout of a serialised JointState message.

        Raises
        ------
        MalformedMessage
            If the bytes are not a JointState.

        """
        order = BYTE_ORDERS.get(cdr[:2])
        if order is None:
            raise MalformedMessage(f'the first bytes {cdr[:2].hex(" ")!r} are not a CDR header')
        counts: list[int] = []
        try:
            (frame_length,) = struct.unpack_from(order + 'I', cdr, _FRAME_OFFSET)
            position = _align(_FRAME_OFFSET + 4 + frame_length, 4)
            (count,) = struct.unpack_from(order + 'I', cdr, position)
            if count > len(cdr):
                raise MalformedMessage(
                    f'the message states {count} joint names, but has only {len(cdr)} bytes'
                )
            position += 4
            names: tuple[str, ...] = ()
            for _ in range(count):
                position = _align(position, 4)
                (length,) = struct.unpack_from(order + 'I', cdr, position)
                position += 4 + length
                if not length or position > len(cdr):
                    raise MalformedMessage('a joint name is longer than the message')
                if cdr[position - 1]:
                    raise MalformedMessage('a joint name does not end with a zero byte')
                names += (cdr[position - length : position - 1].decode(),)
            for field in range(3):
                layout = cls(order, frame_length, names, (*counts, *[0] * (3 - field)))
                counts += struct.unpack_from(order + 'I', cdr, layout.places[field][0])
        except (struct.error, UnicodeDecodeError) as error:
            raise MalformedMessage(f'the message is not a JointState: {error}') from error
        layout = cls(order, frame_length, names, tuple(counts))
        if not 0 <= len(cdr) - layout.end <= layout.spare:
            raise MalformedMessage(
                f'the message has {len(cdr)} bytes, but its fields need {layout.end} bytes'
            )
        return layout

    @property
    def names_offset(self) -> int:
        """Return the byte position of the field that states the number of joint names."""
        return _align(_FRAME_OFFSET + 4 + self.frame_length, 4)

    @cached_property
    def names_end(self) -> int:
        """Return the byte position after the last joint name in the message."""
        position = self.names_offset + 4
        for name in self.names:
            position = _align(position, 4) + 4 + len(name.encode()) + 1
        return position

    @cached_property
    def places(self) -> tuple[tuple[int, int], ...]:
        """Return the byte positions of the length field and the first value of each quantity."""
        places, position = [], self.names_end
        for count in self.counts:
            at = _align(position, 4)
            # Values are aligned to 8, so the count before them may be followed by padding.
            begin = _align(at + 4, 8) if count else at + 4
            places.append((at, begin))
            position = begin + 8 * count
        return tuple(places)

    @cached_property
    def end(self) -> int:
        """Return the byte position after the last value in the message."""
        return self.places[-1][1] + 8 * self.counts[-1]

    @cached_property
    def spare(self) -> int:
        """Return the largest possible number of padding bytes after the last value."""
        # Writers add padding to align the next field, also for empty sequences.
        return 7 + 4 * self.counts.count(0)

    def dtype(self, length: int) -> np.dtype[np.void]:
        """Return the numpy record type of messages with this layout and a given length [bytes]."""
        words = (_align(self.names_end, 4) - self.names_offset) // 4
        fields: dict[str, tuple[Any, int]] = {
            'encapsulation': ('>u2', 0),
            'sec': (self.order + 'i4', 4),
            'nanosec': (self.order + 'u4', 8),
            'frame_length': (self.order + 'u4', _FRAME_OFFSET),
            'names': (('<u4', (words,)), self.names_offset),
        }
        for name, count, place in zip(QUANTITIES, self.counts, self.places, strict=True):
            fields['n_' + name] = (self.order + 'u4', place[0])
            if count:
                fields[name] = ((self.order + 'f8', (count,)), place[1])
        return np.dtype(
            {
                'names': list(fields),
                'formats': [form for form, _ in fields.values()],
                'offsets': [offset for _, offset in fields.values()],
                'itemsize': length,
            }
        )

    @cached_property
    def record(self) -> np.dtype[np.void]:
        """Return the numpy record type of messages without padding at the end."""
        return self.dtype(self.end)

    @cached_property
    def stamp(self) -> struct.Struct:
        """Return the binary format of the header stamp: seconds and nanoseconds."""
        return struct.Struct(self.order + 'iI')

    @cached_property
    def number(self) -> np.dtype[np.float64]:
        """Return the numpy type of a value in the message."""
        return np.dtype(self.order + 'f8')

    @cached_property
    def values(self) -> tuple[tuple[int, int], ...]:
        """Return the number of values and the byte position of the first value, by quantity."""
        return tuple((n, begin) for n, (_, begin) in zip(self.counts, self.places, strict=True))

    @cached_property
    def fixed(self) -> tuple[npt.NDArray[np.void], npt.NDArray[np.void]]:
        """Return a template and a mask; the mask marks the bits that all messages share."""
        expected, mask = np.zeros((2, 1), self.record)
        numbers = {'encapsulation': int(self.order == '<'), 'frame_length': self.frame_length}
        numbers |= {f'n_{name}': n for name, n in zip(QUANTITIES, self.counts, strict=True)}
        for name, value in numbers.items():
            expected[name], mask[name] = value, np.iinfo(mask.dtype[name]).max
        text, bits = (record['names'][0].view(np.uint8) for record in (expected, mask))
        text[:4] = np.frombuffer(struct.pack(self.order + 'I', len(self.names)), np.uint8)
        bits[:4] = 255
        position = 4
        for name in self.names:
            position = _align(position, 4)
            raw = name.encode() + b'\0'
            end = position + 4 + len(raw)
            raw = struct.pack(self.order + 'I', len(raw)) + raw
            text[position:end], bits[position:end] = np.frombuffer(raw, np.uint8), 255
            position = end
        return expected, mask

    @cached_property
    def _fixed_bits(self) -> tuple[int, int]:
        """Return the bytes and the mask of `fixed` as integers, for fast comparison."""
        fixed, mask = (int.from_bytes(record.tobytes(), 'little') for record in self.fixed)
        return fixed, mask

    def is_of(self, data: bytes) -> bool:
        """Return whether a serialised message has this layout; padding is ignored."""
        fixed, mask = self._fixed_bits
        complete = self.end <= len(data) <= self.end + self.spare
        return complete and int.from_bytes(data[: self.end], 'little') & mask == fixed

    def fits(self, rows: npt.NDArray[np.void]) -> npt.NDArray[np.bool_]:
        """Return a mask of the records in an array that have this layout."""
        fixed, mask = self.fixed
        expected, bits = fixed['names'][0], mask['names'][0]
        names = rows['names']
        # Padding is usually equal in all rows, so a comparison with the first row suffices.
        reference = names[0]
        if np.array_equal(reference & bits, expected):
            equal = names == reference
            same = np.ones(len(rows), dtype=np.bool_) if equal.all() else equal.all(axis=1)
        else:
            same = np.zeros(len(rows), dtype=np.bool_)
        if not same.all():
            rest = np.flatnonzero(~same)
            same[rest] = ((names[rest] & bits) == expected).all(axis=1)
        for name in ('encapsulation', 'frame_length', *(f'n_{name}' for name in QUANTITIES)):
            same &= rows[name] == fixed[name]
        return np.asarray(same)


def _align(position: int, size: int) -> int:
    """Round a byte position up to a multiple of a field size, counted from byte 4."""
    return ((position - 4 + size - 1) & -size) + 4
