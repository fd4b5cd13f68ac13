# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Node that simulates an exoskeleton and its wearer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from itertools import count
import math
from typing import Any

from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.parameters.table import NodeParameter
from armid_ros.nodes.qos import SAMPLES
from armid_ros.nodes.running.process import run
from armid_ros.nodes.running.real_time import RealTime
from armid_ros.papers.exo.plant.leg_pair import leg_pair, stepping, with_noise, with_torques
from armid_ros.robots.ties import SEGMENTS
import numpy as np
from rclpy.time import Time
from sensor_msgs.msg import JointState


class SimulatedPairNode(ArmidNode):
    """
    Node that publishes simulated joint states of an exoskeleton and its wearer.

    Attributes
    ----------
    t : float
        Time of the simulation [s].

    """

    table = (
        NodeParameter('stiffness', 1e4, 'Stiffness of all straps.', 'N/m', limits=(0.0, 1e6)),
        NodeParameter('segments', list(SEGMENTS), 'Leg segments with a strap; empty: none.'),
        NodeParameter('slack', 0.0, 'Slack of the straps.', 'm', limits=(0.0, 0.1)),
        NodeParameter('angle_noise', 0.05, 'Noise of angles (std).', 'deg', limits=(0.0, 10.0)),
        NodeParameter('torque_noise', 0.5, 'Noise of torques (std).', 'N m', limits=(0.0, 100.0)),
        NodeParameter('seed', 0, 'Random seed of the noise.', limits=(0, 2**62)),
        NodeParameter(
            'rate', 1000.0, 'Publishing rate of both joint states.', 'Hz', limits=(50.0, 5000.0)
        ),
        NodeParameter(
            'real_time_factor',
            1.0,
            'Simulated time per real time, if the computer can. 0: moves only on request.',
            limits=(0.0, 1000.0),
        ),
    )

    def __init__(self, start_ns: int | None = None, **kwargs: Any) -> None:
        """
        Create the node.

        Parameters
        ----------
        start_ns : int, optional
            First timestamp [ns]; by default the time of the node's clock.
        **kwargs
            Passed to Node of rclpy.

        """
        super().__init__('simulated_pair', **kwargs)
        pair = leg_pair(self.value('stiffness'), self.value('segments'))
        pair = pair.with_slack(self.value('slack'))
        self._rng = np.random.default_rng(self.value('seed'))
        self._pair, self._messages, self.t = pair, self._simulated(), 0.0
        self._origin_ns = self.get_clock().now().nanoseconds if start_ns is None else start_ns
        self._exo = self.create_publisher(JointState, 'exo/joint_states', SAMPLES)
        self._human = self.create_publisher(JointState, 'human/joint_states', SAMPLES)
        self.real_time = RealTime(lambda: self.t, self.step)
        self.offer('~/reset', self.reset)
        factor = self.value('real_time_factor')
        if factor:
            period = max(1.0 / (self.value('rate') * factor), 0.0005)
            self.create_steady_timer(period, self.catch_up)

    @property
    def hardware(self) -> str:
        """Name of the exoskeleton on /diagnostics."""
        return str(self._pair.robot.name)

    @property
    def stamp_ns(self) -> int:
        """Time stamp of the present sample [ns]."""
        return self._origin_ns + round(self.t * 1e9)

    def step(self) -> int:
        """Simulate and publish the next sample of both machines; return its time stamp [ns]."""
        self.t, own, other = next(self._messages)
        for publisher, message in ((self._human, other), (self._exo, own)):
            message.header.stamp = Time(nanoseconds=self.stamp_ns).to_msg()
            publisher.publish(message)
        return self.stamp_ns

    def _simulated(self) -> Iterator[tuple[float, JointState, JointState]]:
        """Yield times [s] and noisy joint states of exoskeleton and wearer, without end."""
        noise = math.radians(self.value('angle_noise')), self.value('torque_noise')
        size = 50  # samples that are computed together
        for first in count(1, size):
            t = (first + np.arange(size)) / self.value('rate')
            motions = with_torques(self._pair, stepping(self._pair, t))
            own, other = with_noise(motions, *noise, self._rng)
            assert own.tau is not None
            for k, time in enumerate(t.tolist()):
                fields = {'position': own.q[k].tolist(), 'velocity': own.dq[k].tolist()}
                machine = JointState(name=list(own.joints), effort=own.tau[k].tolist(), **fields)
                fields = {'position': other.q[k].tolist(), 'velocity': other.dq[k].tolist()}
                yield time, machine, JointState(name=list(other.joints), **fields)

    def catch_up(self) -> None:
        """Simulate up to the present real time; skip time if the computer is too slow."""
        factor = self.value('real_time_factor')
        skipped = self.real_time.catch_up(factor, 1.0 / self.value('rate'))
        if factor == 1.0:  # stamps stay those of the computer  # noqa: RUF069 - as it is written
            self._origin_ns += round(skipped * 1e9)

    def reset(self) -> str:
        """Restart both machines in the initial state; the time stamps continue."""
        self._origin_ns = self.stamp_ns
        self._messages, self.t = self._simulated(), 0.0
        self.real_time.begin()
        return 'exoskeleton and wearer are in the initial state'

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Return a warning if the simulation is too slow for real time, and the skipped time."""
        values = {
            'simulated_time': self.t,
            'skipped_real_time': self.real_time.given_up,
        }
        return self.real_time.trouble('start it with a lower rate'), values


main = partial(run, SimulatedPairNode)
