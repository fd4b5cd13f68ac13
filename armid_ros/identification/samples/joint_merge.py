# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Order of joints in a message, and merging of joint states that several senders publish."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Longest gap of a sender that is interpolated, in sampling periods of the sender.
_MAX_GAP_PERIODS = 10.0

Moment = tuple[float, FloatArray]


@dataclass
class _Sender:
    """Joints of a sender of joint states, and its samples (s, k joints) not yet merged."""

    joints: tuple[int, ...]
    samples: deque[Moment] = field(default_factory=lambda: deque(maxlen=1000))
    period: float = np.inf

    def take(self, t: float, values: FloatArray) -> None:
        """Add a sample of the sender; clear earlier samples if the time stamp goes back."""
        if self.samples:
            step = t - self.samples[-1][0]
            if step == 0.0:  # noqa: RUF069 - equal stamps differ by zero
                return
            if step < 0.0:
                self.samples.clear()
            elif np.isfinite(self.period):
                self.period += 0.05 * (min(step, _MAX_GAP_PERIODS * self.period) - self.period)
            else:
                self.period = step
        self.samples.append((t, values))

    def at(self, t: float) -> FloatArray | None:
        """Interpolate the sender's signals at a time; return None inside a long gap."""
        while len(self.samples) > 1 and self.samples[1][0] <= t:
            self.samples.popleft()
        first, values = self.samples[0]
        if first == t:
            return values
        if first > t or self.samples[1][0] - first > _MAX_GAP_PERIODS * self.period:
            return None
        second, following = self.samples[1]
        return np.asarray(values + (t - first) / (second - first) * (following - values))


class JointMerger:
    """
    Merger of joint states from several senders with different joints.

    The sender of the first joint defines the times of the merged samples; signals of other senders
    are interpolated linearly between their stamps of the same clock. A joint with two senders is
    taken from the sender that came first.

    Parameters
    ----------
    n_joints : int
        Number of joints of the merged stream.

    """

    def __init__(self, n_joints: int) -> None:
        self._n_joints = n_joints
        self._parts: dict[tuple[int, ...], _Sender] = {}

    @property
    def missing(self) -> tuple[int, ...]:
        """Indices of the joints that no sender has published so far."""
        sent = {joint for part in self._parts for joint in part}
        return tuple(k for k in range(self._n_joints) if k not in sent)

    def take(self, joints: tuple[int, ...], t: float, values: FloatArray) -> list[Moment]:
        """
        Add a sample of several joints; return all samples that are now complete.

        Parameters
        ----------
        joints : tuple of int
            Indices of the k joints.
        t : float
            Time stamp [s].
        values : ndarray, shape (s, k)
            Signals of these joints.

        Returns
        -------
        list of (float, ndarray of shape (s, n))
            Time stamps and signals of all n joints, oldest first.

        """
        self._parts.setdefault(joints, _Sender(joints)).take(t, values)
        if self.missing:
            return []
        # only senders with a joint that no earlier sender has
        found: list[_Sender] = []
        known: set[int] = set()
        for part in self._parts.values():
            if not known.issuperset(part.joints):
                found.append(part)
                known.update(part.joints)
        first, *others = sorted(found, key=lambda part: min(part.joints))
        complete = []
        newest = min((part.samples[-1][0] for part in others), default=np.inf)
        while first.samples and first.samples[0][0] <= newest:
            t, values = first.samples.popleft()
            rest = [part.at(t) for part in others]
            merged = np.empty((len(values), self._n_joints))
            for part, own in zip((*others, first), (*rest, values), strict=True):
                if own is None:
                    break
                merged[:, part.joints] = own
            else:
                complete.append((t, merged))
        return complete


def joint_places(joints: Sequence[str], names: Sequence[str]) -> npt.NDArray[np.intp]:
    """
    Return the index of each of `joints` among the joint names of a message, shape (n,).

    Parameters
    ----------
    joints : sequence of str
        Wanted joints, in the wanted order.
    names : sequence of str
        Joint names of the message, such as JointState.name.

    Returns
    -------
    ndarray of int, shape (n,)
        Indices such that ``position[indices]`` is in the wanted order.

    Raises
    ------
    RecordingError
        If joints are missing or named twice; the message lists them.

    """
    missing = [joint for joint in joints if joint not in names]
    if missing:
        raise RecordingError(
            f'the joint states have no joint {", ".join(missing)}; their joints are '
            f'{", ".join(names) or "none"}'
        )
    twice = [joint for joint in joints if list(names).count(joint) > 1]
    if twice:
        raise RecordingError(
            f'the joint states contain joint {", ".join(twice)} twice; publish each joint once'
        )
    return np.array([list(names).index(joint) for joint in joints], dtype=np.intp)
