# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated arm node: follows trajectories, and publishes joint states like a robot driver."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.arm.model_file import load_model, read_model
from armid_ros.errors import ArmidError, ModelError, RobotError, TrajectoryError
from armid_ros.files import reading
from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.parameters.table import NodeParameter, setting
from armid_ros.nodes.qos import LATCHED, SAMPLES, STREAM
from armid_ros.nodes.running.process import run
from armid_ros.nodes.running.real_time import RealTime
from armid_ros.recording.columns import numbers, per_joint
from armid_ros.recording.elastic import imu_topic, LINK, REFERENCE
from armid_ros.recording.trajectory import waypoints_of
from armid_ros.robots import load_robot, parse_gravity
from armid_ros.simulation import Reference, Sensors, SimulatedArm
from armid_ros.simulation.elastic import make_simulated_arm, shipped_arm
from armid_ros.simulation.run import whole_steps
from armid_ros.simulation.simulated_arm import LinkSample
from builtin_interfaces.msg import Time as TimeMessage
import numpy as np
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.time import Time
from rclpy.timer import Timer
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory

#: Longest accepted trajectory [s]; its waypoints are checked against the limits before its start.
MAX_DURATION = 3600.0
#: Parameters of the sensors that can be set while the arm moves, one number or one per joint.
_SENSORS = ('torque_noise', 'position_noise', 'velocity_noise', 'resolution')


def _measurement_publisher(node: Node, kind: type, topic: str) -> Publisher:
    """Create a publisher of measurements, whose QoS users can override."""
    options = QoSOverridingOptions.with_default_policies()
    return node.create_publisher(kind, topic.lstrip('/'), SAMPLES, qos_overriding_options=options)


class _ElasticTopics:
    """Publishers for an elastic arm: link positions, drive references, accelerometers."""

    def __init__(self, node: Node, arm: SimulatedArm) -> None:
        self._link = (
            _measurement_publisher(node, JointState, LINK),
            JointState(name=list(arm.joints)),
        )
        self._reference = (
            _measurement_publisher(node, JointState, REFERENCE),
            JointState(name=list(arm.joints)),
        )
        self._imus = []
        for link in arm.plant.robot.links:
            message = Imu()
            message.header.frame_id = link
            message.orientation_covariance[0] = message.angular_velocity_covariance[0] = -1.0
            self._imus.append((_measurement_publisher(node, Imu, imu_topic(link)), message))

    def publish(self, sample: LinkSample, stamp: TimeMessage) -> None:
        """Publish the measurements of links and drives with the same time stamp."""
        for (publisher, message), q, dq in (
            (self._link, sample.q, sample.dq),
            (self._reference, sample.asked_q, sample.asked_dq),
        ):
            message.header.stamp = stamp
            message.position = q.tolist()
            message.velocity = dq.tolist()
            publisher.publish(message)
        for (publisher, message), felt in zip(
            self._imus, sample.acceleration.tolist(), strict=True
        ):
            message.header.stamp = stamp
            acceleration = message.linear_acceleration
            acceleration.x, acceleration.y, acceleration.z = felt
            publisher.publish(message)


class SimulatedArmNode(ArmidNode):
    """
    Node that simulates an arm: it follows trajectories and publishes joint states.

    In real time the stamps are those of the system clock. At another real_time_factor the node
    also publishes /clock. With use_sim_time the simulation follows /clock. A model on the topic
    `model`, or a changed parameter effects, changes the dynamics while the arm moves. An arm with
    elastic joints is measured on both sides: joint_states holds the motors and link/joint_states
    the links. reference/joint_states holds the references of the drives, and <link>/imu the
    accelerometers.

    """

    table = (
        NodeParameter('robot', 'humanoid_arm', 'A shipped robot, or the path of a URDF or xacro.'),
        NodeParameter(
            'gravity',
            '',
            'earth, moon, or x,y,z in the base frame; empty: that of the model, or earth [m/s^2].',
            check=lambda text: text and parse_gravity(text),
        ),
        NodeParameter(
            'model', '', 'Path of a model.yaml; empty: the description and the effects.'
        ),
        setting(
            'effects',
            [''],
            'Effects, each as NAME[@joint+joint]:quantity=value,quantity=value; a change applies '
            'to the moving arm.',
        ),
        NodeParameter(
            'start', '', 'Initial position q1,q2,...; empty: middle of the limits [rad or m].'
        ),
        *(
            setting(name, [0.0], f'{text}, one number or one per joint; 0: none.', unit)
            for name, text, unit in (
                ('torque_noise', 'Standard deviation of measured torques', 'N m or N'),
                ('position_noise', 'Standard deviation of measured positions', 'rad or m'),
                ('velocity_noise', 'Standard deviation of measured velocities', 'rad/s'),
                ('resolution', 'Step of the encoders', 'rad or m'),
            )
        ),
        NodeParameter(
            'torque_delay', 0, 'Delay of the torque measurement [time steps].', limits=(0, 100000)
        ),
        NodeParameter(
            'loop_gain', 1.0, 'Factor on the loop gains of elastic joints.', limits=(0.0, 10.0)
        ),
        NodeParameter('seed', 0, 'Random seed of the noise.', limits=(0, 2**62)),
        NodeParameter(
            'time_step', 0.001, 'Time step of the integration.', 's', limits=(1e-5, 0.01)
        ),
        setting('rate', 1000.0, 'Publishing rate of joint_states.', 'Hz', limits=(0.1, 100000.0)),
        setting(
            'real_time_factor',
            1.0,
            'Simulated time per real time, if the computer is fast enough; slow subscribers lose '
            'messages. 0: moves only on request.',
            limits=(0.0, 1000.0),
        ),
        setting(
            'clock_rate',
            100.0,
            'Rate of /clock in simulated time; at most the rate of joint_states.',
            'Hz',
            limits=(0.1, 100000.0),
        ),
    )

    def __init__(
        self,
        arm: SimulatedArm | None = None,
        start_ns: int | None = None,
        **kwargs: Any,
    ) -> None:
        """
        Create the node, and publish the robot_description.

        Parameters
        ----------
        arm : SimulatedArm, optional
            Simulated arm; by default that of the parameters.
        start_ns : int, optional
            First stamp [ns]; by default the time of the node's clock.
        **kwargs
            Further arguments of rclpy's Node.

        """
        super().__init__('simulated_arm', **kwargs)
        self._without_effects: ArmModel | None = None
        self._arm = self._described() if arm is None else arm
        self._dt_ns = round(self._arm.plant.dt * 1e9)
        self._stride = self._steps_at(self.value('rate'))  # refused before publishers are made
        self._follows = bool(self.value('use_sim_time'))
        self._origin_ns = start_ns
        if start_ns is None and not self._follows:
            self._origin_ns = self.get_clock().now().nanoseconds
        self._pending: tuple[int, Reference] | None = None
        self.real_time = RealTime(lambda: self._arm.t, self.step)
        self._skipped = 0.0
        self._states = _measurement_publisher(self, JointState, 'joint_states')
        self._message = JointState(name=list(self._arm.joints))
        self._elastic_topics = None
        if self._arm.plant.springs is not None:
            self._elastic_topics = _ElasticTopics(self, self._arm)
        self._clock_publisher: Publisher | None = None
        self._timer: Timer | None = None
        self._set_rates()
        description = self.create_publisher(String, 'robot_description', LATCHED)
        description.publish(String(data=self._arm.plant.robot.urdf))
        self.create_subscription(JointTrajectory, 'joint_trajectory', self._on_trajectory, STREAM)
        self.create_subscription(String, 'model', self._on_model, LATCHED)
        self.offer('~/reset', self.reset)

    def _described(self) -> SimulatedArm:
        """Return a new simulated arm with the properties in the ROS parameters."""
        gravity, drives = self.value('gravity'), None
        if self.value('model'):
            arm = load_model(self.value('model'))
            if gravity:
                arm = replace(arm, robot=arm.robot.with_gravity(parse_gravity(gravity)))
        else:
            arm, drives = shipped_arm(load_robot(self.value('robot'), gravity=gravity or 'earth'))
        self._without_effects, n = arm, arm.robot.n_joints
        with reading("parameter 'start'", RobotError):
            start = numbers(self.value('start'))
            if start and len(start) != n:
                raise RobotError(f'the start pose has {len(start)} numbers for {n} joints')
        return make_simulated_arm(
            self._with_effects(self.value('effects')),
            rng=np.random.default_rng(self.value('seed')),
            warn=self.get_logger().warn,
            drives=drives,
            gain=self.value('loop_gain'),
            dt=self.value('time_step'),
            sensors=self._sensors(arm.robot.joints, {}),
            start=start or None,
        )

    def _steps_at(self, rate: float) -> int:
        """Return the number of simulation steps per joint state at a publishing rate [Hz]."""
        return whole_steps(1.0 / rate, self._arm.plant.dt, f'a rate of {rate:g} Hz')

    def _set_rates(self) -> None:
        rate = self.value('rate')
        self._stride = self._steps_at(rate)
        self._factor = 0.0 if self._follows else self.value('real_time_factor')
        self._clock_due, self._clock_period = 0, round(1e9 / self.value('clock_rate'))
        if self._clock_publisher is None and not self._follows and self._factor != 1.0:  # noqa: RUF069 - a parameter of the node
            self._clock_publisher = self.create_publisher(ClockMessage, '/clock', STREAM)
        if self._timer is not None:
            self.destroy_timer(self._timer)
        self._timer = None
        self.real_time.begin()
        if self._follows:
            self._timer = self.create_timer(1.0 / rate, self.follow)
        elif self._factor:
            period = max(1.0 / (rate * self._factor), 0.0005)
            self._timer = self.create_steady_timer(period, self.catch_up)

    @property
    def stamp_ns(self) -> int:
        """Time stamp of the arm's present state [ns]."""
        return (self._origin_ns or 0) + self._arm.steps * self._dt_ns

    @property
    def joint_state(self) -> JointState:
        """Joint state message that was published last."""
        return self._message

    @property
    def moving(self) -> bool:
        """Whether the arm follows a trajectory, or a trajectory is about to start."""
        return self._pending is not None or self._arm.t < self._arm.ends_at

    @property
    def readers(self) -> int:
        """Number of subscribers to joint_states."""
        return int(self._states.get_subscription_count())

    @property
    def hardware(self) -> str:
        """Name of the robot on /diagnostics."""
        return str(self._arm.plant.robot.name)

    def step(self) -> int:
        """Simulate to the next joint state and publish it; return its time stamp [ns]."""
        if self._pending is not None and self._pending[0] <= self.stamp_ns:
            (start_ns, reference), self._pending = self._pending, None
            reference = reference.remaining((self.stamp_ns - start_ns) * 1e-9)
            try:
                self._arm.set_trajectory(reference)
            except TrajectoryError as error:
                self._reject(error)
            else:
                self.get_logger().info(f'follows a trajectory of {reference.duration:g} s')
        sample = self._arm.advance(self._stride)
        message, stamp_ns = self._message, self.stamp_ns
        stamp = message.header.stamp
        stamp.sec, stamp.nanosec = divmod(stamp_ns, 10**9)
        if self._clock_publisher is not None and stamp_ns >= self._clock_due:
            self.publish_clock()
            self._clock_due = stamp_ns + self._clock_period
        message.position = sample.q.tolist()
        message.velocity = sample.dq.tolist()
        message.effort = sample.tau.tolist()
        self._states.publish(message)
        if self._elastic_topics is not None and sample.link is not None:
            self._elastic_topics.publish(sample.link, stamp)
        return stamp_ns

    def publish_clock(self) -> None:
        """Publish the simulated time on /clock, if the node has a publisher of /clock."""
        if self._clock_publisher is not None:
            stamp = Time(nanoseconds=self.stamp_ns).to_msg()
            self._clock_publisher.publish(ClockMessage(clock=stamp))

    def follow(self) -> None:
        """Simulate to the present time of /clock, which another node publishes."""
        now = self.get_clock().now().nanoseconds
        # after a larger step, the clock was set, and the simulation does not catch up
        if self._origin_ns is None or not 0 <= now - self.stamp_ns <= 60 * 10**9:
            self._origin_ns = now - self._arm.steps * self._dt_ns
        while self.stamp_ns + self._stride * self._dt_ns <= now:
            self.step()

    def catch_up(self) -> None:
        """Simulate to the present real time; skip time if the computer is too slow."""
        self._skipped += self.real_time.catch_up(self._factor, self._stride * self._arm.plant.dt)
        # set the stamps to the system clock again, but not during a trajectory
        if self._skipped and self._clock_publisher is None and not self.moving:
            self._origin_ns = (self._origin_ns or 0) + round(self._skipped * 1e9)
            self._skipped = 0.0

    def reset(self) -> str:
        """Set the arm to its initial position; the simulated time continues."""
        self._arm.reset(self._arm.steps)
        self._pending = None
        return f'{self.hardware} is at its initial position'

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Return the present problem, the simulated time and the skipped time."""
        trouble = ''
        if self._clock_publisher is None:  # with /clock, other nodes follow the simulated time
            trouble = self.real_time.trouble(
                'lower its rate, or set a smaller real_time_factor, with use_sim_time on the '
                'other nodes'
            )
        return trouble, {
            'simulated_time': self._arm.t,
            'moving': int(self.moving),
            'skipped_real_time': self.real_time.given_up,
        }

    def check(self, values: Mapping[str, Any]) -> None:
        """Raise an ArmidError if new values of effects, noise or rates are not possible."""
        with reading(f'parameter {", ".join(map(repr, values))}', ArmidError):
            self._sensors(self._arm.joints, values)
            self._steps_at(values.get('rate', self.value('rate')))
            if 'effects' in values:
                self._arm.successor(self._with_effects(values['effects']))

    def changed(self, names: frozenset[str]) -> None:
        """Apply changed effects, rates and sensors while the arm moves."""
        if 'effects' in names:
            self._replace_model(self._with_effects(self.value('effects')))
        if names & {'rate', 'real_time_factor', 'clock_rate'}:
            self.real_time.given_up = 0.0
            self._set_rates()
        described = self._sensors(self._arm.joints, {})
        known = {name: getattr(described, name) for name in names & set(_SENSORS)}
        self._arm.sensors = replace(self._arm.sensors, **known)

    def _with_effects(self, texts: Sequence[str]) -> ArmModel:
        if self._without_effects is None:
            raise ModelError(
                "the parameter 'effects' cannot change an arm that was given to the node in Python"
            )
        arm = self._without_effects
        more = ArmModel.of(arm.robot, effects=tuple(filter(None, texts)))
        return replace(arm, effects=arm.effects + more.effects, values=arm.values + more.values)

    def _sensors(self, joints: Sequence[str], values: Mapping[str, Any]) -> Sensors:
        """Return the sensors from new `values`, and ROS parameters for all other quantities."""
        noise = {
            name: per_joint(values.get(name, self.value(name)), joints, f"parameter '{name}'")
            for name in _SENSORS
        }
        return Sensors(**noise, torque_delay=self.value('torque_delay'))

    def _replace_model(self, arm: ArmModel) -> None:
        self._arm.become(arm)
        named = ', '.join(effect.name for effect in arm.effects) or 'no effect'
        self.get_logger().info(f'the simulation continues with {named}')

    def _on_model(self, message: String) -> None:
        self._replace_model(read_model(message.data, self._arm.plant.arm.robot, 'model'))

    def _on_trajectory(self, message: JointTrajectory) -> None:
        try:
            reference = waypoints_of(message).for_robot(self._arm.plant.robot)
            if reference.duration > MAX_DURATION:
                raise TrajectoryError(
                    f'trajectory: it lasts {reference.duration:.4g} s, but may last at most '
                    f'{MAX_DURATION:g} s'
                )
            stamp = message.header.stamp
            start_ns = stamp.sec * 10**9 + stamp.nanosec or self.stamp_ns
            delay = (start_ns - self.stamp_ns) * 1e-9
            if not -1.0 <= delay <= 60.0:  # sender and arm use different clocks
                when = f'{delay:.3g} s from now' if delay > 0 else f'{-delay:.3g} s ago'
                raise TrajectoryError(
                    f'trajectory: its stamp is {when}; set use_sim_time on sender and arm, or on '
                    'neither'
                )
        except TrajectoryError as error:
            self._reject(error)
            return
        self._pending = (start_ns, reference)

    def _reject(self, error: TrajectoryError) -> None:
        follows = 'follows the previous trajectory' if self.moving else 'does not move'
        self.complaints.add('trajectory', f'{error}; it is rejected, and the arm {follows}')


main = partial(run, SimulatedArmNode)
