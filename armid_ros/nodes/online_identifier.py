# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Online identifier node: estimates the parameters of an arm while it moves."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
import sys
import time
from typing import Any

from armid_msgs.msg import ParameterEstimate
from armid_ros.api.arguments import USUAL
from armid_ros.arm import ArmModel
from armid_ros.arm.model_file import read_model, save_model
from armid_ros.errors import ArmidError, IdentificationError, ModelError
from armid_ros.estimate import Estimate, parameter_table
from armid_ros.files import write_file
from armid_ros.files.output import refuse_replacing
from armid_ros.identification.online.identifier import OnlineIdentifier, OnlineSettings
from armid_ros.identification.online.learning_progress import LearningProgress, too_little_motion
from armid_ros.motion import FloatArray
from armid_ros.nodes.base import key_values
from armid_ros.nodes.listening import ListeningNode, ROBOT_PARAMETERS
from armid_ros.nodes.messages.estimates import estimate_message, estimate_values
from armid_ros.nodes.messages.joint_states import DISTURBANCES, JointSample
from armid_ros.nodes.parameters.table import NodeParameter, setting
from armid_ros.nodes.qos import LATCHED, STREAM
from armid_ros.nodes.running.process import run
from diagnostic_msgs.msg import DiagnosticStatus
import numpy as np
from rclpy.publisher import Publisher
from sensor_msgs.msg import JointState
from std_msgs.msg import String
import yaml

#: Files of ~/save: the estimate, the model with the estimate, and the URDF of its robot.
FILES = ('estimate.yaml', 'model.yaml', 'robot.urdf')
#: Default folder of ~/save.
_FOLDER = 'online_identification'


class OnlineIdentifierNode(ListeningNode):
    """
    Node that estimates an arm's parameters from joint_states while the arm moves.

    Attributes
    ----------
    identifier : OnlineIdentifier, or None
        None until a robot is known.
    update_times : deque of float
        Processor time of the last updates [s].

    """

    table = (
        *ROBOT_PARAMETERS,
        NodeParameter(
            'effects',
            USUAL.split(','),
            'Effects to estimate with the rigid body, each as NAME[@joint+joint].',
        ),
        NodeParameter(
            'cutoff', 5.0, 'Low-pass cut-off of torque and regressor.', 'Hz', limits=(0.01, 1000.0)
        ),
        setting(
            'forgetting', 1.0, 'Forgetting factor per used sample; 1: none.', limits=(0.9, 1.0)
        ),
        NodeParameter(
            'torque_noise',
            [0.0],
            'Standard deviation of a torque sample, one per joint; [0.0]: from the residuals.',
            'N m or N',
        ),
        setting('max_gap', 10, 'Longest gap that is interpolated.', limits=(1, 1000)),
        NodeParameter(
            'measured_velocity', False, 'Differentiate the measured velocity, not the position.'
        ),
        setting(
            'false_alarm_time',
            360000.0,
            'Mean time between false reports of a change; 0: no search for changes.',
            's',
            limits=(0.0, 1e9),
        ),
        setting(
            'estimate_rate', 10.0, 'Publishing rate of ~/estimate.', 'Hz', limits=(0.1, 1000.0)
        ),
        setting(
            'save_to',
            '',
            'Folder that ~/save and the end of the node write to: estimate.yaml, model.yaml, '
            f'robot.urdf; empty: ~/save alone writes, to {_FOLDER}.',
        ),
    )

    def __init__(self, identifier: OnlineIdentifier | None = None, **kwargs: Any) -> None:
        """Create the node; by default, the ROS parameters define the identifier."""
        super().__init__('online_identifier', **kwargs)
        self.identifier: OnlineIdentifier | None = None
        self.update_times: deque[float] = deque(maxlen=2000)
        if self.value('save_to'):  # check before the identification, not at its end
            refuse_replacing(Path(self.value('save_to')).expanduser(), FILES)
        if identifier is None and self.value('robot'):
            identifier = self._described()
        if identifier is not None:
            self._begin(identifier)
        self.create_subscription(String, 'model', self._on_model, LATCHED)
        self._estimates = self.create_publisher(ParameterEstimate, '~/estimate', LATCHED)
        self._changes = self.create_publisher(ParameterEstimate, '~/change', LATCHED)
        self._predictions = self.create_publisher(JointState, '~/predicted_joint_states', STREAM)
        self._residuals = self.create_publisher(JointState, '~/residual', STREAM)
        self.listen()
        self.offer('~/reset', self.reset)
        self.offer('~/save', self.save)
        period = 1.0 / self.value('estimate_rate')
        self._timer = self.create_timer(period, self.publish_estimate)

    def reset(self) -> str:
        """Delete the estimate and restart; return the answer of the service."""
        identifier = self._require()
        identifier.reset()
        self._adopt(identifier)
        return 'the estimate was deleted; the identification restarts'

    def save(self) -> str:
        """Write estimate, arm model and URDF to files; return the answer of the service."""
        identifier = self._require()
        if not identifier.samples:
            raise IdentificationError('no joint state was used so far, so no file was written')
        folder = Path(self.value('save_to') or _FOLDER).expanduser()
        refuse_replacing(folder, FILES)
        robot, estimate = identifier.arm.robot, identifier.estimate()
        document = {
            'schema': 'armid/estimate/1',
            'robot': robot.name,
            'gravity': [float(g) for g in robot.gravity],
            'samples': identifier.samples,
            'condition_number': identifier.condition_number,
            'parameters': parameter_table(
                estimate.parameters, estimate.values, [float(s) for s in estimate.std]
            ),
        }
        estimated, model, urdf = paths = tuple(folder / name for name in FILES)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            write_file(urdf, robot.urdf)
            save_model(model, identifier.model(), urdf.name, estimate)
            write_file(estimated, yaml.safe_dump(document, sort_keys=False, width=99))
        except OSError as error:
            raise ModelError(f'the folder {folder} cannot be written: {error.strerror}') from error
        return f'wrote {", ".join(map(str, paths))}'

    def close(self) -> None:
        """Save the estimate if the parameter `save_to` is set."""
        if self.value('save_to') and self.identifier is not None and self.identifier.samples:
            try:
                text = self.save()
            except ArmidError as error:
                text = f'the estimate is lost: {error}'
            print(text, file=sys.stderr)  # the logger is closed if a signal ends the node

    def publish_estimate(self) -> None:
        """Publish the estimate if joint states were used since the last call."""
        identifier = self.identifier
        if identifier is None or identifier.samples in (0, self._published):
            return
        self._published = identifier.samples
        self._publish(self._estimates, identifier.estimate(), self._last_sample)

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Return a message on a fault or '', and numbers of samples and rejected messages."""
        identifier = self.identifier
        if identifier is None:
            return self.awaited, {'received': self.received}
        values: dict[str, object] = {
            'received': self.received,
            'missing': identifier.missing,
            'samples': identifier.samples,
            'condition_number': identifier.condition_number,
        }
        if self._counted:
            rms = np.sqrt(self._squares / self._counted)
            names = identifier.arm.robot.joints
            values |= {f'residual_rms {j}': float(r) for j, r in zip(names, rms, strict=True)}
        if self.update_times:
            p50, p99 = np.percentile(self.update_times, (50, 99)) * 1e6
            values |= {'update_p50_us': float(p50), 'update_p99_us': float(p99)}
        values |= {f'left out {reason}': n for reason, n in identifier.rejected.items()}
        values |= {f'restarted {reason}': n for reason, n in identifier.restarts.items()}
        counted = Counter(identifier.rejected) + Counter(identifier.restarts)
        counted['missing'] = identifier.missing
        news = counted - self._disturbed
        for reason in news.keys() & DISTURBANCES.keys():
            self.report(reason)
        for joint, signal in identifier.spikes if news['spike'] else ():
            self.report(
                'spike', f"the {signal} of '{joint}' jumps for single samples, which are skipped"
            )
        self._disturbed = counted
        self._squares, self._counted = np.zeros(len(self._names)), 0
        trouble = self.stream_trouble()
        if self.awaited or self.freshness.stopped:
            return trouble, values
        if identifier.error:
            return identifier.error, values
        if identifier.samples:
            progress = self._progress.unidentified(self._last_sample, identifier.estimate())
            trouble = '; '.join(filter(None, (too_little_motion(progress), trouble)))
        return trouble, values

    def further_statuses(self) -> Sequence[DiagnosticStatus]:
        """Return the estimate with 95 % intervals, and the last change, for /diagnostics."""
        identifier, prefix = self.identifier, self.get_fully_qualified_name()[1:]
        if identifier is None:
            return ()
        common = {'level': DiagnosticStatus.OK, 'hardware_id': self.hardware}
        learned = DiagnosticStatus(name=f'{prefix}: parameters', **common)
        learned.message = 'no sample was used so far'
        if identifier.samples:
            learned.message = 'value, lower and upper end of the 95 % interval'
            learned.values = key_values(estimate_values(identifier.estimate()))
        changed = DiagnosticStatus(name=f'{prefix}: changes', **common)
        changed.message = 'no change was detected'
        values: dict[str, object] = {'changes': len(identifier.changes)}
        if identifier.changes:
            latest = identifier.changes[-1]
            age = self._last_sample - latest.t
            if age < 60.0:
                changed.level = DiagnosticStatus.WARN
            changed.message = f'{latest}, {age:.0f} s ago'
            values |= estimate_values(latest.size)
        changed.values = key_values(values)
        return learned, changed

    def check(self, values: Mapping[str, Any]) -> None:
        """Raise an ArmidError if new settings cannot be applied at run time."""
        if self.identifier is not None:
            self.identifier.check(self._settings(values))

    def changed(self, names: frozenset[str]) -> None:
        """Apply changed settings and publishing rate."""
        if 'estimate_rate' in names:
            self._timer.timer_period_ns = round(1e9 / self.value('estimate_rate'))
            self._timer.reset()  # otherwise the old period has to pass first
        if self.identifier is not None:
            self.identifier.use(self._settings({name: self.value(name) for name in names}))

    def _settings(self, values: Mapping[str, Any]) -> OnlineSettings:
        """Return the settings: new `values`, and ROS parameters for all other settings."""
        new = {name: x for name, x in values.items() if name in OnlineIdentifier.CHANGEABLE}
        if 'false_alarm_time' in new:
            new['false_alarm_time'] = new['false_alarm_time'] or None
        return replace(self._require().settings, **new)

    def _described(self, description: str | None = None) -> OnlineIdentifier:
        """Return an identifier for the robot of a URDF text or of the ROS parameters."""
        arm = ArmModel.of(self.described_robot(description), effects=self.value('effects'))
        noise = tuple(self.value('torque_noise'))
        if len(noise) == 1:
            noise = noise * arm.robot.n_joints
        settings = OnlineSettings(
            cutoff=self.value('cutoff'),
            forgetting=self.value('forgetting'),
            torque_noise=noise if any(noise) else None,
            max_gap=self.value('max_gap'),
            measured_velocity=self.value('measured_velocity'),
            false_alarm_time=self.value('false_alarm_time') or None,
        )
        return OnlineIdentifier(arm, settings, rng=np.random.default_rng(0))

    def level(self, troubled: bool) -> bytes:
        """Return the level for /diagnostics: STALE without joint states, ERROR for wrong data."""
        failed = self.identifier is not None and bool(self.identifier.error)
        stopped = self.freshness.stopped
        return DiagnosticStatus.ERROR if failed and not stopped else super().level(troubled)

    def take_description(self, urdf: str) -> None:
        """Identify from now on the robot of a new robot_description."""
        self._begin(self._described(urdf))

    def _on_model(self, message: String) -> None:
        """Restart the identification if a received model has new effects."""
        # Effects from the parameters are kept, even if the model lacks them.
        before = self._require()
        arm = read_model(message.data, before.arm.robot, 'model')

        def covered(effect: Any, others: Sequence[Any]) -> bool:
            same = [other for other in others if other.name == effect.name]
            return any(set(other.joints) >= set(effect.joints) for other in same)

        kept = [effect for effect in self._own_effects if not covered(effect, arm.effects)]
        more = [effect for effect in arm.effects if not covered(effect, kept)]
        values = [before.arm.values_of(e) for e in kept] + [arm.values_of(e) for e in more]
        arm = replace(arm, effects=(*kept, *more), values=tuple(values))
        if arm.effects != before.arm.effects:
            rng = np.random.default_rng(0)
            self._adopt(OnlineIdentifier(arm, before.settings, rng=rng))

    def take_sample(self, sample: JointSample) -> None:
        """Update the estimate with a joint state."""
        identifier = self._require()
        begun = time.thread_time()
        identifier.update(*sample)
        self.update_times.append(time.thread_time() - begun)
        for learned in identifier.latest:
            self._last_sample = learned.t
            self._squares += learned.residual**2
            self._counted += 1
            self._publish_effort(self._predictions, learned.predicted)
            self._publish_effort(self._residuals, learned.residual)
        for change in identifier.changes[self._n_reported :]:
            self._n_reported += 1
            self._progress.reset()  # a new estimate has the same time until a warning
            self.get_logger().warning(str(change))
            self._publish(self._changes, change.size, change.t)

    def _publish(self, publisher: Publisher, estimate: Estimate, t: float) -> None:
        identifier = self._require()
        message = estimate_message(estimate, identifier.samples, identifier.condition_number)
        message.header.stamp = self.reader.stamp(t).to_msg()
        publisher.publish(message)

    def _publish_effort(self, publisher: Publisher, effort: FloatArray) -> None:
        if publisher.get_subscription_count():
            message = JointState(name=self._names, effort=effort.tolist())
            message.header.stamp = self.reader.stamp(self._last_sample).to_msg()
            publisher.publish(message)

    def _begin(self, identifier: OnlineIdentifier) -> None:
        """Replace the identifier; later models on the topic `model` can only add effects."""
        self._own_effects = identifier.arm.effects
        self._adopt(identifier)

    def _adopt(self, identifier: OnlineIdentifier) -> None:
        robot = identifier.arm.robot
        self.adopt(robot)
        self.identifier = identifier
        self._names = list(robot.joints)
        self._last_sample, self._published, self._n_reported = 0.0, -1, len(identifier.changes)
        self._disturbed: Counter[str] = Counter()
        self._progress = LearningProgress(
            identifier.arm, identifier.base, np.random.default_rng(0)
        )
        self._squares, self._counted = np.zeros(len(self._names)), 0
        self.get_logger().info(
            f'{robot.name}: {len(identifier.base.parameters)} base parameters of '
            f'{robot.n_joints} joints'
        )

    def _require(self) -> OnlineIdentifier:
        """Return the identifier; raise an error if no robot is known."""
        if self.identifier is None:
            raise IdentificationError('no robot_description was received; set the parameter robot')
        return self.identifier


main = partial(run, OnlineIdentifierNode)
