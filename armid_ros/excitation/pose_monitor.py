# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which measured positions of an arm are believed, and whether the arm is at rest."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

from armid_ros.excitation.supervision import MeasuredPose
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

#: Joint states that have to agree before anything is done because of where the arm is.
AGREEING = 5
#: A joint that is slower is at rest [rad/s or m/s].
AT_REST = 0.02
#: Range of the positions of a joint at rest, encoder noise included [rad or m].
_STILL = 0.004
#: How long a rejected position counts against the others [s].
_WINDOW = 0.5
#: Error of a position that the velocity limit does not bound: encoder noise [rad or m].
_NOISE = 0.02
#: Time over which a velocity is a difference of positions [s]: noise of 0.0001 rad is 0.01 rad/s.
_DIFFERENCE = 0.01
#: Delay of a transport: stamps may be further apart than arrivals by this much [s].
_TRANSPORT = 0.1
#: Velocity of a joint whose description states none [rad/s or m/s]: a turn a second.
_UNSTATED_VELOCITY = 2.0 * np.pi
#: Largest position of a joint without position limits [rad or m]; beyond, it is no position.
_FARTHEST = 1e4


class JointState(NamedTuple):
    """
    Joint state of some joints, of the arm or not.

    Attributes
    ----------
    names : tuple of str
        Joints.
    position, velocity : ndarray
        Position [rad or m] and velocity [rad/s or m/s] of each; velocity may be empty.
    stamp_ns : int
        Stamp [ns]; 0: none.

    """

    names: tuple[str, ...]
    position: FloatArray
    velocity: FloatArray
    stamp_ns: int


class _State(NamedTuple):
    """Positions and velocities of the arm's joints of one message, and when it arrived [s]."""

    arrived: float
    stamp_ns: int
    q: FloatArray
    dq: FloatArray


@dataclass
class _Source:
    """Messages with one list of names: where the arm's joints are in it, and recent states."""

    columns: npt.NDArray[np.int_]
    joints: npt.NDArray[np.int_]
    states: deque[_State] = field(default_factory=deque)
    rivals: list[_State] = field(default_factory=list)


class PoseMonitor:
    """
    Recursive filter of the joint states of one arm.

    A position is believed if it is finite, within the position limits, newer than the last
    believed one, and reachable from it at the velocity limit. Positions that contradict the last
    believed one are believed when `AGREEING` of them agree with each other and no other position
    was believed meanwhile.

    Parameters
    ----------
    robot : Robot
        States the limits.
    tolerance : float
        Distance beyond a position limit at which a position is still believed [rad or m].

    Attributes
    ----------
    pose : MeasuredPose
        Last believed positions.
    rejected : int
        Joint states that were not believed.

    """

    def __init__(self, robot: Robot, tolerance: float) -> None:
        limit = robot.velocity_limit
        self.pose = MeasuredPose.unknown(robot.joints)
        self._units = robot.position_units
        self._velocity = np.where(np.isfinite(limit) & (limit > 0.0), limit, _UNSTATED_VELOCITY)
        self._lower = np.maximum(robot.lower - tolerance, -_FARTHEST)
        self._upper = np.minimum(robot.upper + tolerance, _FARTHEST)
        self._sources: dict[tuple[str, ...], _Source] = {}
        self._rejections: deque[tuple[float, str]] = deque(maxlen=4 * AGREEING)
        self.rejected = 0

    @property
    def sources(self) -> int:
        """Count the different lists of joints that were received."""
        return len(self._sources)

    def update(self, message: JointState, now: float) -> None:
        """Take the joint state of a message that arrived now [s] into account."""
        source = self._source(message.names)
        if not len(source.joints):
            return
        q, dq = (
            values[source.columns]
            if len(values) == len(message.names)
            else np.full(len(source.joints), np.nan)
            for values in (message.position, message.velocity)
        )
        state = _State(now, message.stamp_ns, q, np.nan_to_num(dq, posinf=0.0, neginf=0.0))
        fault = self._outside(source.joints, q)
        if fault:
            self._reject(fault, now)
            return
        last = source.states[-1] if source.states else None
        if last is not None and last.stamp_ns == state.stamp_ns and np.array_equal(last.q, q):
            if state.stamp_ns:
                return  # the same message once more
        seen = self.pose.seen[source.joints].max()
        before = self.pose.q[source.joints]
        fault = self._unreachable(source.joints, state, last or _State(seen, 0, before, dq))
        if fault:
            self._reject(fault, now)
            if source.rivals and self._unreachable(source.joints, state, source.rivals[-1]):
                source.rivals.clear()
            source.rivals.append(state)
            if len(source.rivals) < AGREEING or seen >= source.rivals[0].arrived:
                return
            source.states.clear()
        source.rivals.clear()
        self._believe(source, state, message)

    def contradiction(self, now: float, count: int = AGREEING) -> str:
        """Return why so many positions of the last 0.5 s were rejected; empty: fewer were."""
        recent = [fault for arrived, fault in self._rejections if now - arrived <= _WINDOW]
        return recent[-1] if len(recent) >= count else ''

    def velocity(self) -> FloatArray:
        """Return the velocity of each joint, shape (n,) [rad/s or m/s]; NaN: unknown."""
        velocity = np.full(len(self.pose.joints), np.nan)
        for source in self._sources.values():
            states = source.states
            for state in reversed(states):
                passed = states[-1].arrived - state.arrived
                if passed >= _DIFFERENCE:
                    velocity[source.joints] = (states[-1].q - state.q) / passed
                    break
        return velocity

    def unsteady(self, span: float, count: int = AGREEING) -> str | None:
        """
        Return why the arm is not at rest.

        Parameters
        ----------
        span : float
            Time that the joint states have to cover [s].
        count : int
            Joint states of each joint that are needed.

        Returns
        -------
        str or None
            Empty: it is at rest. None: there are too few joint states to decide.

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
            dq = np.mean([state.dq for state in states[first:]], axis=0)
            moved = np.ptp(q, axis=0)
            for j, distance, velocity in zip(source.joints, moved, dq, strict=True):
                speed = distance / covered if distance > _STILL else 0.0
                speed = max(speed, abs(velocity))
                if speed > AT_REST:
                    unit = f'{self._units[j]}/s'
                    return f"joint '{self.pose.joints[j]}' moves at {speed:.2g} {unit}"
            decided.update(source.joints.tolist())
        return '' if len(decided) == len(self.pose.joints) else None

    def _source(self, names: tuple[str, ...]) -> _Source:
        if names in self._sources:
            return self._sources[names]
        joints = self.pose.joints
        own = [(column, joints.index(name)) for column, name in enumerate(names) if name in joints]
        columns, indices = np.array(own, dtype=int).reshape(-1, 2).T
        source = self._sources[names] = _Source(columns, indices)
        return source

    def _outside(self, joints: npt.NDArray[np.int_], q: FloatArray) -> str:
        """Return which position is no number or outside the limits."""
        inside = (q >= self._lower[joints]) & (q <= self._upper[joints])
        if inside.all():
            return ''
        k = int(np.argmin(inside))
        j = joints[k]
        return (
            f"the position of joint '{self.pose.joints[j]}' is {q[k]:.4g} {self._units[j]}, "
            f'outside its limits {self._lower[j]:.4g} to {self._upper[j]:.4g} {self._units[j]}'
        )

    def _unreachable(self, joints: npt.NDArray[np.int_], state: _State, last: _State) -> str:
        """Return which position cannot be reached from the last one, or that a stamp is older."""
        if state.stamp_ns and state.stamp_ns <= last.stamp_ns:
            back = (last.stamp_ns - state.stamp_ns) * 1e-9
            return (
                f'different joint states are stamped alike, or {back:.3g} s back in time: is '
                'there another publisher?'
            )
        passed = state.arrived - last.arrived
        if state.stamp_ns and last.stamp_ns:
            between = (state.stamp_ns - last.stamp_ns) * 1e-9
            passed = max(passed, min(between, passed + _TRANSPORT))
        step = np.abs(state.q - last.q)
        beyond = step - _NOISE - self._velocity[joints] * max(passed, 0.0)
        k = int(np.argmax(beyond))
        if not beyond[k] > 0.0:  # NaN where nothing was known
            return ''
        j, unit = joints[k], self._units[joints[k]]
        return (
            f"the position of joint '{self.pose.joints[j]}' goes from {last.q[k]:.4g} to "
            f'{state.q[k]:.4g} {unit} within {passed:.3g} s, faster than its limit of '
            f'{self._velocity[j]:.3g} {unit}/s: is there another publisher?'
        )

    def _reject(self, fault: str, now: float) -> None:
        self._rejections.append((now, fault))
        self.rejected += 1

    def _believe(self, source: _Source, state: _State, message: JointState) -> None:
        states = source.states
        states.append(state)
        while len(states) > AGREEING and state.arrived - states[1].arrived > _WINDOW:
            states.popleft()
        self.pose = self.pose.updated(
            message.names, message.position.tolist(), message.stamp_ns, state.arrived
        )
