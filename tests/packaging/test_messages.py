# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The compiled messages travel between processes."""

import subprocess
import sys
import time

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile

armid_msgs = pytest.importorskip('armid_msgs.msg', reason='armid_msgs is not compiled: run make')

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PUBLISHER = """
import sys
from armid_msgs.msg import ParameterEstimate
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
rclpy.init()
node = rclpy.create_node('publisher')
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
estimate = ParameterEstimate(
    name=['Izz1 + Iyy2', 'viscous_coefficient'],
    joint=['shoulder', 'elbow'],
    unit=['kg m^2', 'N m s/rad'],
    value=[0.25, -1e-300],
    std_dev=[0.5, float('inf')],
    samples=2**63,
    condition_number=112.9,
)
estimate.header.stamp.sec = 7
node.create_publisher(ParameterEstimate, 'estimate', latched).publish(estimate)
sys.stdin.read()
"""


def test_estimate_arrives_from_another_process():
    """Every field, over DDS, to a subscriber that came late."""
    command = [sys.executable, '-c', PUBLISHER]
    publisher = subprocess.Popen(command, stdin=subprocess.PIPE)
    received = []
    context = rclpy.Context()
    rclpy.init(context=context)
    with publisher:
        node = rclpy.create_node('subscriber', context=context)
        node.create_subscription(
            armid_msgs.ParameterEstimate, 'estimate', received.append, LATCHED
        )
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        deadline = time.monotonic() + 30.0
        while not received and publisher.poll() is None and time.monotonic() < deadline:
            executor.spin_once(timeout_sec=0.1)
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown(context=context)
        publisher.stdin.close()
    (estimate,) = received
    assert estimate.header.stamp.sec == 7
    assert estimate.name == ['Izz1 + Iyy2', 'viscous_coefficient']
    assert estimate.joint == ['shoulder', 'elbow']
    assert estimate.unit == ['kg m^2', 'N m s/rad']
    assert list(estimate.value) == [0.25, -1e-300]
    assert list(estimate.std_dev) == [0.5, float('inf')]
    assert estimate.samples == 2**63
    assert estimate.condition_number == 112.9
