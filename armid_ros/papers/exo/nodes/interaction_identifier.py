# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Node that identifies the straps between an exoskeleton and its wearer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from functools import partial
from typing import Any

from armid_msgs.msg import ParameterEstimate
from armid_ros.errors import RecordingError
from armid_ros.identification.rows.causal import MAX_MAGNITUDE
from armid_ros.identification.samples.spikes import SpikeGate
from armid_ros.identification.samples.straight_line import StreamSample
from armid_ros.identification.ties.stiffness import Interaction
from armid_ros.nodes.base import ArmidNode, LOOK_PERIOD
from armid_ros.nodes.messages.estimates import estimate_message
from armid_ros.nodes.messages.joint_states import DISTURBANCES, JointStateReader
from armid_ros.nodes.messages.timeliness import Freshness
from armid_ros.nodes.parameters.table import NodeParameter
from armid_ros.nodes.qos import LATCHED, MatchedSubscription
from armid_ros.nodes.running.process import run
from armid_ros.papers.exo.plant.leg_pair import leg_pair
from armid_ros.papers.exo.springs import OnlineInteraction
from diagnostic_msgs.msg import DiagnosticStatus
import numpy as np
from rclpy.time import Time
from sensor_msgs.msg import JointState

_TOPICS = ('exo/joint_states', 'human/joint_states')
#: Warning about joint states that are left out.
_DAMAGED = DISTURBANCES | {
    'spike': 'joint states that jump for single samples are left out',
    'pulse': 'torques that jump for single samples, as an arm may do, are left out',
}


class InteractionIdentifierNode(ArmidNode):
    """
    Node that estimates the stiffness of the straps between exoskeleton and wearer online.

    Attributes
    ----------
    identifier : OnlineInteraction
        The online identifier.
    received : int
        Number of joint states received from both machines.

    """

    table = (
        NodeParameter('memory', 10.0, 'Length of the time window.', 's', limits=(3.0, 600.0)),
        NodeParameter('period', 2.0, 'Time between estimates.', 's', limits=(0.1, 600.0)),
        NodeParameter(
            'inertias',
            'known',
            'Inertias of the exoskeleton: known from its description, or free (estimated).',
            choices=('known', 'free'),
        ),
    )

    def __init__(self, **kwargs: Any) -> None:
        """Create the node for the shipped exoskeleton and wearer."""
        super().__init__('interaction_identifier', **kwargs)
        pair = leg_pair()
        names = ('memory', 'period', 'inertias')
        settings = {name: self.value(name) for name in names}
        self.identifier = OnlineInteraction(pair, **settings)
        self.received = 0
        self._estimates = self.create_publisher(ParameterEstimate, '~/estimate', LATCHED)
        self._readers = tuple(
            JointStateReader(
                robot.joints, self.complaints, self.get_clock(), topic, robot is pair.robot
            )
            for robot, topic in zip((pair.robot, pair.other), _TOPICS, strict=True)
        )
        self._gates = tuple(
            SpikeGate(robot.prismatic, signals, torque_limit=robot.torque_limit)
            for robot, signals in ((pair.robot, 'qt'), (pair.other, 'q'))
        )
        self._told: list[Counter[str]] = [Counter(), Counter()]
        self.freshness = tuple(Freshness(topic) for topic in _TOPICS)
        self._stopped = False
        self._epoch_ns = 0
        self.topics = tuple(
            MatchedSubscription(
                self,
                JointState,
                topic,
                partial(self._take, k),
                raw=True,
                depth=10_000,  # several seconds at 1 kHz
            )
            for k, topic in enumerate(_TOPICS)
        )
        self.offer('~/reset', self.reset)
        self.create_steady_timer(LOOK_PERIOD, self.match)

    @property
    def hardware(self) -> str:
        """Name of the exoskeleton on /diagnostics."""
        return str(self.identifier.machines.robot.name)

    def match(self) -> None:
        """Subscribe to publishers of joint states; publish whether joint states arrive."""
        for topic in self.topics:
            topic.match()
        stopped = any(fresh.stopped for fresh in self.freshness)
        if stopped != self._stopped:
            self._stopped = stopped
            self.publish_diagnostics()

    def reset(self) -> str:
        """Discard all samples and estimates; return the answer of the service."""
        self.identifier.reset()
        for machine, gate in enumerate(self._gates):
            gate.reset()
            self._told[machine].clear()
        return 'samples and estimates are discarded'

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Return a warning or '', and stiffness and slack of the straps for /diagnostics."""
        core = self.identifier
        values: dict[str, object] = {'received': self.received}
        for part in (core.together, core.separate):
            values |= _named(part)
        if core.slack is not None:
            values |= {'slack_mm': 1e3 * core.slack.value, 'slack_std_mm': 1e3 * core.slack.std}
            values |= _named(core.slack.interaction, ' with slack')
            if core.slack.seen:
                return (
                    f'the straps have {1e3 * core.slack.value:.1f} mm of slack; tighten them, or '
                    'use the stiffness with slack'
                ), values
        if not self.received:
            return 'no joint states so far', values
        return '; '.join(filter(None, (f.trouble() for f in self.freshness))), values

    def level(self, troubled: bool) -> bytes:
        """Return the level for /diagnostics: STALE if no more joint states of a machine arrive."""
        if any(fresh.stopped for fresh in self.freshness):
            return DiagnosticStatus.STALE
        return super().level(troubled)

    def _take(self, machine: int, data: bytes) -> None:
        """Process a joint state of exoskeleton (0) or wearer (1); publish any new estimate."""
        self.received += 1
        self.freshness[machine].mark_received()
        topic, machines = _TOPICS[machine], self.identifier.machines
        n = (machines.other if machine else machines.robot).n_joints
        for sample in self._signals(machine, data):
            if sample.begins:
                self.identifier.interrupt()
                text = f'{topic}: positions jump; earlier samples are discarded'
                self.complaints.add(f'{topic} step', text)
            q, tau = sample.x[:n], sample.x[n:]
            if machine:
                self.identifier.take_other(sample.t, q)
            elif self.identifier.take(sample.t, q, tau):
                found = self.identifier.separate
                assert found is not None
                estimate = estimate_message(found.estimate, len(found.residual))
                stamp_ns = self._epoch_ns + round(1e9 * sample.t)
                estimate.header.stamp = Time(nanoseconds=stamp_ns).to_msg()
                self._estimates.publish(estimate)

    def _signals(self, machine: int, data: bytes) -> list[StreamSample]:
        """Decode a joint state to valid samples; RecordingError for impossible values."""
        topic, gate, reader = _TOPICS[machine], self._gates[machine], self._readers[machine]
        read = reader.read(data)
        if read is None:
            return []
        signal = np.concatenate([read.q, read.tau])
        if not np.all(np.abs(signal) <= MAX_MAGNITUDE):
            raise RecordingError(f'a position or an effort is above {MAX_MAGNITUDE:g}')
        stamp_ns = reader.stamp(read.t).nanoseconds
        self._epoch_ns = self._epoch_ns or stamp_ns  # common to both machines
        good = gate.take(1e-9 * (stamp_ns - self._epoch_ns), signal)
        for reason, count in (gate.rejected - self._told[machine]).items():
            for _ in range(count):
                self.complaints.add(f'{topic} {reason}', f'{topic}: {_DAMAGED[reason]}')
        self._told[machine] = gate.rejected.copy()
        return good


def _named(found: Interaction | None, suffix: str = '') -> dict[str, object]:
    """Return stiffnesses with 95 % interval bounds [N/m] by name, for /diagnostics."""
    if found is None:
        return {}
    values: dict[str, object] = {}
    for segment, k, (lower, upper) in zip(
        found.segments, found.stiffness, found.interval(), strict=True
    ):
        key = f'stiffness {segment} [N/m]{suffix}'
        values |= {key: float(k), f'{key} lower': float(lower), f'{key} upper': float(upper)}
    return values


main = partial(run, InteractionIdentifierNode)
