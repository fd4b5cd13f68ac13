# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Joints by name, and one stream of joint states out of several that have some joints each."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Periods of a sender that its signals are interpolated across.
_LONGEST = 10.0

Moment = tuple[float, FloatArray]


@dataclass
class _Part:
    """What one sender has sent: joints, and samples of shape (s, k) that are still needed."""

    joints: tuple[int, ...]
    samples: deque[Moment] = field(default_factory=lambda: deque(maxlen=1000))
    period: float = np.inf

    def take(self, t: float, values: FloatArray) -> None:
        if self.samples:
            step = t - self.samples[-1][0]
            if step == 0.0:  # noqa: RUF069 - equal stamps differ by zero
                return
            if step < 0.0:
                self.samples.clear()
            elif np.isfinite(self.period):
                self.period += 0.05 * (min(step, _LONGEST * self.period) - self.period)
            else:
                self.period = step
        self.samples.append((t, values))

    def reaches(self, t: float) -> bool:
        """Return whether what it sends has come to a time."""
        return bool(self.samples) and self.samples[-1][0] >= t

    def at(self, t: float) -> FloatArray | None:
        """Return the values at a time that has been reached; None where nothing is near."""
        while len(self.samples) > 1 and self.samples[1][0] <= t:
            self.samples.popleft()
        first, values = self.samples[0]
        if first == t:
            return values
        if first > t or self.samples[1][0] - first > _LONGEST * self.period:
            return None
        second, following = self.samples[1]
        return np.asarray(values + (t - first) / (second - first) * (following - values))


class JointMerger:
    """
    Put together what several senders say of different joints, at the times of one of them.

    The sender of the first joint gives the times; the others are interpolated linearly between
    their stamps, which are of the same clock. A joint that two senders have is taken from the
    one that came first.

    Parameters
    ----------
    n_joints : int
        Number of joints that are wanted.

    """

    def __init__(self, n_joints: int) -> None:
        self._n_joints = n_joints
        self._parts: dict[tuple[int, ...], _Part] = {}

    @property
    def missing(self) -> tuple[int, ...]:
        """Joints that no sender has sent so far."""
        sent = {joint for part in self._parts for joint in part}
        return tuple(k for k in range(self._n_joints) if k not in sent)

    def take(self, joints: tuple[int, ...], t: float, values: FloatArray) -> list[Moment]:
        """
        Take in a sample of some joints, and return those of all joints that it completes.

        Parameters
        ----------
        joints : tuple of int
            Which joints, k of them.
        t : float
            Stamp [s].
        values : ndarray, shape (s, k)
            Signals of each.

        Returns
        -------
        list of (float, ndarray of shape (s, n))
            Stamps and signals of all joints, oldest first.

        """
        self._parts.setdefault(joints, _Part(joints)).take(t, values)
        if self.missing:
            return []
        # the senders that bring a joint which none before them has
        found: list[_Part] = []
        known: set[int] = set()
        for part in self._parts.values():
            if not known.issuperset(part.joints):
                found.append(part)
                known.update(part.joints)
        first, *others = sorted(found, key=lambda part: min(part.joints))
        complete = []
        while first.samples and all(part.reaches(first.samples[0][0]) for part in others):
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
    Return the positions of wanted joints among the names of a message; others are left out.

    Parameters
    ----------
    joints : sequence of str
        The joints that are wanted, in the order that is wanted.
    names : sequence of str
        Joint names of the message, such as JointState.name.

    Returns
    -------
    ndarray of int, shape (n,)
        ``position[indices]`` is in the order that is wanted.

    Raises
    ------
    RecordingError
        If joints are missing or named twice; the message lists them.

    """
    missing = [joint for joint in joints if joint not in names]
    if missing:
        raise RecordingError(
            f'joint states without {", ".join(missing)}; they name '
            f'{", ".join(names) or "no joints"}'
        )
    twice = [joint for joint in joints if list(names).count(joint) > 1]
    if twice:
        raise RecordingError(f'joint states name {", ".join(twice)} twice')
    return np.array([list(names).index(joint) for joint in joints], dtype=np.intp)
