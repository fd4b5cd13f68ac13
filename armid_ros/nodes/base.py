# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the nodes share: a table of parameters, complaints, and diagnostics once a second."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from armid_ros.errors import ArmidError, OutputError
from armid_ros.nodes.complaints import Complaints, FATAL, surviving
from armid_ros.nodes.parameters.table import as_declared, declare, is_as, NodeParameter, unknown
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from std_srvs.srv import Trigger

#: How long a simulation may take to publish /clock, and others to send what a node waits for,
#: before it is said that nothing does [s].
_PATIENCE = 5.0

#: How often new publishers and answers are looked for [s].
LOOK_PERIOD = 0.1

#: Parameters of every node.
COMMON = (
    NodeParameter(
        'executor',
        'single',
        'Executor when the node is a process of its own; events takes less processor time at '
        '1 kHz, but is experimental in Jazzy.',
        choices=('single', 'events'),
    ),
    NodeParameter(
        'end_with_parent',
        False,
        'End in order when the process that has started the node ends, as a launch by SIGTERM.',
    ),
)


def key_values(values: Mapping[str, object]) -> list[KeyValue]:
    """Return numbers and words as a status of /diagnostics shows them."""
    return [
        KeyValue(key=key, value=f'{value:.9g}' if isinstance(value, float) else str(value))
        for key, value in values.items()
    ]


class ArmidNode(Node):
    """
    A node with parameters from a table, that says on /diagnostics what it does and what it missed.

    No message and no timer ends it: what its callbacks raise is counted and said, but for errors
    of the operating system, such as a full disk.

    Attributes
    ----------
    table : tuple of NodeParameter
        The parameters of the node.
    complaints : Complaints
        What the node was given and could not use.

    """

    table: ClassVar[tuple[NodeParameter, ...]]

    def __init__(self, name: str, **kwargs: Any) -> None:
        """Take the keyword arguments of rclpy's Node: context, namespace, overrides and others."""
        super().__init__(name, **kwargs)
        self.complaints = Complaints(self.get_logger())
        self._paced: dict[str, tuple[Callable[[], None], Timer]] = {}
        self._clock_missed = self._trouble_said = False
        declare(self, self.parameters())
        self.add_on_set_parameters_callback(self._validate)
        self.add_post_set_parameters_callback(self._apply)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_timer(1.0, self.publish_diagnostics)
        self.look_every(_PATIENCE, self.look_for_clock)
        self.look_every(_PATIENCE, self.look_for_trouble)

    def parameters(self) -> Sequence[NodeParameter]:
        """Return the parameters to declare."""
        return (*self.table, *COMMON)

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Callable[[Any], None], *args: Any, **more: Any
    ) -> Subscription:
        """Subscribe as rclpy does, with a callback that every message is survived by."""
        return super().create_subscription(
            msg_type, topic, self._surviving(callback, topic), *args, **more
        )

    def create_timer(
        self, timer_period_sec: float, callback: Callable[[], None], *args: Any, **more: Any
    ) -> Timer:
        """Make a timer as rclpy does, with a callback that may fail."""
        guarded = self._surviving(callback, getattr(callback, '__name__', 'timer'))
        return super().create_timer(timer_period_sec, guarded, *args, **more)

    def look_every(self, seconds: float, callback: Callable[[], None]) -> Timer:
        """Call something in real time, whatever /clock says."""
        return self.create_timer(seconds, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def pace(self, parameter: str, callback: Callable[[], None]) -> None:
        """Call something as often as a parameter says [Hz], also once it is set anew."""
        if parameter in self._paced:  # a timer that is given another period waits for the old one
            self.destroy_timer(self._paced[parameter][1])
        timer = self.create_timer(1.0 / self.value(parameter), callback)
        self._paced[parameter] = callback, timer

    @property
    def missing_clock(self) -> str:
        """Say that there is no time, simulated as it is; empty where there is one."""
        clock = self.get_clock()
        if not clock.ros_time_is_active:
            return ''
        topic = self.resolve_topic_name('/clock')
        if not self.count_publishers(topic):
            return (
                f'simulated time, but nothing publishes {topic}: start what does, or set '
                'use_sim_time:=false'
            )
        if not clock.now().nanoseconds:
            return f'simulated time, but no time has come on {topic}: let the simulation run'
        return ''

    def look_for_clock(self) -> None:
        """Log once that there is no simulated time: /diagnostics do not come without it."""
        missing = self.missing_clock
        if missing and not self._clock_missed:
            self.get_logger().warning(f'{missing}; until then the node waits')
        self._clock_missed = bool(missing)

    def look_for_trouble(self) -> None:
        """Log once what keeps the node from its work: not everybody looks at /diagnostics."""
        trouble = '' if self.missing_clock else self.condition()[0]
        if trouble and not self._trouble_said and not self.complaints.has_logged(trouble):
            self.get_logger().info(trouble)
        self._trouble_said = bool(trouble)

    def warn_of_unknown(self) -> None:
        """Log the parameters that the node was started with and does not have."""
        said = unknown(self)
        if said:
            self.complaints.say('parameter', said)

    @property
    def finished(self) -> bool:
        """Whether there is nothing left to do, so that the process may end."""
        return False

    @property
    def failure(self) -> str:
        """Why the node did not do what it was started for; the process then ends with code 2."""
        return ''

    @property
    def activity(self) -> str:
        """Return what the node does while all is well, in a word."""
        return 'running'

    @property
    def hardware(self) -> str:
        """Name of the robot, for diagnostics."""
        return ''

    @abstractmethod
    def condition(self) -> tuple[str, Mapping[str, object]]:
        """
        Say how the node is.

        Returns
        -------
        trouble : str
            What keeps it from its work; empty when all is well.
        values : mapping of str to number or str
            What diagnostics shows; plotters draw the numbers.

        """

    def level(self, troubled: bool) -> bytes:
        """Return the level of the status; a node that knows worse than a warning says so here."""
        return DiagnosticStatus.WARN if troubled else DiagnosticStatus.OK

    def further_statuses(self) -> Sequence[DiagnosticStatus]:
        """Return what else to say on /diagnostics."""
        return ()

    def objection(self, values: Mapping[str, Any]) -> str:
        """
        Say why parameters cannot have new values while the node runs; empty when they can.

        Parameters
        ----------
        values : mapping of str to value
            What is to be set, all at once; each is of the right type and range.

        """
        return ''

    def changed(self, names: frozenset[str]) -> None:
        """
        Act on parameters that were set while the node runs.

        Parameters
        ----------
        names : frozenset of str
            What was set.

        """

    def close(self) -> None:
        """Finish what must not be lost."""

    def tell(self, text: str) -> str:
        """Log a text, and return it; /rosout is gone once the process is told to end."""
        if self.context.ok():
            self.get_logger().info(text)
        return text

    def value(self, parameter: str) -> Any:
        """Return the value of a parameter."""
        return self.get_parameter(parameter).value

    def folder(self, parameter: str) -> Path:
        """Return the folder that a parameter names, made if it is not there; or OutputError."""
        folder = Path(self.value(parameter)).expanduser()
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            said = f'{parameter}: {folder}: cannot be made: {error.strerror}'
            raise OutputError(said) from error
        return folder

    def offer(self, service: str, action: Callable[[], str]) -> None:
        """
        Offer a std_srvs/Trigger service.

        Parameters
        ----------
        service : str
            Its name, such as '~/reset'.
        action : callable
            Does the work and says what it did; an ArmidError it raises is the answer.

        """

        def answer(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            try:
                response.message = action()
                response.success = True
            except ArmidError as error:
                response.message = str(error)
            except FATAL:
                raise
            except Exception as error:
                self.complaints.defect(service, error)
                response.message = self.complaints.latest
            return response

        self.create_service(Trigger, service, answer)

    def set_parameters(self, parameter_list: list[Parameter]) -> list[SetParametersResult]:
        """Set parameters one by one; see `set_parameters_atomically`."""
        return [self.set_parameters_atomically([parameter]) for parameter in parameter_list]

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """
        Set parameters as rclpy does, and complain when they are refused.

        What has that value already is no change, so that all a node was dumped with can be loaded
        again; a whole number is taken for a float.

        """
        given = [as_declared(self, parameter) for parameter in parameter_list]
        changed = [p for p in given if not is_as(self, p)]
        if not changed:
            return SetParametersResult(successful=True)
        result = super().set_parameters_atomically(changed)
        name = ', '.join(p.name for p in changed)
        if not result.successful:
            reason = result.reason.removeprefix(f"parameter '{name}': ")
            self.complaints.say('parameter', f"parameter '{name}' refused: {reason}")
        return result

    def publish_diagnostics(self) -> None:
        """Publish the condition of the node, and what it complained of."""
        trouble, values = self.condition()
        status = DiagnosticStatus(
            name=f'{self.get_fully_qualified_name()[1:]}: state', hardware_id=self.hardware
        )
        troubled = bool(trouble) or self.complaints.fresh
        status.level = self.level(troubled)
        status.message = trouble or (self.complaints.latest if troubled else self.activity)
        rejected = {f'rejected {kind}': n for kind, n in self.complaints.counts.items()}
        status.values = key_values({**values, **rejected})
        message = DiagnosticArray(status=[status, *self.further_statuses()])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)
        self.complaints.settle()

    def _validate(self, parameters: list[Parameter]) -> SetParametersResult:
        reason = self.objection({p.name: p.value for p in parameters})
        return SetParametersResult(successful=not reason, reason=reason)

    def _apply(self, parameters: list[Parameter]) -> None:
        names = frozenset(p.name for p in parameters)
        for name in names & self._paced.keys():
            self.pace(name, self._paced[name][0])
        try:
            self.changed(names)
        except ArmidError as error:
            self.complaints.say('parameter', str(error))

    def _surviving(self, callback: Callable[..., Any], what: str) -> Callable[..., Any]:
        return surviving(callback, what, self)
