# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A ROS context and an executor for each test, on a separate domain, spun by hand."""

from collections.abc import Callable, Iterator
import itertools
import time
from typing import Any, TypeVar

from armid_ros.arm import ArmModel
from armid_ros.excitation import Excitation, Limits, random_feasible
from armid_ros.nodes.qos import LATCHED
from armid_ros.nodes.running.domains import private_context
from armid_ros.nodes.running.real_time import RealTime
from armid_ros.robots import load_robot
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import numpy as np
import pytest
from rcl_interfaces.msg import Log
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor, TimeoutException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

AnyNode = TypeVar('AnyNode', bound=Node)

#: Longest wait for a condition [s]; only broken code reaches it.
PATIENCE = 60.0
#: Time without callbacks after which nothing is left to do [s]; delivery takes a thousandth.
QUIET = 0.02
#: Time after which a call is repeated [s].
REPEAT = 5.0


def busy(real_time: RealTime, monkeypatch: pytest.MonkeyPatch, seconds: float = 10.0) -> None:
    """Let a clock appear some seconds late, and each look at it last 1 ms: a busy computer."""
    looks = itertools.count()
    monkeypatch.setattr(
        real_time, '_clock', lambda: time.monotonic() + seconds + 1e-3 * next(looks)
    )


class Bench:
    """A test bench: nodes under test, and a probe node that communicates with them."""

    def __init__(self, context: Context) -> None:
        self.context = context
        self.executor = SingleThreadedExecutor(context=context)
        self.probe = self.add(Node, node_name='probe')
        self._clock = self.probe.create_publisher(Clock, '/clock', 10)

    def add(self, make: Callable[..., AnyNode], *args: Any, **parameters: Any) -> AnyNode:
        """Make a node on the bench; keywords are its parameters, except names and cli_args."""
        names = ('node_name', 'namespace', 'cli_args')
        ros = {k: parameters.pop(k) for k in names if k in parameters}
        node = make(
            *args,
            context=self.context,
            use_global_arguments=False,
            parameter_overrides=[Parameter(k, value=v) for k, v in parameters.items()],
            **ros,
        )
        self.executor.add_node(node)
        return node

    def spin_until(self, predicate: Callable[[], object], what: str = 'the condition') -> None:
        """Spin until a condition holds."""
        deadline = time.monotonic() + PATIENCE
        while not predicate():
            if time.monotonic() > deadline:
                pytest.fail(f'{what} never came')
            self.executor.spin_once(timeout_sec=0.05)

    def settle(self) -> None:
        """Spin until no callback is ready; fail if that never happens."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            try:
                handler, _, _ = self.executor.wait_for_ready_callbacks(timeout_sec=QUIET)
            except TimeoutException:
                return
            handler()
            if handler.exception() is not None:
                raise handler.exception()
        pytest.fail('there is always something left to do')

    def listen(
        self, message_type: type[Any], topic: str, qos: QoSProfile | int = 1000
    ) -> list[Any]:
        """Return a list to which the messages of a topic are appended."""
        messages: list[Any] = []
        self.probe.create_subscription(message_type, topic, messages.append, qos)
        return messages

    def matched_publisher(
        self, message_type: type[Any], topic: str, qos: QoSProfile | int = 1000, readers: int = 1
    ) -> Any:
        """Return a publisher to whose topic a node has subscribed."""
        publisher = self.probe.create_publisher(message_type, topic, qos)
        self.spin_until(lambda: publisher.get_subscription_count() >= readers, topic)
        return publisher

    def tick(self, nanoseconds: int) -> None:
        """Set /clock, and wait until every node on simulated time has it."""
        nodes = [
            node for node in self.executor.get_nodes() if node.get_parameter('use_sim_time').value
        ]
        self.spin_until(lambda: self._clock.get_subscription_count() >= len(nodes), '/clock')
        stamp = Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
        self._clock.publish(Clock(clock=stamp))
        self.spin_until(
            lambda: all(n.get_clock().now().nanoseconds == nanoseconds for n in nodes), '/clock'
        )

    def stop_clock(self) -> None:
        """Stop the publishing of /clock."""
        self.probe.destroy_publisher(self._clock)

    def call(self, service: str) -> Trigger.Response:
        """
        Call a Trigger service.

        A server that has not found the client yet drops its answer, so the call is repeated.

        """
        client = self.probe.create_client(Trigger, service)
        self.spin_until(client.service_is_ready, service)
        futures: list[Any] = []

        def answered() -> bool:
            if time.monotonic() > begun + REPEAT * len(futures):
                futures.append(client.call_async(Trigger.Request()))
            return any(future.done() for future in futures)

        begun = time.monotonic()
        self.spin_until(answered, f'the answer of {service}')
        return next(future.result() for future in futures if future.done())

    def rosout(self) -> list[Log]:
        """Return a list to which new log messages are appended."""
        messages = self.listen(Log, '/rosout', LATCHED)
        return messages

    def diagnose(self, node: Any, diagnostics: list[DiagnosticArray]) -> DiagnosticStatus:
        """Let a node publish its diagnostics, and return them from the list of diagnostics."""
        self.settle()
        count = len(diagnostics)
        node.publish_diagnostics()
        self.spin_until(lambda: len(diagnostics) > count, 'diagnostics')
        return diagnostics[-1].status[0]

    def diagnostics(self) -> list[DiagnosticArray]:
        """Return a list to which diagnostics are appended."""
        return self.listen(DiagnosticArray, '/diagnostics')


@pytest.fixture(scope='session')
def excitation() -> Excitation:
    """Return a short excitation of the shipped arm."""
    robot, rng = load_robot('humanoid_arm'), np.random.default_rng(3)
    limits = Limits.of(robot, speed='medium')
    return Excitation(random_feasible(ArmModel(robot), limits, 2.0, 3, rng), 1, 0.5)


@pytest.fixture
def bench() -> Iterator[Bench]:
    """Return a test bench on a separate domain."""
    with private_context() as context:
        bench = Bench(context)
        yield bench
        for node in list(bench.executor.get_nodes()):
            # a failing callback does not end a node, but is an error of the node
            complaints = getattr(node, 'complaints', None)
            assert complaints is None or complaints.defects == 0, complaints.latest
            bench.executor.remove_node(node)
            if hasattr(node, 'close'):
                node.close()
            node.destroy_node()
        bench.executor.shutdown()
