# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of every motion before it is sent to an arm, and supervision of the end of a run."""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.geometry.paths import clear_line
from armid_ros.excitation.limits import check_limits, Limits, SLOW_VELOCITY
from armid_ros.excitation.pose_monitor import PoseMonitor
from armid_ros.excitation.run import Run
from armid_ros.excitation.supervision import HANDOVER_TIME, slowed
from armid_ros.excitation.transfer import TransferPlanner
from armid_ros.motion import FloatArray, Motion
import numpy as np


@dataclass(frozen=True)
class MotionGate:
    """
    Safety check of each motion before the motion is sent to the arm.

    Attributes
    ----------
    run : Run
        Run that was planned.
    limits : Limits
        Limits of the robot, without a reserve.
    clearance : ClearanceModel or None
        Bodies to keep apart, the floor among them.
    effort : ndarray, shape (n,)
        Largest predicted effort of each joint, at least 10 % of its limit [N m or N].

    """

    run: Run
    limits: Limits
    clearance: ClearanceModel | None
    effort: FloatArray

    @classmethod
    def of(cls, run: Run, planner: TransferPlanner) -> MotionGate:
        """
        Check a planned run; return the gate that checks each motion sent during this run.

        Parameters
        ----------
        run : Run
            The run to send.
        planner : TransferPlanner
            Planner with the arm, limits and bodies.

        Raises
        ------
        TrajectoryError
            If the run exceeds a limit, has too few waypoints for its path, or bodies come too
            close; the message names the joint or the bodies.

        """
        motion, robot = run.motion(), planner.arm.robot
        torque = planner.arm.joint_torque(motion)
        limits = Limits.of(robot, speed=1.0, reserve=False)
        violations = check_limits(limits, motion, torque)
        if violations:
            raise TrajectoryError(f'the run exceeds a limit and was not sent: {violations[0]}')
        run.require_waypoints()
        if planner.clearance is not None:
            # intervals of 0.1 s at the beginning of the proof
            times = np.linspace(0.0, run.duration, int(np.ceil(run.duration / 0.1)) + 1)
            peak = np.abs(motion.ddq).max(axis=0)
            near = planner.clearance.first_fault(run.at, 1.5 * peak, times)
            if near is not None:
                raise TrajectoryError(f'bodies come too close, and the run was not sent: {near}')
        # dry friction of a joint may need a tenth of its limit
        room = np.where(np.isfinite(robot.torque_limit), 0.1 * robot.torque_limit, 0.0)
        return cls(run, limits, planner.clearance, np.maximum(np.abs(torque).max(axis=0), room))

    def deviation(self, monitor: PoseMonitor, begun: float) -> tuple[FloatArray, FloatArray]:
        """
        Return the measured minus the planned position and velocity of each joint.

        Parameters
        ----------
        monitor : PoseMonitor
            Measured positions of the arm.
        begun : float
            When the run began [s].

        Returns
        -------
        q, dq : ndarray, shape (n,)
            Measured minus planned [rad or m, and per second]; NaN: unknown.

        """
        # positions may be old after a loss of joint states
        path, joint = self.run.at(monitor.seen - begun), np.arange(len(monitor.seen))
        return monitor.q - path.q[joint, joint], monitor.velocity() - path.dq[joint, joint]

    def stop(self, phase: float, duration: float, q: FloatArray, dq: FloatArray) -> Motion:
        """
        Return the motion that slows the arm down to rest along the path of the run.

        The whole path was checked before.

        Parameters
        ----------
        phase : float
            Time since the start of the run [s].
        duration : float
            Time to come to rest [s]; longer if the acceleration limits require it.
        q, dq : ndarray, shape (n,)
            Position [rad or m] and velocity [rad/s or m/s] of the arm relative to the run; NaN:
            unknown. The controller needs time to return to the path.

        Returns
        -------
        Motion
            The stop, within the positions and velocities of the run. It exceeds an acceleration
            limit only if the longest stop exceeds it too, because a stop is always sent.

        """
        phase = float(np.clip(phase, 0.0, self.run.duration))
        path = self.run.at([phase])
        # half a cosine takes pi / 2 times as long as constant deceleration; the duration of a
        # run within its limits suffices for a stop
        needed = float((np.abs(path.dq[0]) / self.limits.acceleration).max()) * np.pi / 2.0
        longest = 4.8 * max(duration, min(needed, self.run.duration))
        longer = 1.25  # factor on the duration while an acceleration limit is exceeded
        motion = slowed(self.run, phase, duration, self.run.rate)
        while check_limits(self.limits, motion) and longer * duration <= longest:
            duration *= longer
            motion = slowed(self.run, phase, duration, self.run.rate)
        lead = self._time_of(np.nan_to_num(np.abs(q)), np.nan_to_num(np.abs(dq)))
        reached = int(np.searchsorted(motion.t, lead))
        if reached < len(motion.t):
            return motion.select(slice(reached, None))
        return replace(motion.select(slice(-1, None)), t=np.array([lead]))

    def hold(
        self, set_point: FloatArray, speed: FloatArray, measured: FloatArray, largest: FloatArray
    ) -> Motion:
        """
        Return the motion on a straight line from the set point to the measured position.

        Parameters
        ----------
        set_point, speed : ndarray, shape (n,)
            Set point of the controller [rad or m], and its absolute velocity [rad/s or m/s].
        measured : ndarray, shape (n,)
            Measured position [rad or m].
        largest : ndarray, shape (n,)
            Largest step of each joint [rad or m].

        Raises
        ------
        TrajectoryError
            If the step is larger, leaves the limits or brings bodies too close.

        """
        step = np.abs(measured - set_point)
        if not (step <= largest).all():
            j = int(np.argmax(step - largest))
            joint, unit = self.limits.joints[j], self.limits.unit('position', j)
            raise TrajectoryError(
                f"joint '{joint}' is {step[j]:.3g} {unit} from its set point, more than the "
                f'allowed {largest[j]:.3g} {unit}'
            )
        inside = np.clip(measured, self.limits.lower, self.limits.upper)
        near = clear_line(self.clearance, set_point, inside)
        if near is not None:
            raise TrajectoryError(
                f'{near.first} and {near.second} would be only {near.distance:.4f} m apart'
            )
        return self.rest(inside, step, speed)

    def rest(self, goal: FloatArray, step: FloatArray, speed: FloatArray) -> Motion:
        """Return the motion to rest at a near goal, given each joint's step and speed, (n,)."""
        needed = max(self._time_of(step, speed), HANDOVER_TIME)
        t, still = needed + np.array([0.0, HANDOVER_TIME / 2.0]), np.zeros((2, len(step)))
        return Motion(self.limits.joints, t, np.vstack([goal, goal]), still, still)

    def _time_of(self, step: FloatArray, speed: FloatArray) -> float:
        """Return the time [s] that the joints need for small steps at given initial speeds."""
        velocity = np.where(np.isfinite(self.limits.velocity), self.limits.velocity, SLOW_VELOCITY)
        stopping = speed / self.limits.acceleration
        slowest = stopping + np.sqrt(stopping**2 + step / self.limits.acceleration)
        # duration of a small step, relative to its time at the velocity limit, and to sqrt(step
        # / acceleration limit): 1.875 and 2.4 for a quintic from rest to rest. A quintic with an
        # initial speed needs up to 3.94 times speed / acceleration limit; 6 is a safe value
        return 3.0 * float(max((step / velocity).max(), slowest.max()))


#: Time for which the measured arm has to be at rest [s].
_REST_TIME = 0.1


@dataclass(frozen=True)
class Ending:
    """
    Supervision of the end of a run, until measurements show that the arm is at rest.

    Attributes
    ----------
    gate : MotionGate
        Check of every motion that is sent.
    begun : float
        When the run began [s].
    last : Motion or None
        Latest sent motion, without an approach to its first sample. None: another client
        uses the controller, and no motion is sent.
    sent : float
        Time at which the motion was sent [s].
    reason : str
        Why the run ended.
    blocked : bool
        Whether the arm did not follow and has to be held at its present position.
    warned : str
        Latest reported warning: the arm is 'moving', or its motion is 'unknown'; empty: none.

    """

    gate: MotionGate
    begun: float
    last: Motion | None
    sent: float
    reason: str
    blocked: bool = False
    warned: str = ''

    def stopped_again(
        self, monitor: PoseMonitor, now: float, tolerance: float, duration: float
    ) -> Motion | None:
        """Return another stop motion if the arm still moves along its path; otherwise None."""
        phase = now - self.begun
        if self.last is None or now - self.sent < self.last.t[-1]:
            return None
        if not 0.0 <= phase < self.gate.run.duration:
            return None
        away = np.abs(monitor.q - self.gate.run.at([phase]).q[0]).max()
        if not away <= tolerance or not monitor.unsteady(_REST_TIME, 2):
            return None
        return self.gate.stop(phase, duration, *self.gate.deviation(monitor, self.begun))

    def updated(
        self,
        monitor: PoseMonitor,
        now: float,
        patience: float,
        tolerance: float,
        duration: float,
    ) -> tuple[Ending | None, Motion | None, str]:
        """
        Return the next state of supervision, a motion to send, and a message to report.

        Parameters
        ----------
        monitor : PoseMonitor
            Measured positions of the arm.
        now : float
            Time [s].
        patience : float
            How long after the end of a motion the arm may still move [s].
        tolerance : float
            Largest distance from the set point of an arm that follows [rad or m].
        duration : float
            Duration of a new stop [s].

        Returns
        -------
        Ending or None
            The next state; None: the arm is at rest.
        Motion or None
            Motion to send, if any.
        str
            Message to report; empty if none.

        """
        lost = monitor.staleness(now, patience)
        at_rest = not lost and monitor.unsteady(_REST_TIME) == ''
        if self.last is not None and self.blocked and at_rest:
            return self._held(self.last, monitor, now, tolerance)
        lasts = 0.0 if self.last is None else float(self.last.t[-1])
        if now - self.sent < lasts + patience:
            return self, None, ''
        if lost and not self.reason:  # the run is complete
            return None, None, ''
        if lost:
            unknown = f'{lost}: whether the arm is at rest is unknown; use the emergency stop'
            report = '' if self.warned == 'unknown' else unknown
            return replace(self, warned='unknown'), None, report
        moving = monitor.unsteady(_REST_TIME, 2)
        if moving is None:
            return self, None, ''
        if not moving:
            return None, None, ''
        stop = self.stopped_again(monitor, now, tolerance, duration)
        ending = replace(self, warned='moving')
        if stop is not None:
            ending = replace(ending, last=stop, sent=now)
        if self.warned == 'moving':
            return ending, stop, ''
        if self.last is None:
            return ending, None, f'{self.reason}; {moving}, and another client uses the controller'
        return (
            ending,
            stop,
            f'the arm still moves although it was stopped: {moving}; use the emergency stop',
        )

    def _held(
        self, last: Motion, monitor: PoseMonitor, now: float, tolerance: float
    ) -> tuple[Ending, Motion | None, str]:
        """Move a blocked arm's set point to its measured position, if this step is allowed."""
        ending, measured, elapsed = replace(self, blocked=False), monitor.q, now - self.sent
        begin = self.gate.run.at([self.sent - self.begun])
        over = elapsed >= last.t[-1]
        row = min(int(np.searchsorted(last.t, elapsed)), len(last.t) - 1)
        path, row = (last, row) if elapsed > 0.0 else (begin, 0)
        set_point, speed = path.q[row], np.abs(path.dq[row])
        if np.abs(measured - set_point).max() <= tolerance:
            return (ending if over else self), None, ''
        # a joint takes back what it did since the fault, and as much as it was off before, at most
        # three times the tracking tolerance
        largest = np.abs(set_point - begin.q[0]) + 3.0 * tolerance
        try:
            motion = self.gate.hold(set_point, speed, measured, largest)
        except TrajectoryError as error:
            report = (
                f'{self.reason}; the set point stays where it is: {error}; if the arm is pushed, '
                'use the emergency stop'
            )
            if over:
                return ending, None, report
            motion = self.gate.rest(set_point, np.zeros(len(speed)), speed)
            return replace(ending, last=motion, sent=now), motion, report
        return replace(ending, last=motion, sent=now), motion, ''
