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
from armid_ros.identification.samples.joint_merge import joint_places
from armid_ros.identification.samples.spikes import SpikeGate
from armid_ros.identification.samples.straight_line import StreamSample
from armid_ros.identification.ties.stiffness import Interaction
from armid_ros.nodes.base import ArmidNode, LOOK_PERIOD
from armid_ros.nodes.messages.estimates import estimate_message
from armid_ros.nodes.messages.joint_states import DISTURBANCES
from armid_ros.nodes.messages.timeliness import Freshness
from armid_ros.nodes.parameters.table import NodeParameter
from armid_ros.nodes.qos import LATCHED, MatchedSubscription
from armid_ros.nodes.running.process import run
from armid_ros.papers.exo.plant.leg_pair import leg_pair
from armid_ros.papers.exo.springs import OnlineInteraction
from diagnostic_msgs.msg import DiagnosticStatus
import numpy as np
from sensor_msgs.msg import JointState

_TOPICS = ('exo/joint_states', 'human/joint_states')
#: Used fields of the messages of each machine.
_FIELDS = (('position', 'effort'), ('position',))
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
            'slack_period',
            30.0,
            'Time between fits of slack, if straps without slack do not explain torques.',
            's',
            limits=(1.0, 3600.0),
        ),
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
        names = ('memory', 'period', 'slack_period', 'inertias')
        settings = {name: self.value(name) for name in names}
        self.identifier = OnlineInteraction(pair, **settings)
        self.received = 0
        self._estimates = self.create_publisher(ParameterEstimate, '~/estimate', LATCHED)
        self._joints = pair.robot.joints, pair.other.joints
        self._gates = tuple(
            SpikeGate(robot.prismatic, signals, torque_limit=robot.torque_limit)
            for robot, signals in ((pair.robot, 'qt'), (pair.other, 'q'))
        )
        self._told: list[Counter[str]] = [Counter(), Counter()]
        self.freshness = tuple(Freshness(topic) for topic in _TOPICS)
        self._stopped = False
        self._epoch: int | None = None
        # several seconds at 1 kHz
        self.topics = tuple(
            MatchedSubscription(
                self, JointState, topic, lambda message, k=k: self._take(k, message), depth=10_000
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

    def _take(self, machine: int, message: JointState) -> None:
        """Process a joint state of exoskeleton (0) or wearer (1); publish any new estimate."""
        self.received += 1
        self.freshness[machine].mark_received()
        topic, n = _TOPICS[machine], len(self._joints[machine])
        for sample in self._signals(machine, message):
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
                estimate.header = message.header
                self._estimates.publish(estimate)

    def _signals(self, machine: int, message: JointState) -> list[StreamSample]:
        """Convert a joint state to valid samples; RecordingError for an invalid message."""
        topic, gate, fields = _TOPICS[machine], self._gates[machine], _FIELDS[machine]
        order = joint_places(self._joints[machine], message.name)
        parts = [np.array(getattr(message, name)) for name in fields]
        for name, part in zip(fields, parts, strict=True):
            if len(part) != len(message.name):
                raise RecordingError(
                    f'a message has {len(message.name)} names, but {len(part)} values of {name}'
                )
        signal = np.concatenate([part[order] for part in parts])
        if not np.all(np.abs(signal) <= MAX_MAGNITUDE):
            raise RecordingError(
                f'a {" or ".join(fields)} is above {MAX_MAGNITUDE:g} or not finite'
            )
        stamp = message.header.stamp
        if stamp.sec < 0 or stamp.nanosec >= 10**9:
            raise RecordingError(f'a time stamp is invalid: {stamp.sec} s, {stamp.nanosec} ns')
        if self._epoch is None:
            self._epoch = stamp.sec
        good = gate.take(float(stamp.sec - self._epoch) + 1e-9 * stamp.nanosec, signal)
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
