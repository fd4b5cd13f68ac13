# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Excitation publisher node: moves an arm along an excitation, supervises and stops it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial, wraps
import math
import time
from typing import Any

from armid_ros.errors import ArmidError, TrajectoryError
from armid_ros.excitation import Excitation, plan_run, TransferPlanner
from armid_ros.excitation.gate import Ending, MotionGate
from armid_ros.excitation.schedule import load_excitation, read_excitation
from armid_ros.excitation.supervision import HANDOVER_TIME, Rehearsal
from armid_ros.files import reading
from armid_ros.nodes.arm_watch import ArmWatch
from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.parameters.excitation import (
    checked,
    make_excitation,
    make_planner,
    PUBLISHER_PARAMETERS,
    SIMULATION,
)
from armid_ros.nodes.parameters.table import declare, NodeParameter
from armid_ros.nodes.qos import LATCHED
from armid_ros.nodes.running.process import run
from armid_ros.nodes.trajectory_controller import TrajectoryController, write_trajectory
import numpy as np
from std_msgs.msg import String

#: Parameters of the end of a run, in the order of `Ending.updated`.
_LIMITS = ('state_timeout', 'tracking_tolerance', 'stopping')


class ExcitationPublisherNode(ArmidNode):
    """
    Node that moves an arm along an excitation and supervises the motion.

    The run is sent as a goal of the action follow_joint_trajectory if a controller offers the
    action, else as a message. The arm must be at rest at the start. It moves slowly from its
    measured position to the excitation, and avoids known obstacles. The arm is stopped on its path
    by the service ~/stop and at the end of the node. It is also stopped if it does not follow,
    if an effort is too large, if joint states are missing or contradictory, or if the controller
    disappears. Every motion passes one `MotionGate`. No message is latched, so a controller that
    starts later does not move the arm.

    """

    table = PUBLISHER_PARAMETERS

    def __init__(
        self,
        excitation: Excitation | None = None,
        planner: TransferPlanner | None = None,
        **kwargs: Any,
    ) -> None:
        """
        Create the node; the arm does not move until a run is started.

        Parameters
        ----------
        excitation : Excitation, optional
            Excitation to run; by default that of the parameters.
        planner : TransferPlanner, optional
            Plans the path to the excitation; by default for the robot of the parameters.
        **kwargs
            Further arguments of rclpy's Node.

        """
        super().__init__('excitation_publisher', **kwargs)
        self._rate = float(self.value('rate'))
        if planner is None:
            planner, unchecked = make_planner(self.value)
            if unchecked:
                self.get_logger().warning(f'not checked: {"; ".join(unchecked)}')
            if excitation is None:
                self.get_logger().info('making the excitation')
                excitation = make_excitation(self.value, self._rate, planner)
        self._planner = planner
        self._excitation = excitation.for_joints(planner.arm.robot.joints)
        self._gate: MotionGate | None = None
        self._ending: Ending | None = None
        self._begun_ns, self._begun, self._tracked = 0, -math.inf, -math.inf
        self._supervised = -math.inf
        self._trouble = self._rehearsed = ''
        self._runs, self._outcome = 0, 'ready'
        self._rehearsal: Rehearsal | None = None
        self._waiting = bool(self.value('start'))
        self._deadline = time.monotonic() + self.value('subscriber_timeout')
        self._controller = TrajectoryController(self, self._on_goal_ended)
        tolerance = self.value('tracking_tolerance')
        self._arm = ArmWatch(self, planner.arm.robot, tolerance, self._on_state)
        self._experiments = self.create_subscription(
            String, 'experiment', self._on_experiment, LATCHED
        )
        for service in (self.start, self.rehearse, self.stop):
            self.offer(f'~/{service.__name__}', service)
        self._timer = self.create_steady_timer(0.05, self.poll)

    def parameters(self) -> Sequence[NodeParameter]:
        """Return the parameters of the node; some defaults differ for a simulation."""
        declare(self, (SIMULATION,))
        table = [p for p in super().parameters() if p is not SIMULATION]
        self._simulated = bool(self.value('simulation') or self.value('use_sim_time'))
        if not self._simulated:
            return table
        # Simulations are exempt: they send no joint states while they check a long trajectory.
        lively = {'speed': 'fast', 'start': True, 'state_timeout': 5.0, 'effort_factor': 0.0}
        return [replace(p, default=lively.get(p.name, p.default)) for p in table]

    @property
    def duration(self) -> float:
        """Duration of approach and excitation together [s]."""
        if self._gate is not None:
            return self._gate.run.duration
        return float(self.value('approach') + self._excitation.sampled_duration(self._rate))

    @property
    def readers(self) -> int:
        """Number of subscribers to joint_trajectory."""
        return self._controller.readers

    @property
    def last_stamp_ns(self) -> int:
        """Oldest time stamp among the present joint positions [ns]."""
        return self._arm.monitor.last_stamp_ns

    @property
    def elapsed(self) -> float | None:
        """
        Return the time since the start of the present run [s]; None without a run.

        A run begins with the approach. A goal is under way until the controller reports its end.

        """
        if self._gate is None:
            return None
        elapsed = self._arm.now() - self._begun
        on_the_way = elapsed < self._gate.run.duration or self._controller.under_way
        return elapsed if on_the_way else None

    def poll(self) -> None:
        """Start a run once controller and joint states exist; stop the run if either is lost."""
        now, patience = self._arm.now(), self.value('state_timeout')
        if self.elapsed is not None:
            # no joint states were processed while the path was planned
            lost = self._arm.staleness(patience) if now - self._begun > patience else ''
            lost = lost or self._arm.monitor.contradiction(now)
            gone = self._controller.trouble(patience)
            if lost or gone:
                self._abort(lost or gone, blocked=not lost)
            return
        if self._gate is not None:
            self._finish_run(self._gate)
        self._supervise_ending()
        if self._rehearsal is not None:
            self._report_rehearsal(self._rehearsal)
        elif self._waiting:
            missing = self._arm.fault_at_start(self._simulated) or self._controller.missing
            if not missing:
                try:
                    self.start()
                except TrajectoryError as error:
                    self._report_trouble(f'not started: {error}')
            elif time.monotonic() > self._deadline:
                self._waiting = False
                self.get_logger().warning(f'{missing}; call ~/start when this is solved')

    def start(self) -> str:
        """Plan the path from the measured position to the excitation; start the run."""
        return self._start(self.value('speed_scaling'))

    def rehearse(self) -> str:
        """Run the excitation slowly, and then report tracking errors and torques."""
        speed = min(self.value('rehearsal_speed'), self.value('speed_scaling'))
        text = self._start(speed)
        assert self._gate is not None
        self._rehearsal = Rehearsal(self._gate.run, self._planner.arm)
        return f'rehearsal at {100.0 * speed:.0f} % of the speed: {text}'

    def _start(self, speed: float) -> str:
        """Plan a run at the share `speed` of the planned speed; send the run to the controller."""
        self._waiting = False
        self._require_no_run()
        fault = self._arm.fault_at_start(self._simulated)
        begin, behind = self._arm.monitor.q, self._arm.behind
        if fault:
            raise TrajectoryError(f'the arm is not started: {fault}')
        planned = plan_run(
            self._excitation.at_speed(speed, self._rate),
            self._planner,
            begin,
            self._rate,
            shortest=self.value('approach'),
            back=False,
        )
        gate = MotionGate.of(planned, self._planner)
        motion = planned.motion()
        # the run starts at the set point, which differs from the measured position
        first = max(math.ceil(HANDOVER_TIME * self._rate), 1)
        message = write_trajectory(motion.select(slice(first, None)))
        self._controller.discover()  # no time passes between the stamp and the sending
        fault = self._arm.fault_since(begin, behind, self._simulated)
        if self.ends():
            fault = 'a signal ends the node'
        if fault:
            raise TrajectoryError(f'the arm is not started: during planning, {fault}')
        now = self.get_clock().now()
        if not self.value('zero_stamp'):
            message.header.stamp = now.to_msg()
        receiver = self._controller.begin(message)
        # the controller starts when its own clock reaches the stamp
        late = self._arm.stamps.late if not (self.value('zero_stamp') or self._simulated) else 0.0
        self._begun_ns = now.nanoseconds
        self._begun = self._supervised = self._arm.now() + late
        self._gate, self._ending, self._rehearsal = gate, None, None
        self._arm.overloads[:] = 0
        self._trouble = self._rehearsed = ''
        self._runs, self._outcome = self._runs + 1, 'complete'  # unless the run is stopped
        return self.log(
            f'sent a run of {planned.duration:g} s, with {planned.approach.duration:.1f} s of '
            f'approach, to {receiver}'
        )

    def stop(self) -> str:
        """Stop the arm on its path; at a second call, stop again an arm that still moves."""
        self._waiting = False
        if self._gate is not None:
            elapsed = self._arm.now() - self._begun
            self._stop_run('stopped by ~/stop')
            return self.log(f'stopped {elapsed:.2f} s after the start')
        ending = self._current_ending()
        if ending is None:
            raise TrajectoryError('no excitation is running; call ~/start to start a run')
        if ending.last is None:
            raise TrajectoryError(f'{ending.reason}; stop the arm with the client that moves it')
        now, limits = self._arm.now(), map(self.value, ('tracking_tolerance', 'stopping'))
        motion = ending.stopped_again(self._arm.monitor, now, *limits)
        if motion is None:
            return self.log('the stop was sent before')
        self._ending = replace(ending, last=motion, sent=now)
        self._controller.send_stop(write_trajectory(motion), again=True)
        return self.log('the arm was still on its path, and was stopped again')

    @property
    def activity(self) -> str:
        """Text 'running' during a run, otherwise the outcome of the last run."""
        return 'running' if self.elapsed is not None else self._outcome

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Return the present problem, and values on the progress of the run."""
        elapsed = self.elapsed
        values = {
            'running': int(elapsed is not None),
            'rejected_states': self._arm.monitor.rejected,
            'elapsed': elapsed or 0.0,
            'duration': self.duration,
            'runs': self._runs,
            'run': self._outcome if elapsed is None else 'under way',
        }
        if math.isfinite(self._controller.error):
            values['controller_error'] = self._controller.error
        waiting = 'waiting for a controller and joint states' if self._waiting else ''
        if elapsed is not None and elapsed > self.duration + self.value('state_timeout'):
            waiting = 'the controller does not report the end of the run; ~/stop ends the run'
        return self._trouble or waiting or self._rehearsed, values

    def check(self, values: Mapping[str, Any]) -> None:
        """Raise a TrajectoryError if a new `file` or `use_sim_time` cannot be set now."""
        if 'use_sim_time' in values:
            raise TrajectoryError("the clock ('use_sim_time') can be set only at the start")
        if 'file' in values:
            with reading("parameter 'file'", TrajectoryError):
                self._require_rest()
                self._loaded(values['file'])

    def changed(self, names: frozenset[str]) -> None:
        """Load another excitation after a change of the parameter `file`."""
        if 'file' in names:
            self._excitation, self._rehearsed = self._loaded(self.value('file')), ''

    def _require_no_run(self) -> None:
        """Raise a TrajectoryError during a run."""
        if self.elapsed is not None:
            raise TrajectoryError('an excitation is running; call ~/stop first')

    def _require_rest(self) -> None:
        """Raise a TrajectoryError if the arm may move, as path checks block the supervision."""
        self._require_no_run()
        if self._ending is not None and self._ending.reason:
            raise TrajectoryError('the arm may not be at rest after a stop; repeat the call later')

    def _loaded(self, path: str) -> Excitation:
        if not path:
            raise TrajectoryError("the parameter 'file' is empty; name an excitation.yaml")
        return checked(load_excitation(path), self._planner, path)

    def close(self) -> None:
        """Stop a moving arm, and wait until the controller has received the stop."""
        ending = self._current_ending()
        sent = self._gate is not None or (ending is not None and ending.last is not None)
        if sent and self.context.ok():
            self.stop()
            self._controller.settle(1.0)

    def destroy_node(self) -> None:
        """Stop the arm, then destroy the node."""
        self.close()
        self._controller.close()
        super().destroy_node()

    def guarded(self, callback: Callable[..., Any], source: str) -> Callable[..., Any]:
        """Return a callback whose unexpected exceptions are logged and stop the arm."""

        @wraps(callback)
        def stopping(*args: Any) -> Any:
            try:
                return callback(*args)
            except ArmidError:
                raise
            except Exception as error:
                if self.context.ok() and getattr(self, '_gate', None) is not None:
                    self._abort(f'{source}: {type(error).__name__}: {error}')
                raise

        return super().guarded(stopping, source)

    def _on_state(self, now: float) -> None:
        """Stop the arm if measured positions or efforts deviate from the plan at time `now`."""
        if 0.0 <= now - self._tracked < 0.005:  # often enough
            return
        self._tracked = now
        self._supervise_ending()
        elapsed = self.elapsed
        if elapsed is None or self._gate is None:
            return
        gap, self._supervised = now - self._supervised, now
        gate, monitor, effort = self._gate, self._arm.monitor, self._arm.take_effort()
        stamp_ns = self.last_stamp_ns
        phase = (stamp_ns - self._begun_ns) * 1e-9
        strange = abs(phase - elapsed) > self.value('state_timeout')
        if not stamp_ns or (strange and not self._simulated):
            phase = elapsed  # the stamp is from another clock; simulated joint states may be late
        if self._rehearsal is not None:
            self._rehearsal.add(phase, monitor.q, effort)
        unknown = self._arm.interruption(gap) or monitor.contradiction(now)
        fault = self._arm.fault_on_path(gate.run.at([phase]).q[0], effort, gate.effort)
        if unknown or fault:
            self._abort(unknown or fault, blocked=not unknown)

    def _abort(self, reason: str, *, blocked: bool = False) -> None:
        """Stop the arm and log the reason; hold a blocked arm at its position."""
        elapsed = self._arm.now() - self._begun
        self._stop_run(reason, blocked)
        self._report_trouble(f'stopped {elapsed:.2f} s after the start: {reason}')

    def _stop_run(self, reason: str, blocked: bool = False) -> None:
        """Send a motion that stops the arm on its path, or that holds an arm at rest."""
        gate, monitor, now = self._gate, self._arm.monitor, self._arm.now()
        deviation = gate.deviation(monitor, self._begun)
        motion = gate.stop(now - self._begun, self.value('stopping'), *deviation)
        self._gate = self._rehearsal = None
        self._outcome = 'stopped'
        self._ending = Ending(gate, self._begun, motion, now, reason, blocked)
        ending, held, refused = self._ending.updated(monitor, now, *map(self.value, _LIMITS))
        # positions alone may be frozen while the arm moves
        if held is not None and not refused and monitor.has_velocity:
            self._ending, motion = ending, held
        self._controller.send_stop(write_trajectory(motion))

    def _current_ending(self) -> Ending | None:
        """Return the ended run or None; delete its stop motion if another client moves the arm."""
        ending = self._ending
        if ending is not None and self._controller.taken:
            self._ending = replace(ending, last=None) if ending.reason else None
        return self._ending

    def _supervise_ending(self) -> None:
        """Check that the arm comes to rest after a run; hold a blocked arm at its position."""
        ending = self._current_ending()
        if ending is None:
            return
        monitor, now = self._arm.monitor, self._arm.now()
        self._ending, motion, report = ending.updated(monitor, now, *map(self.value, _LIMITS))
        if motion is not None:
            self._controller.send_stop(write_trajectory(motion), again=True)
        if report:
            self._report_trouble(report)

    def _finish_run(self, gate: MotionGate) -> None:
        self._gate, end = None, gate.run.at([gate.run.duration])
        now, last = self._arm.now(), replace(end, t=np.zeros(1))
        lost = self._arm.interruption(now - self._supervised)
        self._ending = Ending(gate, self._begun, last, now, lost)
        if lost:  # such as by a suspension of the process
            self._rehearsal, self._outcome = None, 'stopped'
            self._report_trouble(f'the run is over: {lost}')
        else:
            self.log(f'run complete: {gate.run.duration:.1f} s, approach included')

    def _on_goal_ended(self, reason: str) -> None:
        """End the run at the end of a controller goal; `reason` is '' after a success."""
        gate, elapsed = self._gate, self._arm.now() - self._begun
        if gate is None:  # the run was stopped before
            ending = self._ending
            if reason and ending is not None and ending.last is not None and not ending.warned:
                self._report_trouble(
                    f'the stop failed: {reason}; if the arm still moves, use the emergency stop'
                )
            return
        if reason:
            self._gate, self._rehearsal, self._outcome = None, None, 'stopped'
            self._ending = Ending(gate, self._begun, None, self._arm.now(), reason)
            self._report_trouble(f'stopped {elapsed:.2f} s after the start: {reason}')
        elif elapsed < gate.run.duration - self.value('state_timeout'):
            self._abort(f'the controller reported the end of a run of {gate.run.duration:.1f} s')
        else:
            self._finish_run(gate)

    def _report_rehearsal(self, rehearsal: Rehearsal) -> None:
        """Log tracking errors and torques of a rehearsal, with advice on the next step."""
        self._rehearsal = None
        report, surprises = rehearsal.report()
        if surprises:
            self._report_trouble(f'rehearsed: {report}; find the cause before ~/start')
        else:
            advice = f'~/start runs it at {100.0 * self.value("speed_scaling"):.0f} % of its speed'
            self._rehearsed = self.log(f'rehearsed: {report}; {advice}')

    def _on_experiment(self, message: String) -> None:
        """Load an excitation from the topic experiment; only ~/start runs it."""
        if self._waiting:
            raise TrajectoryError('an excitation is about to start; send another excitation later')
        self._require_rest()
        excitation = read_excitation(message.data, self._experiments.topic_name)
        self._excitation = checked(excitation, self._planner, self._experiments.topic_name)
        self._rehearsed = ''
        self.log(f'received an excitation of {self._excitation.duration:g} s; ~/start runs it')

    def _report_trouble(self, text: str) -> None:
        self._trouble = text
        self.get_logger().error(text)


main = partial(run, ExcitationPublisherNode)
