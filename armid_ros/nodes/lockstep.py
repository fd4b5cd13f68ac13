# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Run the nodes in one process over ROS topics, in lock step and without lost messages.

The clock advances when all nodes have received the messages of the previous step. The result
therefore does not depend on the speed and load of the computer.

"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
import math
import os
from pathlib import Path
import time
from typing import Any, NamedTuple, TypeVar

from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError
from armid_ros.excitation import Excitation, Limits, TransferPlanner
from armid_ros.excitation.pose_monitor import MIN_AGREEING
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.excitation_publisher import ExcitationPublisherNode
from armid_ros.nodes.online_identifier import OnlineIdentifierNode
from armid_ros.nodes.recorder import RecorderNode
from armid_ros.nodes.running.domains import private_context
from armid_ros.nodes.running.process import steady
from armid_ros.nodes.simulated_arm import SimulatedArmNode
from armid_ros.simulation import SimulatedArm
from rclpy.experimental import EventsExecutor
from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter

AnyNode = TypeVar('AnyNode', bound=ArmidNode)

#: Timeout of a message [s]; discovery takes up to 3 s.
MESSAGE_TIMEOUT = 20.0
#: Start of the simulated clock [ns]; zero would mean a missing stamp.
EPOCH_NS = 1_000 * 10**9


class Progress(NamedTuple):
    """
    Progress of a simulated run in lock step.

    Attributes
    ----------
    t, duration : float
        Simulated time since the start, and total simulated time [s].
    real_time_factor : float
        Simulated time per real time so far.

    """

    t: float
    duration: float
    real_time_factor: float


OnProgress = Callable[[Progress], None]


def run_lockstep(
    arm: SimulatedArm,
    excitation: Excitation,
    bag: Path,
    identifier: OnlineIdentifier | None = None,
    *,
    rate: float = 200.0,
    on_progress: OnProgress | None = None,
) -> Progress:
    """
    Move and record a simulated arm over ROS topics, optionally with online identification.

    The nodes are excitation_publisher, simulated_arm, recorder and, with an identifier,
    online_identifier. They communicate on this machine only.

    Parameters
    ----------
    arm : SimulatedArm
        The simulated arm.
    excitation : Excitation
        Excitation to run.
    bag : Path
        Directory of the recorded bag; it must not exist.
    identifier : OnlineIdentifier, optional
        Identifies the arm online; without it, a run takes half of the time.
    rate : float
        Rate of joint_states [Hz].
    on_progress : callable, optional
        Called with the progress every second of simulated time.

    Returns
    -------
    Progress
        Progress at the end of the run.

    Raises
    ------
    ArmidError
        If the bag exists, the arm rejects the excitation, or a node does not get its messages.

    """
    with Stage() as stage:
        learners = [] if identifier is None else [stage.add(OnlineIdentifierNode, identifier)]
        topics = ['joint_states', 'robot_description', 'joint_trajectory']
        topics += ['online_identifier/estimate'] * len(learners)
        recorder = stage.add(RecorderNode, bag=str(bag), topics=topics)
        plant = stage.add(
            SimulatedArmNode, arm, EPOCH_NS, rate=rate, real_time_factor=0.0, use_sim_time=False
        )
        limits = Limits.of(arm.plant.robot, speed=1.0, reserve=False)
        planner = TransferPlanner(ArmModel(arm.plant.robot), limits, None)  # no obstacles
        publisher = stage.add(ExcitationPublisherNode, excitation, planner, start=False)
        listeners = [recorder, publisher, *learners]
        topic = plant.resolve_topic_name('joint_states')

        def connected() -> bool:
            for node in (recorder, *learners):
                node.poll()
            plant.publish_clock()
            return (
                not recorder.missing
                and all(learner.joint_states.publishers for learner in learners)
                and plant.readers >= len(listeners)
                and publisher.readers >= 1
                and all(node.get_clock().now().nanoseconds for node in listeners)
            )

        def step() -> int:
            stamp = plant.step()

            def arrived() -> bool:
                recorded = recorder.last_stamps.get(topic) == stamp
                return recorded and (not learners or learners[0].last_stamp_ns == stamp)

            stage.spin_until(arrived, topic)
            if plant.complaints.counts:
                raise ArmidError(plant.complaints.latest)
            return stamp

        stage.spin_until(connected, 'discovery')
        for _ in range(max(math.ceil(0.26 * rate), MIN_AGREEING) + 1):  # 0.25 s at rest
            begun = step()
            stage.spin_until(lambda begun=begun: publisher.last_stamp_ns == begun, 'joint_states')
        publisher.start()
        stage.spin_until(lambda: plant.moving or plant.complaints.counts, 'joint_trajectory')
        settling = 0.5  # settling time of the filters after the run [s]
        duration = publisher.duration + (begun - EPOCH_NS) * 1e-9 + settling
        return _stepped(step, duration, on_progress)


def _stepped(step: Callable[[], int], duration: float, on_progress: OnProgress | None) -> Progress:
    """Call `step` for `duration` [s] of simulated time, and report progress every second."""
    begun, due, t = time.monotonic(), 1.0, 0.0
    while t < duration:
        t = (step() - EPOCH_NS) * 1e-9
        progress = Progress(t, duration, t / (time.monotonic() - begun))
        if on_progress is not None and t >= due:
            due += 1.0
            on_progress(progress)
    return progress


class Stage(ExitStack):
    """ROS nodes in one process with a common executor; they communicate on this machine only."""

    def __enter__(self) -> Stage:
        domain = os.environ.get('ROS_DOMAIN_ID')
        self._context = self.enter_context(private_context(int(domain) if domain else None))
        self.enter_context(steady())
        self._executor = EventsExecutor(context=self._context)
        self.callback(self._executor.shutdown)
        return self

    def add(self, make: type[AnyNode], *core: Any, **parameters: Any) -> AnyNode:
        """Create a node with the given parameters, and add it to the executor."""
        parameters = {'use_sim_time': True, **parameters}
        node = make(
            *core,
            context=self._context,
            use_global_arguments=False,
            parameter_overrides=[Parameter(k, value=v) for k, v in parameters.items()],
        )
        node.get_logger().set_level(LoggingSeverity.WARN)
        self._executor.add_node(node)
        self.callback(self._remove, node)
        return node

    def _remove(self, node: ArmidNode) -> None:
        node.close()
        self._executor.remove_node(node)
        node.destroy_node()

    def spin_until(self, done: Callable[[], object], topic: str) -> None:
        """Run callbacks until `done` returns true; ArmidError if no message comes on `topic`."""
        deadline = time.monotonic() + MESSAGE_TIMEOUT
        while not done():
            if time.monotonic() > deadline:  # after the timeout, done() is checked once more
                raise ArmidError(
                    f'{topic}: no message for {MESSAGE_TIMEOUT:g} s; is UDP on the loopback '
                    'interface blocked?'
                )
            self._executor.spin_once(timeout_sec=0.1)
