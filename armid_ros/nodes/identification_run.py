# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identification run node: excites and records an arm, then identifies and diagnoses it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
import json
import math
from pathlib import Path
import subprocess
import sys
import time
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.verdict.document import SCHEMA as DIAGNOSIS
from armid_ros.errors import ArmidError, RecordingError, TrajectoryError
from armid_ros.files.output import refuse_foreign
from armid_ros.identification.output import SCHEMA as IDENTIFICATION
from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.listening import ROBOT_PARAMETERS
from armid_ros.nodes.parameters.table import NodeParameter
from armid_ros.nodes.running.process import run
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.task import Future
from std_srvs.srv import Trigger

#: Result folder of each command, schema of its JSON file, and the reported keys of the file.
_RESULTS = {
    'identify': ('identification', IDENTIFICATION, ('grade',)),
    'diagnose': ('diagnosis', DIAGNOSIS, ('verdict', 'summary')),
}
#: Time without the services of another node after which it has ended [s].
_GONE = 5.0
#: An armid command with its arguments.
Program = tuple[str, ...]
#: Name of a step, and a function that returns whether the next step may begin.
Wait = tuple[str, Callable[[], Any]]


def start_program(program: Program) -> subprocess.Popen[bytes]:
    """Start an armid command in a process of its own; return the process."""
    return subprocess.Popen([sys.executable, '-P', '-m', 'armid_ros.cli', *program])


class IdentificationRunNode(ArmidNode):
    """
    Node that runs a whole identification, from excitation to reports, and then ends.

    The node calls `recorder` and `excitation_publisher` for each run. After all runs it starts
    `armid identify` and `armid diagnose` on the recordings. The last of several runs is held out.
    An error is logged and ends the node with code 2; recordings and results so far are kept.
    Inputs are checked before the arm moves. At its end, the node stops the run and the recording
    that it started.

    """

    table = (
        NodeParameter('robot', 'humanoid_arm', 'A shipped robot, or the path of a URDF or xacro.'),
        *ROBOT_PARAMETERS[1:],
        NodeParameter(
            'effects', [''], 'Effects added to the rigid body; empty: the default of armid.'
        ),
        NodeParameter(
            'save_to', 'identification', 'Folder for the subfolders identification and diagnosis.'
        ),
        NodeParameter('runs', 2, 'Number of runs of the excitation.', limits=(1, 20)),
        NodeParameter(
            'rehearse',
            False,
            'First run the excitation slowly; continue only if the arm moves as predicted.',
        ),
        NodeParameter('diagnose', True, 'Diagnose the arm after its identification.'),
        NodeParameter('publisher', 'excitation_publisher', 'Name of the node that excites.'),
        NodeParameter('recorder', 'recorder', 'Name of the node that records.'),
        NodeParameter(
            'patience',
            300.0,
            'How long to wait for the other nodes, a controller and joint states; the publisher '
            'may first have to design an excitation.',
            's',
            limits=(1.0, 3600.0),
        ),
    )

    def __init__(self, start: Callable[[Program], Any] = start_program, **kwargs: Any) -> None:
        """
        Create the node; ``start`` starts an armid command, by default in a process of its own.

        Raises
        ------
        ArmidError
            If robot, effects or folder are not valid.

        """
        super().__init__('identification_run', **kwargs)
        joints, effects = self.value('joints') or None, ','.join(self.value('effects'))
        ArmModel.of(
            self.value('robot'), effects=effects, gravity=self.value('gravity'), joints=joints
        )
        folder = self.folder('save_to')
        for subfolder, schema, _ in _RESULTS.values():
            if (folder / subfolder).is_dir():
                refuse_foreign(folder / subfolder, schema)
        self._start = start
        self._begun: list[str] = []
        self._stops: list[Future] = []
        self._program: Any = None
        self._done, self._step, self._complete = False, 'begins', math.inf
        self._failure = self._refused = ''
        self._results: list[str] = []
        self._state: dict[str, str] = {}
        services = {'publisher': ('start', 'rehearse', 'stop'), 'recorder': ('start', 'stop')}
        self._full = {node: self.resolve_topic_name(self.value(node)) for node in services}
        self._callers = {
            (node, service): self.create_client(Trigger, f'{self._full[node]}/{service}')
            for node, names in services.items()
            for service in names
        }
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 100)
        self._script = self._steps()
        self._wait: Wait = ('begins', lambda: True)
        self.create_steady_timer(0.05, self.poll)

    @property
    def finished(self) -> bool:
        """Whether all steps are done or a step has failed."""
        return self._done

    @property
    def failure(self) -> str:
        """Error of the failed step; empty if no step has failed."""
        return self._failure

    def poll(self) -> None:
        """Start the next step once the present step is complete."""
        if self._done:
            return
        now = time.monotonic()
        if self._program is not None or not self._missing():
            self._complete = now
        try:
            if now - self._complete > _GONE:
                raise ArmidError(f'{" and ".join(self._missing())} ended during: {self._step}')
            while self._wait[1]():
                self._wait = next(self._script)
                if self._wait[0] != self._step:
                    self._step = self._wait[0]
                    self.get_logger().info(self._step)
        except StopIteration:
            self._done = True
            self.get_logger().info('; '.join(self._results))
        except ArmidError as error:
            self._done, self._failure = True, str(error)
            self._stop_all()

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Return the last error, and values: present step and results so far."""
        return self._failure or self._refused, {
            'step': self._step,
            'results': '; '.join(self._results),
        }

    def close(self) -> None:
        """Stop the run, the recording and the command that this node has started."""
        self._stop_all()
        for future in self._stops:
            if self.executor is not None:  # the node to stop may have ended already
                self.executor.spin_until_future_complete(future, timeout_sec=1.0)
        if self._program is not None and self._program.poll() is None:
            self._program.terminate()
            try:
                self._program.wait(5.0)
            except subprocess.TimeoutExpired:
                self._program.kill()

    def _stop_all(self) -> None:
        """Stop the run, then the recording, that this node has started."""
        for node in sorted(self._begun):
            if self._callers[node, 'stop'].service_is_ready():
                self._stops.append(self._call(node, 'stop'))
        self._begun = []

    def _steps(self) -> Iterator[Wait]:
        """Yield the name of each step, and a function that returns whether it is complete."""
        deadline = time.monotonic() + self.value('patience')
        yield (
            'waits for the other nodes',
            lambda: not self._missing() or time.monotonic() > deadline,
        )
        if self._missing():
            raise ArmidError(
                f'{" and ".join(self._missing())} did not start within '
                f'{self.value("patience"):g} s; start them, or increase the parameter patience'
            )
        if self.value('rehearse'):
            yield from self._run_excitation('rehearse')
        bags = []
        for number in range(self.value('runs')):
            answer = yield from self._call_service('recorder', 'start')
            self._begun.append('recorder')
            bags.append(answer.removeprefix('recording into '))
            yield from self._run_excitation('start', f'run {number + 1} of {self.value("runs")}')
            yield from self._call_service('recorder', 'stop')
            self._begun.remove('recorder')
        folder = Path(self.value('save_to')).expanduser()
        yield from self._run_command('identify', folder, bags)
        if self.value('diagnose'):
            model = ('--model', str(folder / 'identification' / 'model.yaml'))
            yield from self._run_command('diagnose', folder, bags, *model)

    def _run_excitation(self, service: str, name: str = 'rehearsal') -> Iterator[Wait]:
        """Call a service of excitation_publisher until a run starts; wait for the run to end."""
        before = int(self._state.get('runs', 0))
        deadline = time.monotonic() + self.value('patience')
        while True:
            future = self._call('publisher', service)
            yield f'{name} is planned', future.done
            answer = future.result()
            self._refused = '' if answer.success else f'{name}: {answer.message}'
            if answer.success:
                break
            self.complaints.add('start', self._refused)
            self.publish_diagnostics()
            if time.monotonic() > deadline:
                raise TrajectoryError(self._refused)
            later = time.monotonic() + 1.0
            yield f'{name} is planned', lambda later=later: time.monotonic() > later

        def over() -> bool:
            state = self._state
            if int(state.get('runs', 0)) <= before or state['run'] == 'under way':
                return False
            rehearsed = state['run'] == 'stopped' or 'rehearsed' in state['message']
            return rehearsed or service != 'rehearse'

        self._begun.append('publisher')
        yield f'{name} is under way', over
        self._begun.remove('publisher')
        if self._state['run'] != 'complete':
            raise TrajectoryError(f'{name}: {self._state["message"]}')
        if service == 'rehearse':
            report = self._state['message']
            self.get_logger().info(report)
            if 'find the cause' in report:
                raise TrajectoryError(report)

    def _call_service(self, node: str, service: str) -> Any:
        """Call a service of the node, wait for the answer, and return the text of the answer."""
        future = self._call(node, service)
        yield self._step, future.done
        answer = future.result()
        if not answer.success:
            raise RecordingError(f'{self._full[node]}: {answer.message}')
        return str(answer.message)

    def _run_command(
        self, command: str, folder: Path, bags: list[str], *more: str
    ) -> Iterator[Wait]:
        """Run an armid command on the recordings, and wait for the command to end."""
        fitted, held_out = (bags[:-1], bags[-1:]) if len(bags) > 1 else (bags, [])
        validate = [part for bag in held_out for part in ('--validate', bag)]
        options = {name: self.value(name) for name in ('robot', 'gravity')}
        if command == 'identify':
            options['effects'] = ','.join(self.value('effects'))
        options['joints'] = ','.join(self.value('joints'))
        given = [part for key, text in options.items() if text for part in (f'--{key}', text)]
        name, _, keys = _RESULTS[command]
        out = folder / name
        program = (command, *fitted, *validate, *given, *more, '--out', str(out))
        self._program = self._start(program)
        yield f'armid {command} is under way', lambda: self._program.poll() is not None
        document, file = {}, out / f'{name}.json'
        if file.is_file():
            document = json.loads(file.read_text(encoding='utf-8'))
        # bad_data is a valid verdict, not a failure
        if self._program.returncode and document.get('verdict') != 'bad_data':
            known = f'; until then: {"; ".join(self._results)}' if self._results else ''
            raise ArmidError(
                f'armid {command} ended with code {self._program.returncode}; the recordings are '
                f'{", ".join(bags)}{known}'
            )
        result = ': '.join(str(document[key]).replace('_', ' ') for key in keys if key in document)
        self._results.append(f'{command}: {result or "done"} ({out / "report.html"})')

    def _missing(self) -> list[str]:
        """Return the names of the other nodes whose services are not available."""
        return [
            name
            for node, name in self._full.items()
            if not self._callers[node, 'start'].service_is_ready()
        ]

    def _call(self, node: str, service: str) -> Future:
        return self._callers[node, service].call_async(Trigger.Request())

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        wanted = f'{self._full["publisher"][1:]}: state'
        for status in message.status:
            if status.name == wanted:
                values = {value.key: value.value for value in status.values}
                self._state = {**values, 'message': status.message}


main = partial(run, IdentificationRunNode)
