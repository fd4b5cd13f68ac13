# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The nodes in one process over real topics, in lock step: as fast as the computer, nothing lost.

A step of the clock is taken when everybody has what the step before published; so the outcome
does not depend on how fast the computer is, nor on what else it does.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
import math
import os
from pathlib import Path
import time
from typing import Any, TypeVar

from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError
from armid_ros.estimate import Estimate
from armid_ros.excitation import Excitation, TransferPlanner
from armid_ros.excitation.pose_monitor import AGREEING
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.nodes.bag_player import BagPlayerNode
from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.excitation_publisher import ExcitationPublisherNode
from armid_ros.nodes.online_identifier import OnlineIdentifierNode
from armid_ros.nodes.qos import STREAM
from armid_ros.nodes.recorder import RecorderNode
from armid_ros.nodes.running.domains import private_context
from armid_ros.nodes.running.process import make_executor, steady
from armid_ros.nodes.simulated_arm import SimulatedArmNode
from armid_ros.simulation import SimulatedArm
from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter
from rclpy.time import Time
from rosgraph_msgs.msg import Clock

AnyNode = TypeVar('AnyNode', bound=ArmidNode)

#: Without a message for so long something is broken [s]; discovery takes up to 3 s.
PATIENCE = 20.0
#: The arm holds still for so long after the end, while filters run out [s].
_REST = 0.5
#: Begin of time where nobody says otherwise: a stamp of zero would mean that there is none [ns].
EPOCH_NS = 1_000 * 10**9
#: How long the arm is at rest before it is started [s]: what the publisher has to see.
_SEEN = 0.26
#: What is recorded unless told otherwise.
TOPICS = ('joint_states', 'robot_description', 'joint_trajectory', 'online_identifier/estimate')


@dataclass(frozen=True)
class Progress:
    """
    How a run is going.

    Attributes
    ----------
    t, duration : float
        Simulated time since the start, and in all [s].
    estimate : Estimate
        The online estimate now.
    samples : int
        Samples it rests on.
    condition_number : float
        Of the weighted regressor so far.
    real_time_factor : float
        Simulated time per real time so far.

    """

    t: float
    duration: float
    estimate: Estimate
    samples: int
    condition_number: float
    real_time_factor: float


OnProgress = Callable[[Progress], None]


def run_lockstep(
    arm: SimulatedArm,
    excitation: Excitation,
    identifier: OnlineIdentifier,
    bag: Path,
    *,
    topics: Sequence[str] = TOPICS,
    rate: float = 200.0,
    approach: float = 3.0,
    on_progress: OnProgress | None = None,
    period: float = 1.0,
    start_ns: int = EPOCH_NS,
    domain: int | None = None,
) -> Progress:
    """
    Excite an arm, identify it online, and record it.

    Four nodes do it: excitation_publisher, simulated_arm, online_identifier and recorder. They
    are heard on this machine only.

    Parameters
    ----------
    arm : SimulatedArm
        The arm.
    excitation : Excitation
        What it shall do.
    identifier : OnlineIdentifier
        Learns.
    bag : Path
        Directory to record to; it must not exist.
    topics : sequence of str
        What to record, joint_states among it.
    rate : float
        Of joint_states [Hz].
    approach : float
        Time to get from where the arm stands to the start of the excitation [s].
    on_progress : callable, optional
        Told how it is going.
    period : float
        How often [s of simulated time].
    start_ns : int
        Stamp of the beginning [ns].
    domain : int, optional
        ROS domain; by default that of ROS_DOMAIN_ID, or else one of its own.

    Returns
    -------
    Progress
        At the end.

    Raises
    ------
    ArmidError
        If the bag exists, the arm refuses the excitation, or a node does not get its messages.

    """
    with Stage(domain) as stage:
        learner = stage.add(OnlineIdentifierNode, identifier)
        recorder = stage.add(RecorderNode, bag=str(bag), topics=list(topics))
        run = _Run(stage, arm, start_ns, rate, recorder, learner)
        run.begin(excitation, approach)
        watch = _Watch(learner, run.duration, on_progress, period)
        while watch.t < watch.duration:
            watch.see(run.step() - start_ns)
        return watch.progress()


def record_lockstep(
    arm: SimulatedArm,
    excitation: Excitation,
    bag: Path,
    *,
    topics: Sequence[str] = TOPICS[:3],
    rate: float = 200.0,
    approach: float = 3.0,
    on_progress: Callable[[float], None] | None = None,
    domain: int | None = None,
) -> None:
    """
    Excite an arm and record it, with nobody who learns: in half of the time.

    Three nodes do it: excitation_publisher, simulated_arm and recorder.

    Parameters
    ----------
    arm, excitation, bag, topics, rate, approach, domain
        As for `run_lockstep`.
    on_progress : callable, optional
        Told the share that is done.

    Raises
    ------
    ArmidError
        If the bag exists, the arm refuses the excitation, or a node does not get its messages.

    """
    with Stage(domain) as stage:
        recorder = stage.add(RecorderNode, bag=str(bag), topics=list(topics))
        run, t = _Run(stage, arm, EPOCH_NS, rate, recorder), 0.0
        run.begin(excitation, approach)
        while t < run.duration:
            t = (run.step() - EPOCH_NS) * 1e-9
            if on_progress is not None:
                on_progress(min(t / run.duration, 1.0))


def replay_lockstep(
    bag: Path,
    identifier: OnlineIdentifier,
    *,
    topic: str = 'joint_states',
    duration: float,
    tick: float = 0.002,
    on_progress: OnProgress | None = None,
    period: float = 1.0,
    domain: int | None = None,
) -> Progress:
    """
    Play a bag to an online identifier in lock step with /clock.

    Two nodes do it: bag_player and online_identifier.

    Parameters
    ----------
    bag : Path
        What was recorded.
    identifier : OnlineIdentifier
        Learns.
    topic : str
        Name of the topic with the joint states in the bag.
    duration : float
        How much of it [s].
    tick : float
        Step of the clock [s].
    on_progress, period, domain
        As for `run_lockstep`.

    Returns
    -------
    Progress
        At the end.

    """
    with Stage(domain) as stage:
        player = stage.add(
            BagPlayerNode, bag=str(bag), topics=[topic], subscriber_timeout=PATIENCE
        )
        learner = stage.add(OnlineIdentifierNode, identifier)
        clock = player.create_publisher(Clock, '/clock', STREAM)
        full_topic = player.resolve_topic_name(topic)
        stage.spin_until(
            lambda: clock.get_subscription_count() >= 2 and _matched(learner), full_topic
        )
        watch = _Watch(learner, duration, on_progress, period)
        step_ns, now = round(tick * 1e9), EPOCH_NS
        while watch.t < duration and not player.finished:
            now += step_ns
            clock.publish(Clock(clock=Time(nanoseconds=now).to_msg()))
            due = (now - EPOCH_NS - step_ns - 1) * 1e-9
            stage.spin_until(
                lambda due=due: not player.waiting and player.position >= due, '/clock'
            )
            count = player.published[full_topic]
            stage.spin_until(lambda count=count: learner.received >= count, full_topic)
            watch.see(now - EPOCH_NS)
        return watch.progress()


class Stage:
    """Nodes in one process, and the executor that runs them."""

    def __init__(self, domain: int | None) -> None:
        if domain is None and os.environ.get('ROS_DOMAIN_ID'):
            domain = int(os.environ['ROS_DOMAIN_ID'])
        self._scope = _scope(domain)
        self._nodes: list[ArmidNode] = []

    def __enter__(self) -> Stage:
        self._context, self._executor = self._scope.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        for node in reversed(self._nodes):
            node.close()
            self._executor.remove_node(node)
            node.destroy_node()
        self._scope.__exit__(*error)

    def add(self, make: type[AnyNode], *core: Any, **parameters: Any) -> AnyNode:
        parameters = {'use_sim_time': True, **parameters}
        node = make(
            *core,
            context=self._context,
            use_global_arguments=False,
            parameter_overrides=[Parameter(k, value=v) for k, v in parameters.items()],
        )
        node.get_logger().set_level(LoggingSeverity.WARN)
        self._nodes.append(node)
        self._executor.add_node(node)
        return node

    def spin_until(self, done: Callable[[], object], what: str) -> None:
        if done():
            return
        deadline = time.monotonic() + PATIENCE
        while not done():
            if time.monotonic() > deadline:  # a callback that took long may have brought it
                raise ArmidError(
                    f'{what}: no message for {PATIENCE:g} s; is UDP on the loopback interface '
                    'blocked?'
                )
            self._executor.spin_once(timeout_sec=0.1)


class _Run:
    """An excitation of an arm; duration is the time from the first stamp to its end [s]."""

    def __init__(
        self,
        stage: Stage,
        arm: SimulatedArm,
        start_ns: int,
        rate: float,
        recorder: RecorderNode,
        learner: OnlineIdentifierNode | None = None,
    ) -> None:
        self._stage, self._recorder, self._learner = stage, recorder, learner
        self._robot, self._start_ns = arm.plant.robot, start_ns
        self._plant = stage.add(
            SimulatedArmNode, arm, start_ns, rate=rate, real_time_factor=0.0, use_sim_time=False
        )
        self.duration = 0.0

    def begin(self, excitation: Excitation, approach: float) -> None:
        """Wait until everybody hears everybody, and start the excitation."""
        stage, plant = self._stage, self._plant
        # The simulated arm looks at the limits, and nothing in a simulation can be hit.
        planner = TransferPlanner(ArmModel(self._robot), None, None, 0.0)
        publisher = stage.add(
            ExcitationPublisherNode, excitation, planner, start=False, approach=approach
        )
        stage.spin_until(lambda: self._connected(publisher), 'discovery')
        for _ in range(max(math.ceil(_SEEN * plant.value('rate')), AGREEING) + 1):
            begun = self.step()
            stage.spin_until(lambda begun=begun: publisher.last_stamp_ns == begun, 'joint_states')
        publisher.start()
        stage.spin_until(lambda: plant.moving or plant.complaints.counts, 'joint_trajectory')
        self.duration = publisher.duration + (begun - self._start_ns) * 1e-9 + _REST

    def _connected(self, publisher: ExcitationPublisherNode) -> bool:
        """Whether everybody hears everybody, and the clock."""
        recorder, learner = self._recorder, self._learner
        listeners = [recorder, publisher, *([] if learner is None else [learner])]
        recorder.look()
        self._plant.publish_clock()
        return (
            not recorder.missing
            and (learner is None or _matched(learner))
            and self._plant.readers >= len(listeners)
            and publisher.readers >= 1
            and all(node.get_clock().now().nanoseconds for node in listeners)
        )

    def step(self) -> int:
        """Move the arm on until its joint state is everywhere; return the stamp [ns]."""
        plant, learner = self._plant, self._learner
        stamp, topic = plant.step(), plant.resolve_topic_name('joint_states')
        stamps = self._recorder.last_stamps
        self._stage.spin_until(
            lambda: (
                stamps.get(topic) == stamp and (learner is None or learner.last_stamp_ns == stamp)
            ),
            topic,
        )
        if plant.complaints.counts:
            raise ArmidError(plant.complaints.latest)
        return stamp


class _Watch:
    """Tells of the progress of a learner."""

    def __init__(
        self,
        learner: OnlineIdentifierNode,
        duration: float,
        tell: OnProgress | None,
        period: float,
    ) -> None:
        self._learner = learner
        self._tell = tell
        self._period = period
        self._begun = time.monotonic()
        self._due = period
        self.duration = duration
        self.t = 0.0

    def see(self, elapsed_ns: int) -> None:
        self.t = elapsed_ns * 1e-9
        if self.t >= self._due:
            self._due += self._period
            if self._tell is not None:
                self._tell(self.progress())

    def progress(self) -> Progress:
        identifier = self._learner.identifier
        assert identifier is not None
        return Progress(
            t=self.t,
            duration=self.duration,
            estimate=identifier.estimate(),
            samples=identifier.samples,
            condition_number=identifier.condition_number,
            real_time_factor=self.t / max(time.monotonic() - self._begun, 1e-9),
        )


def _matched(learner: OnlineIdentifierNode) -> bool:
    learner.joint_states.match()
    return learner.joint_states.publishers > 0


@contextmanager
def _scope(domain: int | None) -> Iterator[tuple[Context, Executor]]:
    with private_context(domain) as context, steady():
        executor = make_executor('events', context)
        try:
            yield context, executor
        finally:
            executor.shutdown()
