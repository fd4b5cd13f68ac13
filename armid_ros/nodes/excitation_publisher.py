# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The excitation publisher node: takes an arm into an excitation, watches it, and stops it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
import math
import time
from typing import Any

from armid_ros.errors import ArmidError, TrajectoryError
from armid_ros.excitation import (
    brought_to_rest,
    Excitation,
    MeasuredPose,
    plan_run,
    Rehearsal,
    Run,
    slowed,
    tracking_fault,
    TransferPlanner,
)
from armid_ros.excitation.files import load_excitation, read_excitation
from armid_ros.excitation.supervision import HANDOVER, Speedometer
from armid_ros.motion import Motion
from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.messages.measured_pose import efforts, PoseReader
from armid_ros.nodes.messages.stamp_difference import StampDifference
from armid_ros.nodes.parameters.excitation import (
    checked,
    EXCITATION_PARAMETERS,
    make_excitation,
    make_surroundings,
)
from armid_ros.nodes.parameters.run import RUN_PARAMETERS, SIMULATION
from armid_ros.nodes.parameters.table import declare, NodeParameter
from armid_ros.nodes.qos import LATCHED
from armid_ros.nodes.running.process import run
from armid_ros.nodes.trajectory.halting import HaltWatch
from armid_ros.nodes.trajectory.messages import write_trajectory
from armid_ros.nodes.trajectory.senders import TrajectorySenders
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory

#: How often a subscriber is looked for, and whether the arm is still heard of [s].
_LOOK_PERIOD = 0.05
#: How often it is looked whether the arm follows [s].
_TRACKING_PERIOD = 0.02
#: How often it is looked at at all, whatever the rate of joint_states [s].
_POSE_PERIOD = 0.005
#: How long the last message may take to arrive when the node ends [s].
_FAREWELL = 1.0


class ExcitationPublisherNode(ArmidNode):
    """
    Has a trajectory controller, real or simulated, run an excitation.

    It is a goal of the action follow_joint_trajectory where a controller has that, else a message.
    It begins where joint_states say that the arm is, and goes from there to the excitation slowly,
    past what stands around. The arm is stopped when the node is told to, when it ends, when the
    arm does not follow, and when nothing is heard of it or of its controller any more. A message
    is latched and stamped with the time it begins, so that a controller that comes up later does
    not set the arm in motion.

    """

    table = (*EXCITATION_PARAMETERS, *RUN_PARAMETERS)

    def __init__(
        self,
        excitation: Excitation | None = None,
        planner: TransferPlanner | None = None,
        **kwargs: Any,
    ) -> None:
        """
        Make the node.

        Parameters
        ----------
        excitation : Excitation, optional
            What is to be run; by default the one the parameters describe.
        planner : TransferPlanner, optional
            Plans the way to it; by default for the robot that the parameters name.
        **kwargs
            For rclpy's Node.

        """
        super().__init__('excitation_publisher', **kwargs)
        self._rate = float(self.value('rate'))
        if planner is None:
            surroundings = make_surroundings(self.value)
            planner = surroundings.planner
            if surroundings.unchecked:
                self.get_logger().warning(f'not checked: {"; ".join(surroundings.unchecked)}')
            if excitation is None:
                self.get_logger().info('making the excitation')
                excitation = make_excitation(self.value, self._rate, surroundings)
        if excitation is None:
            raise TrajectoryError('a planner needs an excitation to plan the way to')
        self._planner = planner
        self._excitation = excitation.for_joints(planner.arm.robot.joints)
        self._measured = PoseReader(self._excitation.joints)
        self._speed = Speedometer.unknown(len(self._excitation.joints))
        self._stamps = StampDifference(self.get_clock())
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._run: Run | None = None
        self._begun_ns, self._sent_at = 0, -math.inf
        self._looked_at = self._tracked = -math.inf
        self._trouble = self._rehearsed = ''
        self._runs, self._outcome = 0, 'ready'
        self._rehearsal: Rehearsal | None = None
        self._halting = HaltWatch(lambda m: self._controller.insist(self._stamped(m, HANDOVER)))
        self._waiting = bool(self.value('start'))
        self._deadline = time.monotonic() + self.value('subscriber_timeout')
        self._controller = TrajectorySenders(self, self._on_goal_ended)
        self._states = self.create_subscription(
            JointState, 'joint_states', self._on_joint_states, 10, raw=True
        )
        self._experiments = self.create_subscription(
            String, 'experiment', self._on_experiment, LATCHED
        )
        self.offer('~/start', self.start)
        self.offer('~/rehearse', self.rehearse)
        self.offer('~/stop', self.stop)
        self._timer = self.create_timer(_LOOK_PERIOD, self.look, clock=self._steady)

    def parameters(self) -> Sequence[NodeParameter]:
        """Return the parameters; those of a simulation have defaults of their own."""
        declare(self, (SIMULATION,))
        table = [p for p in super().parameters() if p is not SIMULATION]
        self._simulated = bool(self.value('simulation') or self.value('use_sim_time'))
        if not self._simulated:
            return table
        # nothing breaks in a simulation, but it is silent while it works on a long trajectory
        lively = {'speed': 'fast', 'start': True, 'state_timeout': 5.0}
        return [replace(p, default=lively.get(p.name, p.default)) for p in table]

    @property
    def duration(self) -> float:
        """Time from the message to the end of the run, approach included [s]."""
        if self._run is not None:
            return self._run.duration
        return float(self.value('approach') + self._excitation.sampled_duration(self._rate))

    @property
    def readers(self) -> int:
        """Return the number of subscriptions to joint_trajectory."""
        return self._controller.readers

    @property
    def _pose(self) -> MeasuredPose:
        return self._measured.pose

    @property
    def last_stamp_ns(self) -> int:
        """Stamp of the oldest position that the pose of the arm is made of [ns]."""
        return min(self._pose.stamps)

    @property
    def elapsed(self) -> float | None:
        """
        Time since the run began, approach included [s]; None when there is no run.

        A goal is under way until the controller says how it ended, whatever the time.

        """
        if self._run is None:
            return None
        elapsed = (self.get_clock().now().nanoseconds - self._begun_ns) * 1e-9
        on_the_way = elapsed < self._run.duration or self._controller.under_way
        return elapsed if on_the_way else None

    def look(self) -> None:
        """Begin when somebody listens and the arm is heard of; stop it when it is not any more."""
        self._controller.look()
        if self.elapsed is not None:
            # while the way was planned nothing was received, whatever the arm sent
            patience = self.value('state_timeout')
            lost = self._staleness() if self._now() - self._sent_at > patience else ''
            lost = lost or self._controller.trouble(patience)
            if lost:
                self._give_up(lost)
            return
        if self._run is not None:
            self._end_complete(self._run)
        if self._rehearsal is not None:
            self._end_rehearsal(self._rehearsal)
        elif self._waiting:
            self._look_for_partners()

    def start(self) -> str:
        """Plan the way from where the arm is, and publish the run."""
        return self._start(self.value('speed_scaling'))

    def rehearse(self) -> str:
        """Run the excitation slowly; afterwards the status says how the arm followed."""
        speed = min(self.value('rehearsal_speed'), self.value('speed_scaling'))
        text = self._start(speed)
        assert self._run is not None
        self._rehearsal = Rehearsal(self._run, self._planner.arm)
        return f'rehearsal at {100.0 * speed:.0f} % of the speed: {text}'

    def _start(self, speed: float) -> str:
        self._waiting = False
        if self.elapsed is not None:
            raise TrajectoryError('the excitation is under way; ~/stop ends it')
        self._require_ready()
        planned = plan_run(
            self._excitation.at_speed(speed, self._rate),
            self._planner,
            self._pose.q,
            self._rate,
            shortest=self.value('approach'),
            back=False,
        )
        motion = planned.motion()
        first = max(math.ceil(HANDOVER * self._rate), 1)  # the set point is not where the arm is
        message = self._stamped(motion.select(slice(first, None)), first / self._rate)
        receiver = self._controller.begin(message)
        self._trouble, self._rehearsed = '', ''
        self._halting.forget()
        self._run, self._rehearsal = planned, None
        self._runs, self._outcome = self._runs + 1, 'complete'  # unless it is stopped
        return self._tell(
            f'a run of {planned.duration:g} s, {planned.approach.duration:.1f} s of it to get '
            f'there, sent to {receiver}'
        )

    def _require_ready(self) -> None:
        """Refuse to start an arm that cannot be watched, moves, or has another clock."""
        robot, topic = self._planner.arm.robot, self._states.topic_name
        lost = self._staleness() or self._speed.fault(robot.joints, robot.position_units)
        lost = self.missing_clock or (lost and f'{topic}: {lost}')
        if not (lost or self.value('zero_stamp')):
            lost = self._stamps.of_start(topic, self.value('state_timeout'), self._simulated)
        if lost:
            raise TrajectoryError(f'{lost}; the arm is not started')

    def stop(self) -> str:
        """Bring the arm to rest on the path it is on."""
        self._waiting = False
        elapsed = self.elapsed
        if elapsed is None or self._run is None:
            raise TrajectoryError('nothing is under way')
        self._end_run(slowed(self._run, elapsed, self.value('stopping'), self._rate))
        return self._tell(f'stopped {elapsed:.2f} s after the start')

    @property
    def activity(self) -> str:
        """Whether the run is under way, and if not, how the last one ended."""
        return 'running' if self.elapsed is not None else self._outcome

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Say how far the run is."""
        elapsed = self.elapsed
        values = {
            'running': int(elapsed is not None),
            'elapsed': elapsed or 0.0,
            'duration': self.duration,
            'runs': self._runs,
            'run': self._outcome if elapsed is None else 'under way',
        }
        if math.isfinite(self._controller.error):
            values['controller_error'] = self._controller.error
        waiting = 'waiting for a controller and joint states' if self._waiting else ''
        if elapsed is not None and elapsed > self.duration + self.value('state_timeout'):
            waiting = 'the controller does not say that the end is reached; ~/stop gives it up'
        return self._trouble or waiting or self._rehearsed, values

    def objection(self, values: Mapping[str, Any]) -> str:
        """Refuse files that are no excitation of this arm, and any while the arm runs."""
        if 'file' not in values:
            return ''
        if self.elapsed is not None:
            return "parameter 'file': an excitation is under way; ~/stop ends it"
        try:
            self._loaded(values['file'])
        except ArmidError as error:
            return f"parameter 'file': {error}"
        return ''

    def changed(self, names: frozenset[str]) -> None:
        """Take the excitation of a file that was set."""
        if 'file' in names:
            self._excitation = self._loaded(self.value('file'))

    def _loaded(self, path: str) -> Excitation:
        if not path:
            raise TrajectoryError('a running node designs none; name a file')
        return checked(load_excitation(path), self._planner, path)

    def close(self) -> None:
        """Stop the arm, and see to it that the message arrives."""
        if self.elapsed is None or not self.context.ok():
            return
        self.stop()
        self._controller.settle(_FAREWELL)

    def destroy_node(self) -> None:
        """Stop the arm before the node is gone, whoever destroys it."""
        self.close()
        self._controller.close()
        super().destroy_node()

    def _on_joint_states(self, data: bytes) -> None:
        now = self._now()
        message = self._measured.take(data, now)
        if 0.0 <= now - self._looked_at < _POSE_PERIOD:
            return
        self._looked_at = now
        stamp = message.sec * 10**9 + message.nanosec
        self._speed = self._speed.looked(now, self._pose.q)
        self._stamps.take(stamp)
        elapsed = self.elapsed
        stopping, patience = self.value('stopping'), self.value('state_timeout')
        going_on = self._halting.look(now, self._pose, stopping, patience)
        if going_on:
            self._say_trouble(going_on)
        if elapsed is None or self._run is None or now - self._tracked < _TRACKING_PERIOD:
            return
        self._tracked = now
        phase = (stamp - self._begun_ns) * 1e-9
        strange = abs(phase - elapsed) > self.value('state_timeout')
        if not stamp or (strange and not self._simulated):
            phase = elapsed  # the stamp is of another clock; a simulation may just be slow
        if self._rehearsal is not None:
            self._rehearsal.add(phase, self._pose.q, efforts(message, self._pose.joints))
        fault = tracking_fault(
            self._pose.joints,
            self._planner.arm.robot.position_units,
            self._run.at([phase]).q[0],
            self._pose.q,
            self.value('tracking_tolerance'),
        )
        if fault:
            self._give_up(fault, follows=False)

    def _look_for_partners(self) -> None:
        lost = self._staleness()
        missing = self.missing_clock or (lost and f'{self._states.topic_name}: {lost}')
        missing = missing or self._controller.missing
        if not missing:
            try:
                self.start()
            except TrajectoryError as error:
                self._say_trouble(f'not started: {error}')
        elif time.monotonic() > self._deadline:
            self._waiting = False
            self.get_logger().warning(f'{missing}; call ~/start when that has changed')

    def _give_up(self, reason: str, *, follows: bool = True) -> None:
        """Stop the arm: on its path where it follows, else where it was measured."""
        elapsed, stopping = self.elapsed, self.value('stopping')
        if elapsed is None or self._run is None:
            return
        if follows or self._staleness():
            motion = slowed(self._run, elapsed, stopping, self._rate)
        else:
            robot, wanted = self._planner.arm.robot, self._run.at([elapsed])
            measured, velocity = self._pose.q, self._speed.velocity
            motion = brought_to_rest(wanted, measured, velocity, robot, stopping, self._rate)
        self._end_run(motion)
        self._say_trouble(f'stopped {elapsed:.2f} s after the start: {reason}')

    def _end_run(self, motion: Motion) -> None:
        self._run = self._rehearsal = None
        self._outcome = 'stopped'
        self._controller.bring_to_rest(self._stamped(motion, float(motion.t[0])))
        self._expect_rest(float(motion.t[-1]))

    def _end_complete(self, planned: Run) -> None:
        self._run = None
        self._tell(f'run complete: {planned.duration:.1f} s, approach included')

    def _on_goal_ended(self, reason: str) -> None:
        """Take what a controller says of the run: that it is at its end, or why it is not."""
        elapsed = self.elapsed
        if self._run is None:
            return  # it was stopped, and whether the arm is at rest is seen
        if not reason:
            self._end_complete(self._run)
            return
        self._run = None
        self._rehearsal, self._outcome = None, 'stopped'
        self._expect_rest(HANDOVER)
        self._say_trouble(f'stopped {elapsed or 0.0:.2f} s after the start: {reason}')

    def _expect_rest(self, duration: float) -> None:
        """Look from then on whether the arm is at rest that was told to stop."""
        self._halting.expect(self._now() + duration + self.value('state_timeout'), self._pose)

    def _end_rehearsal(self, rehearsal: Rehearsal) -> None:
        """Say how the rehearsal went, and what to do next."""
        self._rehearsal = None
        report = rehearsal.report()
        speed = 100.0 * self.value('speed_scaling')
        advice = f'~/start runs it at {speed:.0f} % of its speed'
        if report.surprises:
            self._say_trouble(f'rehearsed: {report}; look into it before ~/start')
        else:
            self._rehearsed = self._tell(f'rehearsed: {report}; {advice}')

    def _on_experiment(self, message: String) -> None:
        """Take an excitation that somebody planned; ~/start runs it, and nothing else does."""
        if self.elapsed is not None:
            raise TrajectoryError('an excitation is under way; the new one is not taken')
        excitation = read_excitation(message.data, self._experiments.topic_name)
        self._excitation = checked(excitation, self._planner, self._experiments.topic_name)
        self._tell(f'took an excitation of {self._excitation.duration:g} s; ~/start runs it')

    def _say_trouble(self, text: str) -> None:
        self._trouble = text
        self.get_logger().error(text)

    def _staleness(self) -> str:
        return self._pose.staleness(self._now(), self.value('state_timeout'))

    def _now(self) -> float:
        """Return the time that ages are measured in: simulated, or steady [s]."""
        clock = self.get_clock()
        if not clock.ros_time_is_active:
            clock = self._steady
        return float(clock.now().nanoseconds * 1e-9)

    def _stamped(self, motion: Motion, lead: float) -> JointTrajectory:
        """Return the message of a motion that begins now."""
        message = write_trajectory(motion, lead)
        now = self.get_clock().now()
        if not self.value('zero_stamp'):
            message.header.stamp = now.to_msg()
        self._begun_ns, self._sent_at = now.nanoseconds, self._now()
        return message

    def _tell(self, text: str) -> str:
        self.get_logger().info(text)
        return text


def main(args: Sequence[str] | None = None) -> None:
    """Run the node."""
    run(ExcitationPublisherNode, args)


if __name__ == '__main__':
    main()
