# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Live diagnosis node: diagnoses an arm while it moves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
import math
from pathlib import Path
from typing import Any

from armid_msgs.msg import Diagnosis
from armid_ros.api.arguments import read_recording, source_of
from armid_ros.arm import ArmModel, load_misfit, load_model
from armid_ros.arm.model_file import model_text
from armid_ros.errors import IdentificationError
from armid_ros.estimate import name_in_words
from armid_ros.files.output import refuse_replacing
from armid_ros.nodes.base import key_values
from armid_ros.nodes.listening import ListeningNode, ROBOT_PARAMETERS
from armid_ros.nodes.live import Answer, Assistant, LiveDiagnosis, LiveSettings
from armid_ros.nodes.live.assistant import FILES
from armid_ros.nodes.messages.joint_states import JointSample
from armid_ros.nodes.parameters.table import NodeParameter, setting
from armid_ros.nodes.qos import LATCHED
from armid_ros.nodes.running.process import run
from armid_ros.simulation.plant import require_any_mass
from diagnostic_msgs.msg import DiagnosticStatus
from std_msgs.msg import String

#: Diagnostics level of a verdict; WARN for all other verdicts.
_LEVELS = {
    'consistent': DiagnosticStatus.OK,
    'bad_data': DiagnosticStatus.ERROR,
}


#: Parameters of the fields of LiveSettings, which can be set at run time.
LIVE_SETTINGS = (
    setting(
        'window', 20.0, 'Longest diagnosed motion; a change clears it.', 's', limits=(4.0, 600.0)
    ),
    setting(
        'shortest', 8.0, 'Shortest diagnosed motion after a change.', 's', limits=(2.0, 600.0)
    ),
    setting('every', 4.0, 'Length of motion between two diagnoses.', 's', limits=(0.5, 3600.0)),
    setting('rate', 200.0, 'Stored joint states per second.', 'Hz', limits=(10.0, 2000.0)),
    setting(
        'confirmations',
        2,
        'Successive diagnoses that have to name the same effect before its proposal.',
        limits=(1, 100),
    ),
    setting(
        'material',
        0.01,
        "Share of a joint's torque (rms) below which an effect does not matter.",
        limits=(0.0, 1.0),
    ),
)


class LiveDiagnosisNode(ListeningNode):
    """
    Node that diagnoses an arm while it moves, and proposes a corrected model.

    After enough new motion, a separate process diagnoses the arm, and the result is published on
    ~/diagnosis. If several diagnoses in a row agree, the patched model is published on ~/model,
    which a simulated arm and the online identifier use. ~/accept makes the patched model the model
    of later diagnoses, and ~/reject discards it.

    Attributes
    ----------
    live : LiveDiagnosis, or None
        None until a robot is known.

    """

    table = (
        *ROBOT_PARAMETERS,
        NodeParameter(
            'model', '', 'model.yaml of the arm; empty: the robot description and the effects.'
        ),
        NodeParameter(
            'effects', [''], 'Known effects of the arm, each as NAME[@joint+joint]:quantity=value.'
        ),
        NodeParameter('baseline', [''], 'Bags of the baseline.'),
        NodeParameter(
            'learning',
            20.0,
            'Duration of motion of the healthy arm at the beginning, for the misfit of the model '
            'if neither a baseline nor the model file has the misfit. 0: diagnose all deviations '
            'from the model, not only changes.',
            's',
            limits=(0.0, 600.0),
        ),
        *LIVE_SETTINGS,
        setting(
            'save_to',
            'live_diagnosis',
            'Folder of ~/save: diagnosis.json, model.yaml, report.html.',
        ),
        NodeParameter('seed', 0, 'Random seed of the diagnoses.', limits=(0, 2**62)),
    )

    def __init__(
        self, live: LiveDiagnosis | None = None, helper: Assistant | None = None, **kwargs: Any
    ) -> None:
        """
        Create the node, and publish the present model.

        Parameters
        ----------
        live : LiveDiagnosis, optional
            Schedule of the diagnoses; by default from the parameters, once the robot is known.
        helper : Assistant, optional
            Computes the diagnoses; by default in a separate process.
        **kwargs
            Further arguments of rclpy's Node.

        """
        super().__init__('live_diagnosis', **kwargs)
        self.live: LiveDiagnosis | None = None
        self._logged: object = ()
        self._disturbed: set[str] = set()  # faults since the last diagnostics
        self._helper = helper or Assistant()
        self._diagnoses = self.create_publisher(Diagnosis, '~/diagnosis', LATCHED)
        self._models = self.create_publisher(String, '~/model', LATCHED)
        self._runs = self.create_publisher(String, '~/experiment', LATCHED)
        if live is None and (self.value('robot') or self.value('model')):
            live = self._described()
        if live is not None:
            self._adopt(live)
        self.listen()
        for service in (self.accept, self.reject, self.save, self.next_run, self.reset):
            self.offer(f'~/{service.__name__}', service)

    @property
    def busy(self) -> bool:
        """Whether the diagnosis process is computing a diagnosis, files or a motion."""
        return self._helper.busy

    def accept(self) -> str:
        """Accept the proposed model for later diagnoses; return the answer of the service."""
        return self._decide('accepted', self._require().accept)

    def reject(self) -> str:
        """Discard the proposed effects permanently; return the answer of the service."""
        return self._decide('rejected', self._require().reject)

    def _decide(self, decision: str, action: Callable[[], None]) -> str:
        named = '; '.join(
            ' of '.join(filter(None, (name_in_words(name), ', '.join(joints))))
            for name, joints in self._require().named
        )
        action()
        self._publish_model()
        return self.log(f'{decision}: {named}')

    def reset(self) -> str:
        """Restart the diagnosis with the original model; return the answer of the service."""
        self._require().reset()
        self._publish_model()
        return 'the diagnosis begins anew, with the original model'

    def save(self) -> str:
        """Start to write the files of the last diagnosis; the log reports the completion."""
        self._require(diagnosed=True)
        folder = self.folder('save_to')
        refuse_replacing(folder, FILES)
        self._helper.ask('save', folder)
        return f'writing {", ".join(FILES)} to {folder}'

    def next_run(self) -> str:
        """Start to plan a motion that separates rivals, for publication on ~/experiment."""
        self._require(diagnosed=True)
        self._helper.ask('plan', self.value('seed'))
        return f'planning a motion; it will be published on {self._runs.topic_name}'

    def poll(self) -> None:
        """Adopt the QoS of publishers of joint states; process finished diagnoses."""
        super().poll()
        self.take_answer()

    def take_sample(self, sample: JointSample) -> None:
        """Add a joint state to the window; start a diagnosis after enough new motion."""
        live = self._require()
        learning = live.learning
        late, self._last = self._last - sample.t, sample.t
        if late >= 0.0:  # a larger step back than 0.1 s is a jump of the clock
            self._disturbed.add('jump_back' if late > 0.1 else 'out_of_order')
        live.add(*sample)
        if learning and not live.learning:
            self.log('the misfit of the model is known; diagnoses begin')
        if live.due and not self._helper.busy:
            self._helper.ask('diagnose', live.request())

    def take_answer(self) -> bool:
        """Process the next result of the diagnosis process; return whether a result existed."""
        result = self._helper.poll()
        if result is None:
            return False
        if isinstance(result, Answer):
            self._take(result)
        elif isinstance(result, IdentificationError):
            self.complaints.add('diagnosis', str(result))
        else:  # result of saving or planning
            text, excitation = result
            self.log(text)
            if excitation:
                self._runs.publish(String(data=excitation))
        return True

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Return a message on a fault or '', and numbers of samples and diagnoses."""
        live = self.live
        if live is None:
            return self.awaited, {'received': self.received}
        values = {
            'received': self.received,
            'kept samples': len(live.window),
            'motion [s]': live.window.moved,
            'diagnoses': live.asked,
            'busy': int(self.busy),
            'proposed': int(live.proposed is not None),
        }
        if live.window.frozen:
            self._disturbed.add('frozen')
        for reason in sorted(self._disturbed):
            self.report(reason)
        self._disturbed.clear()
        trouble = self.stream_trouble()
        if live.learning and not (trouble or self.complaints.fresh):
            trouble = 'learning the misfit of the model: the arm must be healthy'
        return trouble, values

    def further_statuses(self) -> Sequence[DiagnosticStatus]:
        """Return the last diagnosis for /diagnostics, with residuals and effects."""
        if self.live is None:
            return ()
        name = f'{self.get_fully_qualified_name()[1:]}: diagnosis'
        answer = self.live.latest
        status = DiagnosticStatus(
            name=name, hardware_id=self.hardware, message='no diagnosis so far'
        )
        status.level = DiagnosticStatus.OK
        if answer is None:
            return (status,)
        status.level = _LEVELS.get(answer.verdict, DiagnosticStatus.WARN)
        status.message = f'{answer.verdict.replace("_", " ")}: {answer.summary}'
        numbers = {'processor seconds': answer.seconds, 'window': answer.window.duration}
        for joint, before, after, floor in _residuals(answer):
            numbers |= {
                f'gap before {joint} [N m]': before,
                f'gap after {joint} [N m]': after,
                f'floor {joint} [N m]': floor,
            }
        for finding in answer.findings:
            for parameter, value, std, _ in finding.rows:
                what = ' '.join(filter(None, (finding.name, parameter.joint, parameter.name)))
                numbers |= {f'{what} [{parameter.unit}]': value, f'{what} std': std}
        status.values = key_values(numbers)
        return (status,)

    def check(self, values: Mapping[str, Any]) -> None:
        """Raise an IdentificationError if new settings contradict each other."""
        self._settings(values)

    def changed(self, names: frozenset[str]) -> None:
        """Apply new settings of the diagnosis."""
        if self.live is not None and names & {entry.name for entry in LIVE_SETTINGS}:
            self.live.use(self._settings({}))

    def close(self) -> None:
        """End the diagnosis process."""
        self._helper.close()

    def take_description(self, urdf: str) -> None:
        """Diagnose from now on the robot of a new robot_description."""
        self._adopt(self._described(urdf))

    def _settings(self, values: Mapping[str, Any]) -> LiveSettings:
        """Return the settings: new `values`, and ROS parameters for all other settings."""
        names = (*(entry.name for entry in LIVE_SETTINGS), 'learning')
        return LiveSettings(**{name: values.get(name, self.value(name)) for name in names})

    def _described(self, description: str | None = None) -> LiveDiagnosis:
        """Return a new diagnosis schedule for the robot of a URDF text or of the parameters."""
        robot = model = None
        if description is not None or self.value('robot'):
            robot = self.described_robot(description)
        if self.value('model'):
            model = Path(self.value('model')).expanduser()
        arm = load_model(model, robot) if model else ArmModel(robot)
        given = ArmModel.of(arm.robot, effects=self.value('effects'))
        values = dict(zip(arm.effects, arm.values, strict=True))
        values |= zip(given.effects, given.values, strict=True)
        arm = replace(arm, effects=tuple(values), values=tuple(values.values()))
        require_any_mass(arm.robot)
        bags = tuple(read_recording(bag, arm) for bag in self.value('baseline'))
        misfit = load_misfit(model) if model and not bags else None
        settings, seed = self._settings({}), self.value('seed')
        return LiveDiagnosis(arm, settings, baseline=bags, misfit=misfit, seed=seed)

    def _take(self, answer: Answer) -> None:
        """Publish a diagnosis, and the proposed model if the model has changed."""
        live = self._require()
        latest = live.latest
        changed = live.take(answer)
        if changed:
            self._publish_model()
        if live.latest is latest:
            return
        message = Diagnosis(
            robot=self.hardware,
            verdict=answer.verdict,
            summary=answer.summary,
            window=float(answer.window.duration),
            confirmed=live.confirmed,
            effect=[finding.name for finding in answer.findings],
            effect_joints=[','.join(finding.joints) for finding in answer.findings],
            share=[float(finding.share) for finding in answer.findings],
            rivals=[','.join(finding.ambiguous_with) for finding in answer.findings],
        )
        for joint, before, after, floor in _residuals(answer):
            message.gap_joint.append(joint)
            message.gap_before.append(before)
            message.gap_after.append(after)
            message.gap_floor.append(floor)
        for number, finding in enumerate(answer.findings):
            for parameter, value, std, _ in finding.rows:
                message.name.append(parameter.name)
                message.joint.append(parameter.joint)
                message.unit.append(parameter.unit)
                message.value.append(float(value))
                message.std_dev.append(float(std))
                message.of_effect.append(number)
        message.header.stamp = self.reader.stamp(answer.end).to_msg()
        self._diagnoses.publish(message)
        text = f'{answer.verdict.replace("_", " ")}: {answer.summary}'
        if answer.named != self._logged:
            self._logged = answer.named
            self.get_logger().warning(text) if answer.named else self.get_logger().info(text)

    def _publish_model(self) -> None:
        model = self._require().model
        self._models.publish(String(data=model_text(model, source_of(model.robot))))

    def _adopt(self, live: LiveDiagnosis) -> None:
        robot = live.accepted.robot
        self.adopt(robot)
        self.live = live
        self._last = -math.inf
        self._publish_model()

    def _require(self, *, diagnosed: bool = False) -> LiveDiagnosis:
        """Return the schedule; IdentificationError without a robot or a required diagnosis."""
        if self.live is None:
            raise IdentificationError('no robot_description was received; set the parameter robot')
        if diagnosed and self.live.latest is None:
            raise IdentificationError('no diagnosis is complete so far; keep the arm moving')
        return self.live


def _residuals(answer: Answer) -> list[tuple[str, float, float, float]]:
    """Return joint names, residuals without and with named effects, and floors [N m or N]."""
    gap = answer.gap
    if gap is None:
        return []
    columns = (column.tolist() for column in (gap.before, gap.after, gap.floor))
    return list(zip(answer.arm.robot.joints, *columns, strict=True))


main = partial(run, LiveDiagnosisNode)
