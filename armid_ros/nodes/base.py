# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Base class of all nodes: parameters, log of rejected inputs, diagnostics once a second."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, ClassVar

from armid_ros.errors import ArmidError, meant, OutputError
from armid_ros.nodes.complaints import Complaints, FATAL
from armid_ros.nodes.parameters.table import declare, NodeParameter, overrides
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from std_srvs.srv import Trigger

#: Period of the checks for new publishers and for answers of services [s].
LOOK_PERIOD = 0.1

#: Parameters of every node.
COMMON = (
    NodeParameter(
        'executor',
        'single',
        'Executor if the node runs in its own process; events takes less processor time at '
        '1 kHz, but is experimental in Jazzy.',
        choices=('single', 'events'),
    ),
    NodeParameter(
        'end_with_parent',
        False,
        'Shut the node down when its parent process ends, such as a launch ended by SIGTERM.',
    ),
)


def key_values(values: Mapping[str, object]) -> list[KeyValue]:
    """Convert numbers and texts to the key-value pairs of a /diagnostics status."""
    return [
        KeyValue(key=key, value=f'{value:.9g}' if isinstance(value, float) else str(value))
        for key, value in values.items()
    ]


class ArmidNode(Node):
    """
    Base class of nodes with a table of parameters, whose state is published on /diagnostics.

    Exceptions in callbacks do not end the node: they are counted and logged. Errors of the
    operating system, such as a full disk, do end the node.

    Attributes
    ----------
    table : tuple of NodeParameter
        The parameters of the node.
    complaints : Complaints
        Inputs that the node rejected.
    ends : callable
        Returns whether a signal ends the process of the node.

    """

    table: ClassVar[tuple[NodeParameter, ...]]

    def __init__(self, name: str, **kwargs: Any) -> None:
        """Create the node; `kwargs` are the arguments of rclpy's Node."""
        super().__init__(name, **kwargs)
        self.complaints = Complaints(self.get_logger())
        self.ends: Callable[[], bool] = lambda: False
        self._clock_missed = self._trouble_logged = False
        self._entries = declare(self, self.parameters())
        self.add_on_set_parameters_callback(self._validate)
        self.add_post_set_parameters_callback(self._apply)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_timer(1.0, self.publish_diagnostics)
        # time without /clock or expected messages until a log entry
        self.create_steady_timer(5.0, self.log_trouble)

    def parameters(self) -> Sequence[NodeParameter]:
        """Return the parameters that the node declares."""
        return (*self.table, *COMMON)

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Callable[[Any], None], *args: Any, **more: Any
    ) -> Subscription:
        """Subscribe to a topic as rclpy does; exceptions in the callback do not end the node."""
        return super().create_subscription(
            msg_type, topic, self.guarded(callback, topic), *args, **more
        )

    def create_timer(
        self, timer_period_sec: float, callback: Callable[[], None], *args: Any, **more: Any
    ) -> Timer:
        """Create a timer as rclpy does; exceptions in its callback do not end the node."""
        safe = self.guarded(callback, getattr(callback, '__name__', 'timer'))
        return super().create_timer(timer_period_sec, safe, *args, **more)

    def guarded(self, callback: Callable[..., Any], source: str) -> Callable[..., Any]:
        """Return a callback whose exceptions are logged as faults of the input `source`."""

        @wraps(callback)
        def call(*args: Any) -> Any:
            try:
                return callback(*args)
            except FATAL:
                raise
            except ArmidError as error:
                self.complaints.add(source, f'{source}: {error}')
            except Exception as error:
                if not self.context.ok():  # ROS shuts down
                    raise
                self.complaints.add_exception(source, error)
            return None

        return call

    def create_steady_timer(self, seconds: float, callback: Callable[[], None]) -> Timer:
        """Create a timer that runs in real time, independent of /clock."""
        return self.create_timer(seconds, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def missing_clock(self) -> str:
        """Message if simulated time is used but /clock has no time; otherwise ''."""
        clock = self.get_clock()
        if not clock.ros_time_is_active:
            return ''
        topic = self.resolve_topic_name('/clock')
        if not self.count_publishers(topic):
            return (
                f'use_sim_time is true, but no node publishes {topic}: start the simulation, or '
                'set use_sim_time:=false'
            )
        if not clock.now().nanoseconds:
            return f'use_sim_time is true, but {topic} has no time: run the simulation'
        return ''

    def log_trouble(self) -> None:
        """Log a new problem of the node once, such as missing simulated time."""
        missing = self.missing_clock
        if missing and not self._clock_missed:
            self.get_logger().warning(f'{missing}; until then the node waits')
        self._clock_missed = bool(missing)
        trouble = '' if missing else self.condition()[0]
        if trouble and not self._trouble_logged and not self.complaints.has_logged(trouble):
            self.get_logger().info(trouble)
        self._trouble_logged = bool(trouble)

    def warn_of_unknown(self) -> None:
        """Log each parameter that was set at the start and that the node does not have."""
        known = self.get_parameters_by_prefix('')
        given = [name for name in overrides(self) if not name.startswith('qos_overrides.')]
        wrong = [name for name in given if name not in known]
        if wrong:
            named = [f"no parameter is named '{name}'{meant(name, known)}" for name in wrong]
            self.complaints.add('parameter', f'{"; ".join(named)}; ignored, see --help')

    @property
    def finished(self) -> bool:
        """Whether the node has completed its task, so that its process may end."""
        return False

    @property
    def failure(self) -> str:
        """Reason for a failed task of the node, which ends with exit code 2; otherwise ''."""
        return ''

    @property
    def activity(self) -> str:
        """Message on /diagnostics for a node without a problem."""
        return 'running'

    @property
    def hardware(self) -> str:
        """Name of the robot on /diagnostics."""
        return ''

    @abstractmethod
    def condition(self) -> tuple[str, Mapping[str, object]]:
        """
        Return the present problem of the node, and values to publish on /diagnostics.

        Returns
        -------
        trouble : str
            Problem that keeps the node from its task; empty if none.
        values : mapping of str to number or str
            Values for diagnostics; numbers can be plotted.

        """

    def level(self, troubled: bool) -> bytes:
        """Return the level for /diagnostics: WARN if `troubled`, otherwise OK."""
        return DiagnosticStatus.WARN if troubled else DiagnosticStatus.OK

    def further_statuses(self) -> Sequence[DiagnosticStatus]:
        """Return additional statuses of the node for /diagnostics."""
        return ()

    def check(self, values: Mapping[str, Any]) -> None:
        """
        Raise an ArmidError if new parameter values are not allowed at run time.

        Parameters
        ----------
        values : mapping of str to value
            New values, which are set together; types and ranges are already checked.

        """

    def changed(self, names: frozenset[str]) -> None:
        """
        Apply parameters that were changed at run time.

        Parameters
        ----------
        names : frozenset of str
            Names of the parameters that were set.

        """

    def close(self) -> None:
        """Save results and stop motions before the node ends."""

    def log(self, text: str) -> str:
        """Log a text if ROS is not shut down, and return the text."""
        if self.context.ok():
            self.get_logger().info(text)
        return text

    def value(self, parameter: str) -> Any:
        """Return the value of a parameter; for a list of texts, without empty texts."""
        value = self.get_parameter(parameter).value
        is_list = isinstance(value, list) and all(isinstance(one, str) for one in value)
        return tuple(filter(None, value)) if is_list else value

    def folder(self, parameter: str) -> Path:
        """Return the folder that a parameter names; create it if it is missing."""
        folder = Path(self.value(parameter)).expanduser()
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            text = f'{parameter}: the folder {folder} cannot be created: {error.strerror}'
            raise OutputError(text) from error
        return folder

    def offer(self, service: str, action: Callable[[], str]) -> None:
        """
        Offer a std_srvs/Trigger service that calls a function and returns its text.

        Parameters
        ----------
        service : str
            Name of the service, such as '~/reset'.
        action : callable
            Does the work and returns the answer; the text of an ArmidError becomes the answer.

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
                self.complaints.add_exception(service, error)
                response.message = self.complaints.latest
            return response

        self.create_service(Trigger, service, answer)

    def set_parameters(self, parameter_list: list[Parameter]) -> list[SetParametersResult]:
        """Set parameters one by one; see `set_parameters_atomically`."""
        return [self.set_parameters_atomically([parameter]) for parameter in parameter_list]

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """
        Set parameters as rclpy does, and log rejected parameters.

        Parameters with unchanged values are accepted, so that dumped parameters can be loaded
        again. An integer is accepted for a float.

        """
        known = self._entries
        try:
            given = [
                Parameter(p.name, value=known[p.name].converted(p.value)) if p.name in known else p
                for p in parameter_list
            ]
        except ArmidError as error:
            self.complaints.add('parameter', str(error))
            return SetParametersResult(successful=False, reason=str(error))
        changed = [
            p
            for p in given
            if not self.has_parameter(p.name)
            or self.get_parameter(p.name).get_parameter_value() != p.get_parameter_value()
        ]
        if not changed:
            return SetParametersResult(successful=True)
        result = super().set_parameters_atomically(changed)
        name = ', '.join(p.name for p in changed)
        if not result.successful:
            reason = result.reason.removeprefix(f"parameter '{name}': ")
            self.complaints.add('parameter', f"parameter '{name}' refused: {reason}")
        return result

    def publish_diagnostics(self) -> None:
        """Publish the node's state and its rejected inputs on /diagnostics."""
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
        self.complaints.fresh = False

    def _validate(self, parameters: list[Parameter]) -> SetParametersResult:
        values = {p.name: p.value for p in parameters}
        try:
            for name in values.keys() & self._entries.keys():
                self._entries[name].require(values[name])
            self.check(values)
        except ArmidError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply(self, parameters: list[Parameter]) -> None:
        try:
            self.changed(frozenset(p.name for p in parameters))
        except ArmidError as error:
            self.complaints.add('parameter', str(error))
