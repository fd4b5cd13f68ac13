# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plausibility check of measured positions, and detection of an arm at rest."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from operator import le
from typing import NamedTuple

from armid_ros.excitation.supervision import staleness
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

#: Number of joint states that have to agree before an unexpected position is accepted.
MIN_AGREEING = 5
#: Velocity below which a joint is at rest [rad/s or m/s].
REST_SPEED = 0.02
#: Time window in which rejected positions are counted [s].
_REJECTION_WINDOW = 0.5


class _State(NamedTuple):
    """Positions and velocities of the arm's joints in one message, and its arrival time [s]."""

    arrived: float
    stamp_ns: int
    q: list[float]
    dq: list[float]


@dataclass
class _Source:
    """Sender of joint states: its joints, their limits and its recent messages."""

    columns: npt.NDArray[np.int_]
    joints: list[int]
    lower: list[float]
    upper: list[float]
    velocity: list[float]
    states: deque[_State] = field(default_factory=deque)
    contradicting: list[_State] = field(default_factory=list)


class PoseMonitor:
    """
    Filter that accepts only plausible joint states of one arm.

    A position is accepted if it is finite, within the position limits, newer than the last
    accepted one, and reachable from it at the velocity limit. Positions that contradict the last
    accepted one are accepted when `MIN_AGREEING` of them agree with each other and no other
    position was accepted meanwhile. Two senders of one joint have to agree.

    Parameters
    ----------
    robot : Robot
        Robot with the limits.
    tolerance : float
        Largest distance beyond a position limit of a valid position [rad or m].

    Attributes
    ----------
    rejected : int
        Number of rejected joint states.

    """

    def __init__(self, robot: Robot, tolerance: float) -> None:
        limit = robot.velocity_limit
        self._joints, n = robot.joints, robot.n_joints
        # plain numbers: for a few joints, numpy takes five times as long
        self._q, self._seen, self._stamps = [np.nan] * n, [-np.inf] * n, [0] * n
        self._units = robot.position_units
        # without a limit in the description, a turn per second is assumed
        self._velocity = np.where(np.isfinite(limit) & (limit > 0.0), limit, 2.0 * np.pi)
        farthest = 1e4  # valid position of a joint without position limits [rad or m]
        self._lower = np.maximum(robot.lower - tolerance, -farthest)
        self._upper = np.minimum(robot.upper + tolerance, farthest)
        self._sources: dict[tuple[str, ...], _Source] = {}
        self._rejections: deque[tuple[float, str]] = deque(maxlen=4 * MIN_AGREEING)
        self.rejected = 0

    @property
    def q(self) -> FloatArray:
        """Return the last accepted joint positions, (n,) [rad or m]; NaN before the first."""
        return np.array(self._q)

    @property
    def seen(self) -> FloatArray:
        """Return the arrival times of the positions `q`, (n,) [s]; minus infinity if none."""
        return np.array(self._seen)

    @property
    def last_stamp_ns(self) -> int:
        """Return the oldest timestamp among the last accepted joint positions [ns]."""
        return min(self._stamps)

    @property
    def has_velocity(self) -> bool:
        """Whether the last accepted joint states have finite velocities of all joints."""
        latest = [source.states[-1].dq for source in self._sources.values() if source.states]
        return bool(latest) and bool(np.isfinite(np.concatenate(latest)).all())

    @property
    def sources(self) -> int:
        """Number of senders of joint states, assuming one sender per joint."""
        # lists of joint names with a common joint of the arm count as those of one sender
        groups = [set(source.joints) for source in self._sources.values()]
        others = groups.count(set())
        groups = [group for group in groups if group]
        for joint in range(len(self._joints)):
            shared = [group for group in groups if joint in group]
            groups = [group for group in groups if joint not in group]
            groups += [set().union(*shared)] if shared else []
        return others + len(groups)

    def staleness(self, now: float, timeout: float) -> str:
        """Return a message if a joint position is older than a timeout [s]; otherwise empty."""
        return staleness(self._joints, self.seen, now, timeout)

    def update(
        self,
        names: tuple[str, ...],
        position: FloatArray,
        velocity: FloatArray,
        stamp_ns: int,
        now: float,
    ) -> None:
        """
        Accept or reject the positions of a joint state message.

        Parameters
        ----------
        names : tuple of str
            Joints, which may include joints of other devices.
        position, velocity : ndarray
            Position [rad or m] and velocity [rad/s or m/s] of each; velocity may be empty.
        stamp_ns : int
            Timestamp [ns]; 0: none.
        now : float
            Time of arrival [s].

        """
        source = self._sources.get(names) or self._new_source(names)
        if not source.joints:
            return
        q, dq = (
            values[source.columns].tolist()
            if len(values) == len(names)
            else [np.nan] * len(source.joints)
            for values in (position, velocity)
        )
        state = _State(now, stamp_ns, q, dq)
        fault = self._outside(source, q)
        if fault:
            self._reject(fault, now)
            return
        if stamp_ns and source.states and source.states[-1][1:3] == (stamp_ns, q):
            return  # repeated message
        seen = max(self._seen[j] for j in source.joints)
        fault = self._contradicted(source, state, seen)
        if fault:
            self._reject(fault, now)
            if source.contradicting and self._unreachable(source, state, source.contradicting[-1]):
                source.contradicting.clear()
            source.contradicting.append(state)
            if len(source.contradicting) < MIN_AGREEING or seen >= source.contradicting[0].arrived:
                return
            source.states.clear()
        source.contradicting.clear()
        states = source.states
        states.append(state)
        while len(states) > MIN_AGREEING and now - states[1].arrived > _REJECTION_WINDOW:
            states.popleft()
        for j, value in zip(source.joints, q, strict=True):
            if not stamp_ns or self._stamps[j] != stamp_ns:
                self._q[j], self._seen[j] = value, now
                self._stamps[j] = stamp_ns

    def _new_source(self, names: tuple[str, ...]) -> _Source:
        own = [(k, self._joints.index(x)) for k, x in enumerate(names) if x in self._joints]
        columns, joints = np.array(own, dtype=int).reshape(-1, 2).T
        limits = [x[joints].tolist() for x in (self._lower, self._upper, self._velocity)]
        self._sources[names] = _Source(columns, joints.tolist(), *limits)
        return self._sources[names]

    def contradiction(self, now: float, count: int = MIN_AGREEING) -> str:
        """Return the last reason for rejection if `count` states were rejected in 0.5 s, or ''."""
        recent = [
            fault for arrived, fault in self._rejections if now - arrived <= _REJECTION_WINDOW
        ]
        return recent[-1] if len(recent) >= count else ''

    def velocity(self) -> FloatArray:
        """Return the velocity of each joint, shape (n,) [rad/s or m/s]; NaN: unknown."""
        velocity = np.full(len(self._joints), np.nan)
        for source in self._sources.values():
            states = source.states
            for state in reversed(states):
                passed = states[-1].arrived - state.arrived
                # shortest time between positions for a velocity [s]: noise of 0.0001 rad gives
                # 0.01 rad/s
                if passed >= 0.01:
                    velocity[source.joints] = (np.array(states[-1].q) - state.q) / passed
                    break
        return velocity

    def unsteady(self, span: float, count: int = MIN_AGREEING) -> str | None:
        """
        Return a message on a joint that moves; empty if the arm is at rest, None if unknown.

        Parameters
        ----------
        span : float
            Time that the joint states have to cover [s].
        count : int
            Required number of joint states of each joint.

        Returns
        -------
        str or None
            None: there are too few joint states to decide.

        """
        decided: set[int] = set()
        for source in self._sources.values():
            states = list(source.states)
            first = len(states) - count
            while first > 0 and states[-1].arrived - states[first].arrived < span - 1e-6:
                first -= 1
            covered = states[-1].arrived - states[max(first, 0)].arrived if states else 0.0
            if first < 0 or covered < span - 1e-6:
                continue
            q = np.array([state.q for state in states[first:]])
            measured = [state.dq for state in states[first:]]
            dq = np.nan_to_num(measured, posinf=0.0, neginf=0.0).mean(axis=0)
            moved = np.ptp(q, axis=0)
            for j, distance, velocity in zip(source.joints, moved, dq, strict=True):
                # range of the positions of a joint at rest, encoder noise included [rad or m]
                speed = distance / covered if distance > 0.004 else 0.0
                speed = max(speed, abs(velocity))
                if speed > REST_SPEED:
                    unit = f'{self._units[j]}/s'
                    return f"joint '{self._joints[j]}' moves at {speed:.2g} {unit}"
            decided.update(source.joints)
        return '' if len(decided) == len(self._joints) else None

    def _outside(self, source: _Source, q: list[float]) -> str:
        """Return a message if a position is not finite or outside its limits; otherwise empty."""
        if all(map(le, source.lower, q)) and all(map(le, q, source.upper)):
            return ''
        ranges = zip(source.lower, q, source.upper, strict=True)
        k = next(k for k, (low, value, high) in enumerate(ranges) if not low <= value <= high)
        j = source.joints[k]
        return (
            f"the position of joint '{self._joints[j]}' is {q[k]:.4g} {self._units[j]}, "
            f'outside its limits {self._lower[j]:.4g} to {self._upper[j]:.4g} {self._units[j]}'
        )

    def _contradicted(self, source: _Source, state: _State, seen: float) -> str:
        """Return a message if a state contradicts the last state of any sender, else empty."""
        fault = self._unreachable(source, state, source.states[-1]) if source.states else ''
        if fault or (source.states and source.states[-1].arrived >= seen):
            return fault
        others = _State(seen, 0, [self._q[j] for j in source.joints], state.dq)
        return self._unreachable(source, state, others)

    def _unreachable(self, source: _Source, state: _State, last: _State) -> str:
        """Return a message if a position is unreachable from the last position, or not newer."""
        if state.stamp_ns and state.stamp_ns <= last.stamp_ns:
            back = (last.stamp_ns - state.stamp_ns) * 1e-9
            return (
                f'different joint states have the same stamp, or a stamp {back:.3g} s back in '
                'time: is there another publisher?'
            )
        passed = state.arrived - last.arrived
        if state.stamp_ns and last.stamp_ns:
            between = (state.stamp_ns - last.stamp_ns) * 1e-9
            # transport delays vary: stamps may be this much farther apart than arrivals [s]
            passed = max(passed, min(between, passed + 0.1))
        allowed = max(passed, 0.0)
        # encoder noise, added to the change of position that the velocity limit allows [rad or m]
        beyond = [
            abs(q - before) - 0.02 - velocity * allowed
            for q, before, velocity in zip(state.q, last.q, source.velocity, strict=True)
        ]
        if max(beyond) <= 0.0:
            return ''
        k = int(np.argmax(beyond))
        if not beyond[k] > 0.0:  # NaN before the first position
            return ''
        j = source.joints[k]
        unit = self._units[j]
        return (
            f"the position of joint '{self._joints[j]}' goes from {last.q[k]:.4g} to "
            f'{state.q[k]:.4g} {unit} within {passed:.3g} s, faster than its limit of '
            f'{self._velocity[j]:.3g} {unit}/s: is there another publisher?'
        )

    def _reject(self, fault: str, now: float) -> None:
        self._rejections.append((now, fault))
        self.rejected += 1
