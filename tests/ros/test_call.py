# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid call` reaches a running node where there is no command ros2."""

from threading import Thread

from armid_ros.cli.commands import main
from click.testing import CliRunner
import pytest
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from std_srvs.srv import Trigger


@pytest.fixture
def publisher():
    """Offer the services of an excitation_publisher in a namespace, in a thread."""
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    node = rclpy.create_node('publisher', namespace='/left', context=context)
    node.declare_parameter('speed_scaling', 1.0)
    calls = []

    def offer(name, success):
        def answer(_, response):
            calls.append(name)
            response.success, response.message = success, f'{name} answered'
            return response

        node.create_service(Trigger, f'~/{name}', answer)

    for name in ('start', 'rehearse'):
        offer(name, True)
    offer('stop', False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def spin():
        try:
            executor.spin()
        except ExternalShutdownException:
            pass

    thread = Thread(target=spin)
    thread.start()
    yield node, calls
    rclpy.shutdown(context=context)
    thread.join()


def call(*args):
    return CliRunner().invoke(main, ['call', *args, '--node', '/left/publisher'])


def test_every_call_is_answered_by_the_node(publisher):
    node, calls = publisher
    for name in ('start', 'rehearse'):
        answer = call(name)
        assert (answer.exit_code, f'{name} answered' in answer.output) == (0, True)
    refused = call('stop')
    assert (refused.exit_code, 'stop answered' in refused.output) == (2, True)
    assert calls == ['start', 'rehearse', 'stop']
    assert call('speed', '0.5').exit_code == 0
    assert node.get_parameter('speed_scaling').value == 0.5


@pytest.mark.parametrize('action', [['start'], ['stop'], ['speed', '0.5']])
def test_without_a_node_the_error_names_the_service(action):
    answer = call(*action, '--timeout', '0.2')
    assert answer.exit_code == 2
    assert '/left/publisher' in answer.output


@pytest.mark.parametrize('wrong', [['speed'], ['start', '0.5'], ['speed', '2']])
def test_a_share_belongs_to_speed(wrong):
    assert call(*wrong).exit_code == 2
