# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decode serialised JointState messages into arrays, in blocks or one by one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
import math
from typing import NamedTuple

from armid_ros.motion import FloatArray, read_only, Samples
from armid_ros.recording.joint_state.layout import JointStateLayout, MalformedMessage
from armid_ros.recording.message_types import QUANTITIES
from armid_ros.recording.source import IntArray, MessageBlock, records_at
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class JointSamples:
    """
    Time stamps, positions, velocities and efforts of some joints in N samples.

    Attributes
    ----------
    joints : tuple of str
        Names of the k joints, in the requested order.
    stamps : ndarray, shape (N,)
        Time stamps, for messages the header stamps [ns].
    values : tuple of three ndarray, each of shape (N, k)
        Positions, velocities, efforts [rad or m, their rate, N m or N]; None for a quantity that
        no message has, NaN for missing values.
    receive, number : ndarray, shape (N,), or None
        Time at which each message was recorded [ns], and its index in the topic.

    """

    joints: tuple[str, ...]
    stamps: IntArray
    values: tuple[FloatArray | None, ...]
    receive: IntArray | None = None
    number: IntArray | None = None

    def __len__(self) -> int:
        """Return the number of samples N."""
        return len(self.stamps)

    def select(self, samples: Samples) -> JointSamples:
        """Return the samples that a slice, mask or index array selects."""
        values = tuple(None if v is None else v[samples] for v in self.values)
        receive, number = (
            None if one is None else one[samples] for one in (self.receive, self.number)
        )
        return JointSamples(self.joints, self.stamps[samples], values, receive, number)

    def columns(self, joints: Sequence[str]) -> JointSamples:
        """Return the samples of selected joints, in the given order."""
        if tuple(joints) == self.joints:
            return self
        chosen = [self.joints.index(joint) for joint in joints]
        values = tuple(None if v is None else v[:, chosen] for v in self.values)
        return replace(self, joints=tuple(joints), values=values)

    @property
    def nbytes(self) -> int:
        """Memory that the arrays use [bytes]."""
        arrays = (self.stamps, self.receive, self.number, *self.values)
        return sum(array.nbytes for array in arrays if array is not None)


class JointStateDecoder:
    """
    Decoder of the JointState messages of one topic, with a cache of message layouts.

    Attributes
    ----------
    messages : int
        Number of messages decoded or dropped so far.
    malformed : int
        Number of dropped messages: not a JointState, or arrays that do not fit the names.
    first_problem : str
        Error of the first dropped message.
    names_seen : dict
        All joint names found so far, as keys in order of appearance.
    others : mapping of str to (float, float)
        Lowest and highest position of joints that were not requested [rad or m].

    """

    def __init__(self, joints: Sequence[str], expected: int = 0) -> None:
        """
        Create a decoder that extracts the values of the given joints.

        Parameters
        ----------
        joints : sequence of str
            Joints to decode, in this order.
        expected : int
            Expected number of messages, for which memory is reserved.

        """
        self._wanted = tuple(joints)
        self._expected = expected
        self._free: dict[tuple[str, int], FloatArray] = {}
        self._plans: dict[int, list[_Plan]] = {}
        self.names_seen: dict[str, None] = {}
        self.others: dict[str, tuple[float, float]] = {}
        self.messages = 0
        self.malformed = 0
        self.first_problem = ''

    def decode(self, block: MessageBlock) -> Iterator[JointSamples]:
        """Yield samples of the requested joints from a block of messages."""
        numbers = np.arange(self.messages, self.messages + len(block), dtype=np.int64)
        self.messages += len(block)
        lengths = block.length
        if len(lengths) and (lengths == lengths[0]).all():
            rows = records_at(block.data, block.start, int(lengths[0]))
            yield from self._decode_equal(rows, numbers, block.log_time)
            return
        for length in np.unique(lengths):
            chosen = np.flatnonzero(lengths == length)
            rows = records_at(block.data, block.start[chosen], int(length))
            yield from self._decode_equal(rows, numbers[chosen], block.log_time[chosen])

    def _decode_equal(
        self, raw: npt.NDArray[np.void], numbers: IntArray, receive: IntArray
    ) -> Iterator[JointSamples]:
        """Yield the samples in messages of equal length."""
        while len(raw):
            plan = self._plan_for(raw[:1])
            if plan is None:
                # Copies of a malformed message are malformed too.
                other = raw != raw[0]
                self.malformed += len(raw) - int(other.sum())
                raw, numbers, receive = raw[other], numbers[other], receive[other]
                continue
            rows = raw.view(plan.dtype)
            fits = plan.layout.fits(rows)
            if fits.all():
                yield from self._read(plan, rows, numbers, receive)
                return
            yield from self._read(plan, rows[fits], numbers[fits], receive[fits])
            raw, numbers, receive = raw[~fits], numbers[~fits], receive[~fits]

    def _read(
        self, plan: _Plan, rows: npt.NDArray[np.void], numbers: IntArray, receive: IntArray
    ) -> Iterator[JointSamples]:
        """Yield samples of the requested joints; update the position ranges of other joints."""
        if plan.others and plan.layout.counts[0] and len(rows):
            positions = rows[QUANTITIES[0]][:, list(plan.others.values())]
            lowest, highest = np.fmin.reduce(positions), np.fmax.reduce(positions)
            for joint, low, high in zip(
                plan.others, lowest.tolist(), highest.tolist(), strict=True
            ):
                if math.isfinite(low) and math.isfinite(high):
                    known = self.others.get(joint, (low, high))
                    self.others[joint] = (min(known[0], low), max(known[1], high))
        if not plan.joints:
            return
        stamps = rows['sec'].astype(np.int64)
        stamps *= 10**9
        stamps += rows['nanosec']
        values: list[FloatArray | None] = []
        for name, count in zip(QUANTITIES, plan.layout.counts, strict=True):
            array = self._reserved(name, len(rows), len(plan.joints)) if count else None
            if array is not None:
                array[:] = rows[name][:, plan.columns]
            values.append(array)
        yield JointSamples(plan.joints, stamps, tuple(values), receive, numbers)

    def _reserved(self, name: str, count: int, joints: int) -> FloatArray:
        """Return an array (count, joints) from the memory reserved for a quantity."""
        free = self._free.get((name, joints))
        if free is None:
            # counts in damaged files are unreliable, so at most 1 GiB is reserved for a quantity
            free = np.empty((min(self._expected, (1 << 30) // (8 * joints)), joints))
        if count > len(free):
            return np.empty((count, joints))
        self._free[name, joints] = free[count:]
        return free[:count]

    def _plan_for(self, first: npt.NDArray[np.void]) -> _Plan | None:
        """Return the decoding plan for messages with the layout of `first`; None if malformed."""
        length = first.dtype.itemsize
        known = self._plans.setdefault(length, [])
        for plan in known:
            if plan.layout.fits(first.view(plan.dtype)).all():
                return plan
        try:
            layout = JointStateLayout.of(first.tobytes())
            names = layout.names
            if len(set(names)) != len(names):
                raise MalformedMessage(f'a joint occurs twice in the names {", ".join(names)}')
            for quantity, count in zip(QUANTITIES, layout.counts, strict=True):
                if count not in (0, len(names)):
                    raise MalformedMessage(
                        f'the message has {count} values of {quantity} for {len(names)} joints'
                    )
        except MalformedMessage as problem:
            self.first_problem = self.first_problem or str(problem)
            return None
        self.names_seen.update(dict.fromkeys(names))
        joints = tuple(name for name in self._wanted if name in names)
        columns = [names.index(name) for name in joints]
        begin = columns[0] if columns else 0
        contiguous = columns == list(range(begin, begin + len(columns)))
        plan = _Plan(
            layout,
            layout.dtype(length),
            joints,
            slice(begin, begin + len(columns)) if contiguous else columns,
            {name: k for k, name in enumerate(names) if name not in joints},
        )
        known.insert(0, plan)
        del known[32:]  # number of layouts of one length in the cache
        return plan


@dataclass(frozen=True)
class _Plan:
    """Array indices of the requested and of the other joints in messages of one layout."""

    layout: JointStateLayout
    dtype: np.dtype[np.void]
    joints: tuple[str, ...]
    columns: slice | list[int]
    others: dict[str, int]


#: Values of a quantity that a message does not have.
_NONE = read_only(np.empty(0))


class JointStateValues(NamedTuple):
    """
    Stamp, joint names and values of one decoded JointState message.

    Attributes
    ----------
    sec, nanosec : int
        Header stamp.
    names : tuple of str
        Joint names; the same object for all messages of one sender.
    position, velocity, effort : ndarray
        Values in the message, usually one per name or none.

    """

    sec: int
    nanosec: int
    names: tuple[str, ...]
    position: FloatArray
    velocity: FloatArray
    effort: FloatArray


class JointStateMessages:
    """Decoder of single JointState messages, with a cache of message layouts."""

    def __init__(self) -> None:
        self._known: list[JointStateLayout] = []

    def read(self, data: bytes) -> JointStateValues:
        """
        Return stamp, joint names and values of one serialised JointState message.

        Raises
        ------
        MalformedMessage
            If the bytes are not a JointState.

        """
        for layout in self._known:
            if layout.is_of(data):
                break
        else:
            layout = JointStateLayout.of(data)
            self._known = [layout, *self._known[:7]]  # one layout per sender on a topic
        sec, nanosec = layout.stamp.unpack_from(data, 4)
        position, velocity, effort = [
            np.frombuffer(data, layout.number, count, begin) if count else _NONE
            for count, begin in layout.values  # cached, as every live message is read here
        ]
        return JointStateValues(sec, nanosec, layout.names, position, velocity, effort)
