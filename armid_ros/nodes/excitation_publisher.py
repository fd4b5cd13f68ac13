# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The excitation publisher node: a run from rest to rest, as a JointTrajectory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import time
from typing import Any

from armid_ros.errors import TrajectoryError
from armid_ros.excitation import Excitation
from armid_ros.motion import Motion
from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.excitation_parameters import EXCITATION_PARAMETERS, make_excitation
from armid_ros.nodes.parameters import NodeParameter
from armid_ros.nodes.process import run
from armid_ros.nodes.qos import LATCHED
from armid_ros.nodes.trajectories import write_trajectory
import numpy as np
from rclpy.clock import Clock, ClockType
from trajectory_msgs.msg import JointTrajectory

#: How often a subscriber is looked for [s].
_LOOK_PERIOD = 0.05
#: How long a controller may take to begin with a trajectory that slows the arm down [s].
_HANDOVER = 0.05


class ExcitationPublisherNode(ArmidNode):
    """
    Publishes an excitation for a trajectory controller, real or simulated.

    The message is latched and stamped with the time it begins, so that a controller that comes up
    later does not set the arm in motion.

    """

    table = (
        *EXCITATION_PARAMETERS,
        NodeParameter('rate', 100.0, 'Waypoints per second.', 'Hz', lower=1.0, upper=1000.0),
        NodeParameter(
            'approach', 3.0, 'Time to get to the first point.', 's', lower=0.1, upper=60.0
        ),
        NodeParameter(
            'stopping', 0.5, 'Time in which ~/stop brings it to rest.', 's', lower=0.1, upper=10.0
        ),
        NodeParameter('start', True, 'Begin as soon as there is a subscriber, without ~/start.'),
        NodeParameter(
            'subscriber_timeout',
            10.0,
            'How long to wait for one; then only ~/start begins.',
            's',
            lower=0.0,
            upper=3600.0,
        ),
    )

    def __init__(self, excitation: Excitation | None = None, **kwargs: Any) -> None:
        """Take the excitation; by default the one the parameters describe."""
        super().__init__('excitation_publisher', **kwargs)
        rate = self.value('rate')
        if excitation is None:
            self.get_logger().info('making the excitation')
            excitation = make_excitation(self.value, rate)
        self._excitation = excitation
        self._motion = excitation.motion(rate)
        self._begun_ns: int | None = None
        self._waiting = bool(self.value('start'))
        self._deadline = time.monotonic() + self.value('subscriber_timeout')
        self._publisher = self.create_publisher(JointTrajectory, 'joint_trajectory', LATCHED)
        self.offer('~/start', self.start)
        self.offer('~/stop', self.stop)
        self._timer = self.create_timer(
            _LOOK_PERIOD, self.look, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    @property
    def duration(self) -> float:
        """Time from the message to the end of the run, approach included [s]."""
        return float(self.value('approach') + self._motion.t[-1])

    @property
    def readers(self) -> int:
        """Number of subscriptions to joint_trajectory."""
        return int(self._publisher.get_subscription_count())

    @property
    def elapsed(self) -> float | None:
        """Time since the run began, approach included [s]; None when there is no run."""
        if self._begun_ns is None:
            return None
        elapsed = (self.get_clock().now().nanoseconds - self._begun_ns) * 1e-9
        return elapsed if elapsed < self.duration else None

    def look(self) -> None:
        """Begin when somebody listens; give up waiting after a while."""
        if not self._waiting:
            return
        if self.readers:
            self.start()
        elif time.monotonic() > self._deadline:
            self._waiting = False
            self.get_logger().warning(
                f'nobody subscribes to {self._publisher.topic_name}; call ~/start when they do'
            )

    def start(self) -> str:
        """Publish the run from its beginning."""
        self._waiting = False
        if self.elapsed is not None:
            raise TrajectoryError('the excitation is under way; ~/stop ends it')
        self._send(self._motion, self.value('approach'))
        return self._tell(f'a run of {self.duration:g} s, sent to {self.readers} subscribers')

    def stop(self) -> str:
        """Bring the arm to rest on the path it is on."""
        self._waiting = False
        elapsed = self.elapsed
        if elapsed is None:
            raise TrajectoryError('nothing is under way')
        phase = elapsed - self.value('approach')
        if phase < 0.0:
            rest = self._motion.select(slice(0, 1))
            self._send(rest, max(-phase, _HANDOVER))
        else:
            run_out = slowed(self._excitation, phase, self.value('stopping'), self.value('rate'))
            self._send(run_out, _HANDOVER)
        self._begun_ns = None
        return self._tell(f'stopped {elapsed:.2f} s after the start')

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Say how far the run is."""
        elapsed = self.elapsed
        values = {
            'running': int(elapsed is not None),
            'elapsed': elapsed or 0.0,
            'duration': self.duration,
        }
        return ('waiting for a subscriber' if self._waiting else ''), values

    def _send(self, motion: Motion, lead: float) -> None:
        now = self.get_clock().now()
        message = write_trajectory(motion, lead)
        message.header.stamp = now.to_msg()
        self._begun_ns = now.nanoseconds
        self._publisher.publish(message)

    def _tell(self, text: str) -> str:
        self.get_logger().info(text)
        return text


def slowed(excitation: Excitation, phase: float, duration: float, rate: float) -> Motion:
    """
    Return the way to rest from somewhere in an excitation, along its own path.

    Parameters
    ----------
    excitation : Excitation
        The run that is left.
    phase : float
        Where it is, time since its start [s].
    duration : float
        Time to come to rest [s].
    rate : float
        Samples per second [Hz].

    Returns
    -------
    Motion
        From the handover on; the speed along the path falls from 1 to 0 as half a cosine.

    """
    count = int(np.ceil(duration * rate)) + 1
    t = np.linspace(min(_HANDOVER, duration / 2.0), duration, count)
    x = np.pi * t / duration
    path = excitation.at(phase + (t + np.sin(x) * duration / np.pi) / 2.0)
    speed = ((1.0 + np.cos(x)) / 2.0)[:, np.newaxis]
    change = (-np.pi * np.sin(x) / (2.0 * duration))[:, np.newaxis]
    return Motion(
        path.joints,
        t,
        path.q,
        speed * path.dq,
        speed**2 * path.ddq + change * path.dq,
    )


def main(args: Sequence[str] | None = None) -> None:
    """Run the node."""
    run(ExcitationPublisherNode, args)


if __name__ == '__main__':
    main()
